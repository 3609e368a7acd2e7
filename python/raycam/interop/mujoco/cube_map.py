"""Reads cube maps in OpenGL's layout, as MuJoCo stores them.

Source: OpenGL 2.1 specification, table 3.19.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats

__all__ = ["cube_coordinates", "sample_cube_map", "split_by_cube_faces"]

AXES = ((2, 1, 0), (2, 1, 0), (0, 2, 1), (0, 2, 1), (0, 1, 2), (0, 1, 2))
"""The axes of s, t and of the face's normal, for the faces +x, -x, +y, -y, +z, -z."""
SIGNS = ((-1, -1), (1, -1), (1, 1), (1, -1), (1, -1), (-1, -1))
"""The signs of s and t on each face."""
SPLITTERS = np.array([[1, -1, 0], [1, 1, 0], [1, 0, -1], [1, 0, 1], [0, 1, -1], [0, 1, 1]], np.float64)
"""Normals of the six planes through the origin that separate the faces."""


def cube_coordinates(directions: Floats, faces: Any) -> Floats:
    """Returns the coordinates (s, t) [n, 2] of directions [n, 3] on the faces [n].

    Coordinates are from 0 to 1, with t = 0 at the first row.
    """
    axes, signs = np.array(AXES)[faces], np.array(SIGNS)[faces]
    chosen = np.take_along_axis(directions, axes, axis=1)
    major = np.maximum(abs(chosen[:, 2:]), np.finfo(np.float64).tiny)
    return np.asarray((signs * chosen[:, :2] / major + 1) / 2)


def faces_of(directions: Floats) -> npt.NDArray[np.int64]:
    """Returns the number of the face [n] that each direction [n, 3] meets."""
    axis = abs(directions).argmax(axis=1)
    negative = np.take_along_axis(directions, axis[:, None], axis=1)[:, 0] < 0
    return np.asarray(2 * axis + negative, np.int64)


def sample_cube_map(images: npt.NDArray[Any], directions: Floats) -> npt.NDArray[np.float32]:
    """Returns the values [n, 3] of a cube map [6, w, w, 3] in directions [n, 3].

    The values are interpolated linearly.
    """
    faces, width = faces_of(directions), images.shape[1]
    place = np.clip(cube_coordinates(directions, faces) * width - 0.5, 0, width - 1)
    low = np.minimum(place.astype(np.int64), width - 1)
    high = np.minimum(low + 1, width - 1)
    fraction = (place - low)[:, :, None]
    upper = images[faces, low[:, 1], low[:, 0]] * (1 - fraction[:, 0])
    upper = upper + images[faces, low[:, 1], high[:, 0]] * fraction[:, 0]
    lower = images[faces, high[:, 1], low[:, 0]] * (1 - fraction[:, 0])
    lower = lower + images[faces, high[:, 1], high[:, 0]] * fraction[:, 0]
    return np.asarray(upper * (1 - fraction[:, 1]) + lower * fraction[:, 1], np.float32)


def split_by_cube_faces(
    corners: Floats,
) -> tuple[Floats, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Cuts triangles where the cube map changes its face.

    `corners` [t, 3, 3] are directions. Returns the weights [m, 3, 3] of the original corners for each corner of the
    parts, the face [m] of each part, and the original triangle [m] of each part. Neighbours are cut at the same points.
    """
    weights = np.broadcast_to(np.eye(3), (len(corners), 3, 3))
    source = np.arange(len(corners), dtype=np.int64)
    for normal in SPLITTERS:
        weights, source = _cut(weights, source, corners, normal)
    middle_faces = faces_of(np.einsum("mkj,mjc->mc", weights, corners[source]) / 3)
    return weights, middle_faces, source


def _cut(weights: Floats, source: Any, corners: Floats, normal: Floats) -> tuple[Floats, Any]:
    """Cuts the parts by a plane through the origin."""
    heights = np.einsum("mkj,mj->mk", weights, corners[source] @ normal)
    scale = np.maximum(abs(heights).max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    sides = np.where(abs(heights) <= 1e-12 * scale, 0, np.sign(heights)).astype(int)
    crossed = (sides.max(axis=1) > 0) & (sides.min(axis=1) < 0)
    parts, sources = [weights[~crossed]], [source[~crossed]]
    for index in np.flatnonzero(crossed):
        for side in (1, -1):
            polygon = _clip(weights[index], side * heights[index], side * sides[index])
            fan = [[polygon[0], polygon[k], polygon[k + 1]] for k in range(1, len(polygon) - 1)]
            if fan:
                parts.append(np.array(fan))
                sources.append(np.full(len(fan), source[index]))
    return np.concatenate(parts), np.concatenate(sources)


def _clip(weights: Floats, heights: Floats, sides: Any) -> list[Floats]:
    """Returns the part of a triangle at heights of at least 0, as weights of its corners.

    Source: Sutherland and Hodgman 1974.
    """
    polygon = []
    for start in range(3):
        end = (start + 1) % 3
        if sides[start] >= 0:
            polygon.append(weights[start])
        if sides[start] * sides[end] < 0:
            a, b = (start, end) if heights[start] > 0 else (end, start)
            along = heights[a] / (heights[a] - heights[b])
            polygon.append(weights[a] + along * (weights[b] - weights[a]))
    return polygon
