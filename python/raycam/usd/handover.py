"""Meshes, plain materials and objects of a stage, collected and then written as arrays."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import write_arrays

__all__ = ["Handover", "MeshArrays"]

MAX_OBJECTS = 1 << 22
"""Maximum number of objects of one stage, which nested point instancers multiply."""


@dataclass
class MeshArrays:
    """The arrays of one mesh, as in `PolygonArrays` of the core."""

    points: Any
    colors: Any
    uvs: Any
    normals: Any
    polygons: Any
    corners: Any
    smooth: bool


class Handover:
    """The contents of a stage for the core.

    Raises `MemoryError` if the stage has more than `max_corners` face corners, or too many objects.
    """

    def __init__(self, max_corners: int, merged: bool) -> None:
        self.names: list[str] = []
        self._merged = merged
        self._corners_left = max_corners
        self._meshes: dict[bytes, int] = {}
        self._corner_counts: list[int] = []
        self._pieces: dict[str, list[Any]] = {
            name: [] for name in ("meshes", "points", "colors", "uvs", "normals", "polygons", "corners")
        }
        self._plain: dict[bytes, int] = {}
        self._plain_rows: list[bytes] = []
        self._object_meshes: list[int] = []
        self._object_materials: list[tuple[int, ...]] = []
        self._matrices: list[Any] = []

    def add_mesh(self, mesh: MeshArrays) -> int:
        """Adds a mesh; returns its number, which equal meshes share."""
        tables: dict[str, Any] = {
            "points": np.ascontiguousarray(mesh.points, np.float64),
            "colors": np.ascontiguousarray(mesh.colors, np.float32),
            "uvs": np.ascontiguousarray(mesh.uvs, np.float32),
            "normals": np.ascontiguousarray(mesh.normals, np.float32),
            "polygons": np.ascontiguousarray(mesh.polygons, np.uint32),
            "corners": np.ascontiguousarray(mesh.corners, np.uint32),
        }
        counts = [len(tables[name]) for name in ("points", "colors", "uvs", "normals", "polygons")]
        digest = hashlib.blake2b(repr((counts, mesh.smooth)).encode())
        for table in tables.values():
            digest.update(table.data if table.size else b"")
        number = self._meshes.setdefault(digest.digest(), len(self._meshes))
        if number == len(self._corner_counts):
            self._corner_counts.append(len(mesh.corners))
            if not self._merged:
                self._charge(len(mesh.corners))
            self._pieces["meshes"].append([*counts, int(mesh.smooth)])
            for name, table in tables.items():
                self._pieces[name].append(table)
        return number

    def _charge(self, corners: int) -> None:
        self._corners_left -= corners
        if self._corners_left < 0:
            raise MemoryError

    def add_plain(self, color: Sequence[float], opacity: float) -> int:
        """Adds a material with only a linear colour and an opacity; returns its negative number."""
        return int(self.add_plains(np.array([[*color, opacity]], np.float32))[0])

    def add_plains(self, table: Any) -> Any:
        """Adds plain materials for colours and opacities [n, 4]; returns their numbers [n].

        Numbers are negative; equal rows share a number.
        """
        table = np.ascontiguousarray(table, np.float32) + np.float32(0)  # no negative zeros
        keys, index = np.unique(table.view("V16").ravel(), return_inverse=True)
        numbers = []
        for key in map(np.ndarray.tobytes, keys.reshape(-1, 1)):
            if key not in self._plain:
                self._plain[key] = len(self._plain_rows)
                self._plain_rows.append(key)
            numbers.append(-1 - self._plain[key])
        return np.array(numbers, np.int64)[index.reshape(-1)]

    def plain_color(self, number: int) -> tuple[float, float, float, float] | None:
        """The colour and opacity of a plain material; None for another material."""
        if number >= 0:
            return None
        row = np.frombuffer(self._plain_rows[-1 - number], np.float32)
        return tuple(row.tolist())

    def add_objects(
        self, names: list[str], meshes: list[int], materials: list[tuple[int, ...]], matrices: Any
    ) -> None:
        """Adds objects with their meshes, their materials and their matrices.

        `materials` contains the materials of the slots; `matrices` are world_from_mesh [n, 3 or 4, 4].
        """
        if len(self.names) + len(names) > MAX_OBJECTS:
            raise MemoryError
        if self._merged:
            self._charge(sum(self._corner_counts[mesh] for mesh in meshes))
        self.names.extend(names)
        self._object_meshes.extend(meshes)
        self._object_materials.extend(materials)
        self._matrices.append(np.asarray(matrices, np.float64)[:, :3, :].reshape(-1, 12))

    @property
    def used_materials(self) -> set[int]:
        """The numbers of the materials that objects use."""
        return set(chain.from_iterable(self._object_materials))

    def write(self, folder: Path, order: dict[int, int]) -> None:
        """Writes the arrays. `order` maps the numbers of materials to their indices in the MTL file."""
        plain = np.frombuffer(b"".join(self._plain_rows), np.float32).reshape(-1, 4)
        numbers = np.fromiter(chain.from_iterable(self._object_materials), np.int64)
        places = np.zeros(max(order, default=0) + 1, np.int64)
        places[list(order)] = list(order.values())
        materials = np.where(numbers < 0, len(order) - 1 - numbers, places[np.maximum(numbers, 0)])
        arrays = {
            **self._pieces,
            "object_meshes": [self._object_meshes],
            "object_materials": [materials],
            "object_matrices": self._matrices,
            "plain_materials": [plain],
        }
        write_arrays(folder, arrays)
