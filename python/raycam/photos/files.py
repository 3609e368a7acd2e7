"""Files of visible faces."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from ..io.atomic_files import write
from ..world import World
from ..world.face_geometry import unique_rows
from .face_keys import face_keys
from .visibility import SurfaceVisibility

__all__ = ["save_faces", "save_visibility"]

PROPERTIES = (
    ("views", "int", "<i4"),
    ("fraction", "float", "<f4"),
    ("best_view", "int", "<i4"),
    ("best_resolution", "float", "<f4"),
    ("angle", "float", "<f4"),
)


def save_faces(
    path: str | os.PathLike[str], world: World, seen: SurfaceVisibility, kept: npt.NDArray[np.bool_]
) -> None:
    """Writes the faces where `kept` [n] is True as binary PLY, with their visibility.

    Positions are in world coordinates. Positions are float64 if float32 would round them. Vertices at the same position
    are merged.
    """
    rows = np.searchsorted(face_keys(world.triangle_ids()), face_keys(seen.ids[kept]))
    vertices, faces = unique_rows(world.triangles()[rows].reshape(-1, 3))
    single = bool((vertices.astype(np.float32) == vertices).all())
    kind = "float" if single else "double"
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment raycam visible",
        f"element vertex {len(vertices)}",
    ]
    lines += [f"property {kind} {axis}" for axis in "xyz"]
    lines += [f"element face {len(rows)}", "property list uchar int vertex_indices"]
    lines += [f"property {text} {name}" for name, text, _ in PROPERTIES]
    table = np.zeros(
        len(rows), [("n", "u1"), ("corners", "<i4", 3), *((name, code) for name, _, code in PROPERTIES)]
    )
    table["n"], table["corners"] = 3, faces.reshape(-1, 3)
    for name, _, _ in PROPERTIES:
        table[name] = getattr(seen, name)[kept]
    head = "\n".join([*lines, "end_header", ""]).encode()
    write(path, head + vertices.astype("<f4" if single else "<f8").tobytes() + table.tobytes())


def save_visibility(path: str | os.PathLike[str], seen: SurfaceVisibility) -> None:
    """Writes the arrays to an NPZ file."""
    import io

    stream = io.BytesIO()
    names = ("ids", "views", "fraction", "best_view", "best_resolution", "angle", "faces_seen")
    arrays = {name: getattr(seen, name) for name in names}
    np.savez_compressed(stream, names=np.array(seen.names), **arrays)
    write(path, stream.getvalue())
