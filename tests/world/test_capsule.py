"""Meshes of capsules."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.world.capsule import capsule_mesh


def test_capsule_mesh_is_closed_and_has_its_volume() -> None:
    world = raycam.World()
    vertices, faces, _ = capsule_mesh(0.5, 2.0, segments=256)
    world.add_mesh(vertices, faces, name="capsule")
    topology = world.topology("capsule")
    assert topology.closed
    assert topology.volume == pytest.approx(np.pi * 0.25 * 2 + 4 / 3 * np.pi * 0.125, rel=1e-3)
    assert world.bounds.tolist() == [[-0.5, -0.5, -1.5], [0.5, 0.5, 1.5]]
