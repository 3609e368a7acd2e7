"""Normals and areas of triangles given by their corners."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats

__all__ = ["face_areas", "face_normals"]


def face_normals(corners: Floats) -> Floats:
    """Returns unit normals [n, 3] of triangles [n, 3, 3], counter-clockwise seen from outside; 0 for zero area."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt((across**2).sum(axis=1, keepdims=True))
    normals: Floats = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    return normals


def face_areas(corners: Floats) -> Floats:
    """Returns the areas [n] of triangles [n, 3, 3], in the square of their unit."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas: Floats = np.sqrt((across**2).sum(axis=1)) / 2
    return areas
