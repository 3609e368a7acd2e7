"""Reading of tensor meshes from files, by raycam's readers."""

from __future__ import annotations

import os
from typing import Any

from .. import io
from ..absent import raise_missing
from .mesh import TriangleMesh

__all__ = ["read_triangle_mesh"]


def read_triangle_mesh(filename: str | os.PathLike[str], *_: Any, **__: Any) -> TriangleMesh:
    """Reads the triangles of a file in any format of `raycam.load`.

    Vertices at equal positions are merged. Raises raycam's errors for missing or malformed files, whereas
    Open3D warns and returns an empty mesh.
    """
    return TriangleMesh.from_legacy(io.read_triangle_mesh(filename))


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.t.io", name, "install Open3D, or use raycam.load")
