"""Baked maps that do not depend on the processor's BLAS kernel."""

from __future__ import annotations

import sys

import pytest
from support.blas_kernels import outputs_by_kernel

SCRIPT = """
import hashlib
import numpy as np
import raycam

world = raycam.World()
random = np.random.default_rng(5)
cells = 6
side = np.arange(cells + 1) / cells
u, v = (each.ravel() for each in np.meshgrid(side, side))
corner = np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)
a, b, c, d = corner, corner + cells + 1, corner + cells + 2, corner + 1
faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=-2).reshape(-1, 3)
normals = random.normal(scale=0.3, size=(len(u), 3)) + [0, 0, 1]
normals /= np.sqrt((normals**2).sum(axis=1, keepdims=True))
points = np.stack([2 * u - 1, 1 - 2 * v, random.normal(scale=0.05, size=len(u))], axis=1)
matrix = np.eye(4)
matrix[:3] = [[0.83, -0.41, 0.17, 0.3], [0.29, 0.77, -0.38, -1.1], [0.11, 0.36, 0.91, 2.7]]
world.add_mesh(points, faces, uvs=np.stack([u, v], axis=1), normals=normals, matrix=matrix)
maps = ["position", "normal", "tangent_normal", "shading_normal", "ao", "bent_normal", "thickness", "curvature"]
found = raycam.bake(world, maps, size=64, samples=4)
for name in maps:
    print(name, hashlib.sha256(np.ascontiguousarray(found[name]).tobytes()).hexdigest())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="OPENBLAS_CORETYPE selects the kernel on Linux only")
def test_maps_do_not_depend_on_the_blas_kernel() -> None:
    outputs = outputs_by_kernel(SCRIPT)
    assert len(outputs) >= 2
    assert len(set(outputs)) == 1
