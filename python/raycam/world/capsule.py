"""Meshes of capsules, a primitive of URDF and MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import Floats

__all__ = ["capsule_mesh"]


def capsule_mesh(radius: float, length: float, segments: int = 48) -> tuple[Floats, Any, Floats]:
    """Returns the vertices [v, 3], triangles [t, 3] and normals [v, 3] of a capsule along z.

    It consists of a cylinder of `length` and two half spheres of `radius` at its ends, in metres.
    """
    rings = segments // 4
    low = np.linspace(-np.pi / 2, 0, rings + 1)
    radii, heights = np.cos(low), np.sin(low)
    radii[0] = 0.0  # poles and the seam coincide exactly
    turns = np.arange(segments + 1) % segments * (2 * np.pi / segments)
    profile = [(radii[ring], heights[ring], -length / 2) for ring in range(rings + 1)]
    profile += [(radii[ring], -heights[ring], length / 2) for ring in range(rings, -1, -1)]
    normals = np.array([[r * np.cos(turn), r * np.sin(turn), h] for r, h, _ in profile for turn in turns])
    offsets = np.repeat([shift for _, _, shift in profile], len(turns))
    vertices = radius * normals + np.stack([0 * offsets, 0 * offsets, offsets], axis=1)
    width, faces = segments + 1, []
    for row in range(len(profile) - 1):
        for column in range(segments):
            a = row * width + column
            quad = [(a, a + 1, a + width + 1), (a, a + width + 1, a + width)]
            faces += quad[1:] if row == 0 else quad[:1] if row == len(profile) - 2 else quad
    return vertices, np.array(faces), normals
