"""Meshes of simple shapes, as returned by Open3D's `create_...`.

The vertices and triangles are in Open3D's order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from .arguments import RaycastingError

__all__ = ["SHAPES"]

Floats = npt.NDArray[np.float64]
Ids = npt.NDArray[np.int64]
Shape = tuple[Floats, Ids]

GOLDEN_RATIO = (1 + np.sqrt(5)) / 2


def _check(**given: Any) -> None:
    """Raises `RaycastingError` for sizes and resolutions that are not positive, as Open3D does."""
    for name, value in given.items():
        if not value > 0:
            raise RaycastingError(f"{name}: expected a positive number, got {value!r}")


def create_box(width: float = 1.0, height: float = 1.0, depth: float = 1.0) -> Shape:
    """Returns a box from the origin to (width, height, depth).

    The box has 8 vertices (x fastest, then z, then y) and 12 triangles.
    """
    _check(width=width, height=height, depth=depth)
    y, z, x = np.meshgrid([0.0, height], [0.0, depth], [0.0, width], indexing="ij")
    triangles = [
        [[4, 7, 5], [4, 6, 7]],
        [[0, 2, 4], [2, 6, 4]],
        [[0, 1, 2], [1, 3, 2]],
        [[1, 5, 7], [1, 7, 3]],
        [[2, 3, 7], [2, 7, 6]],
        [[0, 4, 1], [1, 4, 5]],
    ]
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), np.array(triangles).reshape(-1, 3)


def create_tetrahedron(radius: float = 1.0) -> Shape:
    """A regular tetrahedron in a sphere around the origin, its last vertex at +z."""
    _check(radius=radius)
    angle = np.radians([0.0, 120.0, 240.0])
    base = np.column_stack([np.sqrt(8) / 3 * np.cos(angle), np.sqrt(8) / 3 * np.sin(angle), [-1 / 3] * 3])
    triangles = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]
    return radius * np.vstack([base, [0.0, 0.0, 1.0]]), np.array(triangles)


def create_octahedron(radius: float = 1.0) -> Shape:
    """A regular octahedron with its vertices on the axes."""
    _check(radius=radius)
    vertices = radius * np.vstack([np.eye(3), -np.eye(3)])
    upper = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]
    lower = [[0, 5, 1], [1, 5, 3], [3, 5, 4], [4, 5, 0]]
    return vertices, np.array(upper + lower)


def create_icosahedron(radius: float = 1.0) -> Shape:
    """Returns a regular icosahedron with edges of length 2 `radius`, as in Open3D.

    The vertices are the corners of three golden rectangles.
    """
    _check(radius=radius)
    p = GOLDEN_RATIO
    vertices = [
        [[-1, 0, p], [1, 0, p], [1, 0, -p], [-1, 0, -p]],
        [[0, -p, 1], [0, p, 1], [0, p, -1], [0, -p, -1]],
        [[-p, -1, 0], [p, -1, 0], [p, 1, 0], [-p, 1, 0]],
    ]
    triangles = [
        [[0, 4, 1], [0, 1, 5], [1, 4, 9], [1, 9, 10], [1, 10, 5]],
        [[0, 8, 4], [0, 11, 8], [0, 5, 11], [5, 6, 11], [5, 10, 6]],
        [[4, 8, 7], [4, 7, 9], [3, 6, 2], [3, 2, 7], [2, 6, 10]],
        [[2, 10, 9], [2, 9, 7], [3, 11, 6], [3, 8, 11], [3, 7, 8]],
    ]
    return radius * np.array(vertices, dtype=np.float64).reshape(-1, 3), np.array(triangles).reshape(-1, 3)


def create_sphere(radius: float = 1.0, resolution: int = 20) -> Shape:
    """Returns a sphere of the given `radius` around the origin.

    The vertices are two poles and `resolution` - 1 rings of 2 `resolution` vertices, from +z to -z.
    """
    _check(radius=radius)
    if resolution < 2:
        raise RaycastingError(f"resolution: expected at least 2 for a sphere, got {resolution!r}")
    count = 2 * resolution
    across = np.pi / resolution
    polar, around = np.meshgrid(np.arange(1, resolution) * across, np.arange(count) * across, indexing="ij")
    rings = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    vertices = radius * np.vstack([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], rings.reshape(-1, 3)])
    last = 2 + count * (resolution - 2)
    return vertices, np.concatenate(
        [_caps(count, 2, last), *(_band(count, 2 + count * ring) for ring in range(resolution - 2))]
    )


def create_cylinder(radius: float = 1.0, height: float = 2.0, resolution: int = 20, split: int = 4) -> Shape:
    """Returns a closed cylinder of the given `radius` and `height` along z, around the origin.

    The vertices are the centres of the cylinder's ends, then `split` + 1 rings of `resolution` vertices from +z to
    -z.
    """
    _check(radius=radius, height=height, resolution=resolution, split=split)
    around = np.arange(resolution) * (2 * np.pi / resolution)
    heights = height / 2 - np.arange(split + 1) * (height / split)
    rings = np.stack(
        [
            np.tile(radius * np.cos(around), split + 1),
            np.tile(radius * np.sin(around), split + 1),
            np.repeat(heights, resolution),
        ],
        axis=1,
    )
    vertices = np.vstack([[0.0, 0.0, height / 2], [0.0, 0.0, -height / 2], rings])
    bands = [_band(resolution, 2 + resolution * ring) for ring in range(split)]
    return vertices, np.concatenate([_caps(resolution, 2, 2 + resolution * split), *bands])


def create_cone(radius: float = 1.0, height: float = 2.0, resolution: int = 20, split: int = 1) -> Shape:
    """A closed cone from its base of the given `radius` at z = 0 to its tip at z = `height`.

    The vertices are the base's centre, the tip, and then `split` rings of `resolution` vertices from the base
    upwards.
    """
    _check(radius=radius, height=height, resolution=resolution, split=split)
    around = np.arange(resolution) * (2 * np.pi / resolution)
    shares = 1 - np.arange(split) / split
    rings = np.stack(
        [
            np.outer(radius * shares, np.cos(around)).ravel(),
            np.outer(radius * shares, np.sin(around)).ravel(),
            np.repeat(height * (1 - shares), resolution),
        ],
        axis=1,
    )
    vertices = np.vstack([[0.0, 0.0, 0.0], [0.0, 0.0, height], rings])
    first = 2 + np.arange(resolution)
    following = 2 + (np.arange(resolution) + 1) % resolution
    top = resolution * (split - 1)
    base = np.stack([np.zeros_like(first), following, first], axis=1)
    tip = np.stack([np.ones_like(first), first + top, following + top], axis=1)
    ends = np.stack([base, tip], axis=1).reshape(-1, 3)
    sides = []
    for ring in range(split - 1):
        low, high = resolution * ring, resolution * (ring + 1)
        one = np.stack([following + high, first + low, following + low], axis=1)
        two = np.stack([following + high, first + high, first + low], axis=1)
        sides.append(np.stack([one, two], axis=1).reshape(-1, 3))
    return vertices, np.concatenate([ends, *sides])


def create_torus(
    torus_radius: float = 1.0,
    tube_radius: float = 0.5,
    radial_resolution: int = 30,
    tubular_resolution: int = 20,
) -> Shape:
    """A torus around z: `radial_resolution` circles of `tubular_resolution` vertices."""
    _check(torus_radius=torus_radius, tube_radius=tube_radius)
    _check(radial_resolution=radial_resolution, tubular_resolution=tubular_resolution)
    m, n = radial_resolution, tubular_resolution
    around, along = np.meshgrid(np.arange(m) * (2 * np.pi / m), np.arange(n) * (2 * np.pi / n), indexing="ij")
    distance = torus_radius + tube_radius * np.cos(along)
    vertices = np.stack(
        [distance * np.cos(around), distance * np.sin(around), tube_radius * np.sin(along)], axis=-1
    )
    i, j = np.meshgrid(np.arange(m), np.arange(n), indexing="ij")
    after, following = (i + 1) % m * n, (j + 1) % n
    one = np.stack([after + j, after + following, i * n + j], axis=-1)
    two = np.stack([i * n + j, after + following, i * n + following], axis=-1)
    return vertices.reshape(-1, 3), np.stack([one, two], axis=2).reshape(-1, 3)


def _caps(count: int, first: int, last: int) -> Ids:
    """Returns the triangles that connect vertices 0 and 1 with two rings of `count` vertices.

    The triangles of vertex 0 and the ring at `first` alternate with those of vertex 1 and the ring at `last`.
    """
    j = np.arange(count)
    following = (j + 1) % count
    upper = np.stack([np.zeros_like(j), first + j, first + following], axis=1)
    lower = np.stack([np.ones_like(j), last + following, last + j], axis=1)
    return np.stack([upper, lower], axis=1).reshape(-1, 3)


def _band(count: int, start: int) -> Ids:
    """Two triangles for each gap between the ring at `start` and the ring below it."""
    j = np.arange(count)
    following = (j + 1) % count
    one = np.stack([start + count + j, start + following, start + j], axis=1)
    two = np.stack([start + count + j, start + count + following, start + following], axis=1)
    return np.stack([one, two], axis=1).reshape(-1, 3)


SHAPES: dict[str, Callable[..., Shape]] = {
    "box": create_box,
    "sphere": create_sphere,
    "cylinder": create_cylinder,
    "cone": create_cone,
    "torus": create_torus,
    "tetrahedron": create_tetrahedron,
    "octahedron": create_octahedron,
    "icosahedron": create_icosahedron,
}
"""The functions by the names of their shapes."""
