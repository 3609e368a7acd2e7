"""The models of a BOP data set: the distinct shapes of its objects, as meshes in millimetres."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..annotations.labels import box3d
from ..arguments import Floats, lengths, product
from .per_world import part, world_count
from .plan import Plan, Record

__all__ = ["MILLIMETRES", "ModelCatalogue", "models"]

MILLIMETRES = 1000.0
MANY = 20_000
PAIRS = 32_768
"""Pairs of vertices that are compared at a time, which bounds the memory."""
ALIKE = 1e-7
"""Tolerance for equal shapes in different worlds, as a fraction of their size: vertices are transformed back from the
world, with rounding."""


class Models:
    """The distinct shapes among the labelled objects: the same mesh with the same scale is the same model."""

    def __init__(self, plan: Plan) -> None:
        self.of_object: dict[int, int] = {}
        """The BOP id of each object, from 1."""
        self.vertices: dict[int, tuple[Floats, Floats]] = {}
        """The vertices [n, 3] in millimetres and triangles [m, 3] of each model."""
        known: dict[tuple[int, bytes], int] = {}
        for number in plan.labelled:
            item = plan.objects[number]
            shape = product(box3d(plan.world, number).rotation.T, item.matrix[:3, :3])
            size = np.abs(shape).max()
            key = (item.mesh, f"{size:.9g}".encode() + ((shape / size).round(9) + 0.0).tobytes())
            self.of_object[number] = known.setdefault(key, len(known) + 1)
        self.first = {model: number for number, model in reversed(self.of_object.items())}
        """The first object of each model."""


_models: WeakKeyDictionary[Plan, Models] = WeakKeyDictionary()


def models(plan: Plan) -> Models:
    """The models of a plan, computed once."""
    if plan not in _models:
        _models[plan] = Models(plan)
    return _models[plan]


Known = dict[int, list[tuple[float, Floats, int]]]
"""Models by their number of triangles: size, fingerprint of the shape, and id."""


class ModelCatalogue:
    """The models of all worlds of a data set, each shape once."""

    def __init__(self, plan: Plan) -> None:
        self.ids: list[dict[int, int]] = []
        """For each world, the ids in the data set, from 1, by the ids in the world."""
        self._first: dict[int, tuple[int, int]] = {}
        known: Known = {}
        for world in range(world_count(plan)):
            own = scene(plan, world)
            ids: dict[int, int] = {}
            for model, number in sorted(models(own).first.items()):
                ids[model] = model if plan.recipe is None else self._like(own, number, known)
                self._first.setdefault(ids[model], (world, number))
            self.ids.append(ids)

    @property
    def all(self) -> list[int]:
        """The ids of all models."""
        return sorted(self._first)

    def _like(self, own: Plan, number: int, known: Known) -> int:
        """The id of the model with the shape of an object, or the next free id for a new shape."""
        count, size, found = fingerprint(own, number)
        alike = known.setdefault(count, [])
        for other_size, other, model in alike:
            if abs(size / other_size - 1) <= ALIKE and np.abs(found - other).max() <= ALIKE:
                return model
        alike.append((size, found, sum(map(len, known.values())) + 1))
        return alike[-1][2]

    def meshes(self, plan: Plan) -> Iterator[tuple[int, Record, list[bytes]]]:
        """Iterates over the models: id, row of models_info.json, and PLY file."""
        for model, (world, number) in sorted(self._first.items()):
            own = scene(plan, world)
            vertices, triangles = model_mesh(own, number)
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            information = {
                "diameter": diameter(vertices),
                **{f"min_{axis}": float(value) for axis, value in zip("xyz", low, strict=True)},
                **{f"size_{axis}": float(value) for axis, value in zip("xyz", high - low, strict=True)},
                "name": own.objects[number].name,
            }
            yield model, information, ply(vertices, triangles)


def scene(plan: Plan, world: int) -> Plan:
    """The part of the plan with the views of one world."""
    return plan if plan.recipe is None else part(plan, world)


def to_model_space(plan: Plan, number: int, points: Floats) -> Floats:
    """Transforms points [n, 3] of an object from the world to model space, in millimetres."""
    rotation, origin = box3d(plan.world, number).rotation, plan.objects[number].matrix[:3, 3]
    return product(points - origin, rotation) * MILLIMETRES


def fingerprint(plan: Plan, number: int) -> tuple[int, float, Floats]:
    """The number of triangles of an object, its size in millimetres, and a scale-free fingerprint of its shape."""
    corners = plan.world.triangles(number).reshape(-1, 3)
    points = to_model_space(plan, number, corners)
    size = float(np.sqrt((points**2).mean())) or 1.0
    unit = points / size
    others = np.roll(unit, 1, axis=1)
    moments = [
        unit.mean(axis=0),
        (unit**2).mean(axis=0),
        (unit**3).mean(axis=0),
        (unit * others**2).mean(axis=0),
    ]
    return len(corners) // 3, size, np.concatenate([*moments, *unit[[0, len(unit) // 2, -1]]])


def model_mesh(plan: Plan, number: int) -> tuple[Floats, Any]:
    """The distinct vertices of an object in model space, in millimetres, and its triangles."""
    corners = plan.world.triangles(number).reshape(-1, 3)
    vertices, triangles = np.unique(corners, axis=0, return_inverse=True)
    return to_model_space(plan, number, vertices), triangles.reshape(-1, 3)


def diameter(vertices: Floats) -> float:
    """The largest distance between two vertices; vertices too near to the middle are skipped.

    The result is exact unless more than 20,000 candidates are left, as on a fine sphere. Then it is the largest extent
    along 4096 directions.
    """
    center = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = lengths(vertices - center)
    reach = radius.max()
    at_least = lengths(vertices - vertices[radius.argmax()]).max()
    outer = vertices[radius >= (at_least - reach) * (1 - 1e-9)]
    if len(outer) > MANY:
        directions = np.random.default_rng(0).normal(size=(4096, 3))
        directions /= lengths(directions)[:, None]
        return max(float(np.ptp(product(outer, direction))) for direction in directions)
    largest, step = 0.0, max(1, PAIRS // len(outer))
    for start in range(0, len(outer), step):
        squares = sum(
            (outer[start : start + step, None, axis] - outer[None, start:, axis]) ** 2 for axis in range(3)
        )
        largest = max(largest, float(np.max(squares)))
    return float(np.sqrt(largest))


def ply(vertices: Floats, triangles: Any) -> list[bytes]:
    """The pieces of a binary PLY file."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, triangles
    return [header.encode(), vertices.astype("<f4").tobytes(), faces.tobytes()]
