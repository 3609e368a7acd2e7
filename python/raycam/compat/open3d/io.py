"""Reading of meshes from files, with raycam's readers."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from raycam import load

from .absent import raise_missing
from .geometry import TriangleMesh

__all__ = ["read_triangle_mesh"]


def read_triangle_mesh(filename: str | os.PathLike[str], *_: Any, **__: Any) -> TriangleMesh:
    """Reads the triangles of a file in any format of `raycam.load`.

    Vertices at equal positions are merged. Raises raycam's errors for missing or malformed files, whereas
    Open3D warns and returns an empty mesh.
    """
    corners = load(filename).triangles().reshape(-1, 3)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return TriangleMesh(vertices, index.reshape(-1, 3))


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.io", name, "install Open3D, or use raycam.load")
