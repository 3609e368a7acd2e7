"""Files of meshes of tensors, by raycam's readers."""

from __future__ import annotations

import os
from typing import Any

from .. import io
from ..absent import raise_missing
from .mesh import TriangleMesh

__all__ = ["read_triangle_mesh"]


def read_triangle_mesh(filename: str | os.PathLike[str], *_: Any, **__: Any) -> TriangleMesh:
    """The triangles of a file of any format that `raycam.load` reads, with vertices at one place merged.

    Raises raycam's errors for files that are missing or malformed, while Open3D warns and returns an empty mesh.
    """
    return TriangleMesh.from_legacy(io.read_triangle_mesh(filename))


def __getattr__(name: str) -> Any:
    """Raises `AttributeError` with an alternative."""
    return raise_missing("open3d.t.io", name, "install Open3D for it, or use raycam.load")
