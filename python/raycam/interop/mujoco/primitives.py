"""Meshes of primitive geoms with the texture coordinates of MuJoCo 4's renderer."""

from __future__ import annotations

import numpy as np

from ...arguments import Floats
from .model import BOX, CAPSULE, CYLINDER, ELLIPSOID, PLANE, SPHERE

__all__ = ["TexturedMesh", "textured_primitive"]

SEGMENTS = 96
"""The number of sides of round shapes."""

TexturedMesh = tuple[Floats, Floats | None, Floats]
"""Corners [t, 3, 3] in metres, normals [t, 3, 3] (None for flat faces) and texture coordinates [t, 3, 2]."""


def textured_primitive(kind: int, size: Floats) -> TexturedMesh:
    """Returns the mesh of a primitive geom with `mjModel.geom_size` [3].

    The texture's first row is at v = 0. Boxes and planes show the texture once on each face; spheres and
    ellipsoids show the texture by longitude and latitude. The sides of cylinders and capsules show the
    texture once, and so does each half sphere of a capsule. The ends of a cylinder show the texture
    projected along the axis.
    """
    if kind == PLANE:
        return _quad(np.array([size[0], size[1], 0.0]), 0, 1, 1.0)
    if kind == BOX:
        sides = [_quad(size, *axes, sign) for axes in ((0, 1), (0, 2), (1, 2)) for sign in (1.0, -1.0)]
        return np.concatenate([side[0] for side in sides]), None, np.concatenate([side[2] for side in sides])
    if kind in (SPHERE, ELLIPSOID):
        half = size if kind == ELLIPSOID else np.full(3, size[0])
        return _revolve(
            np.linspace(90, -90, SEGMENTS // 2 + 1), half, 0.0, np.linspace(0, 1, SEGMENTS // 2 + 1)
        )
    radius, half_length = float(size[0]), float(size[1])
    side = _revolve(
        np.zeros(2), np.full(3, radius), np.array([half_length, -half_length]), np.array([0.0, 1.0])
    )
    if kind == CYLINDER:
        return _joined([side, _disk(radius, half_length), _disk(radius, -half_length)])
    assert kind == CAPSULE
    angles, steps = np.linspace(90, 0, SEGMENTS // 4 + 1), np.linspace(0, 1, SEGMENTS // 4 + 1)
    top = _revolve(angles, np.full(3, radius), half_length, steps)
    bottom = _revolve(-angles[::-1], np.full(3, radius), -half_length, steps)
    return _joined([side, top, bottom])


def _quad(half: Floats, first: int, second: int, sign: float) -> TexturedMesh:
    """The face of a box along two axes, on the positive or negative side of the third axis."""
    third = 3 - first - second
    flat = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float64)
    points = np.zeros((4, 3))
    points[:, [first, second]] = flat * half[[first, second]]
    points[:, third] = sign * half[third]
    outward = np.cross(points[1] - points[0], points[2] - points[0])[third] * sign >= 0
    order = np.array([[0, 1, 2], [0, 2, 3]] if outward else [[0, 2, 1], [0, 3, 2]])
    uvs = (1 + flat * [1, -1]) / 2
    return points[order], None, uvs[order]


def _revolve(latitudes: Floats, half: Floats, shift: Floats | float, rows: Floats) -> TexturedMesh:
    """Returns a surface of revolution: rings at latitudes (degrees) of an ellipsoid.

    The rings are shifted along z by `shift`, and `rows` contains their v. If all latitudes are 0, all rings
    are circles of the same size, and `shift` contains their heights. Vertices of the seam and poles coincide.
    """
    count = len(latitudes)
    cosines, sines = np.cos(np.radians(latitudes)), np.sin(np.radians(latitudes))
    cosines[abs(latitudes) == 90] = 0.0
    turns = 2 * np.pi * (np.arange(SEGMENTS + 1) % SEGMENTS) / SEGMENTS
    unit = np.stack(
        [
            cosines[:, None] * np.cos(turns),
            cosines[:, None] * np.sin(turns),
            np.broadcast_to(sines[:, None], (count, SEGMENTS + 1)),
        ],
        axis=2,
    )
    points = unit * half
    points[..., 2] += np.broadcast_to(shift, (count,))[:, None]
    normals = unit / half
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    uvs = np.stack(np.broadcast_arrays(np.arange(SEGMENTS + 1) / SEGMENTS, rows[:, None]), axis=2).astype(
        np.float64
    )
    row, column = (index.ravel() for index in np.mgrid[: count - 1, :SEGMENTS])
    places = [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)]
    found: list[list[Floats]] = [[], [], []]
    for order in ((0, 1, 2), (0, 2, 3)):
        parts = [
            np.stack([grid[places[place]] for place in order], axis=1) for grid in (points, normals, uvs)
        ]
        edges = np.cross(parts[0][:, 1] - parts[0][:, 0], parts[0][:, 2] - parts[0][:, 0])
        kept = np.linalg.norm(edges, axis=1) > 0
        for values, part in zip(found, parts, strict=True):
            values.append(part[kept])
    return np.concatenate(found[0]), np.concatenate(found[1]), np.concatenate(found[2])


def _disk(radius: float, height: float) -> TexturedMesh:
    """An end of a cylinder; `height` is negative for the lower end."""
    turns = 2 * np.pi * (np.arange(SEGMENTS + 1) % SEGMENTS) / SEGMENTS
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    flat = np.stack([np.zeros((SEGMENTS, 2)), ring[:-1], ring[1:]], axis=1)
    flat = flat if height > 0 else flat[:, ::-1]
    corners = np.concatenate([radius * flat, np.full((*flat.shape[:2], 1), height)], axis=2)
    normals = np.zeros_like(corners)
    normals[..., 2] = np.sign(height)
    return corners, normals, (1 + flat) / 2


def _joined(parts: list[TexturedMesh]) -> TexturedMesh:
    corners = np.concatenate([part[0] for part in parts])
    normals = np.concatenate([part[1] for part in parts if part[1] is not None])
    return corners, normals, np.concatenate([part[2] for part in parts])
