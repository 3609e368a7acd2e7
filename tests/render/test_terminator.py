"""The terminator of smooth coarse meshes.

Light ends according to the interpolated normals, and energy is conserved.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import raycam

SIZE = (96, 96)
E = 2.0
KINDS: list[dict[str, Any]] = [
    {},
    {"specular": 0.0001, "shininess": 4},
    {"type": "principled", "roughness": 1.0, "specular": 0.0},
]


def smooth(shape: dict[str, Any], **keys: Any) -> tuple[raycam.World, raycam.Camera]:
    world = raycam.World()
    world.add_object(shape, **{"color": [0.7, 0.7, 0.7]} | keys)
    camera = world.view_from([1, 0, 0.2], size=SIZE)
    return world, camera


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("level", [1, 2, 3])
@pytest.mark.parametrize("scale", [1, [1, 1.6, 0.7]])
def test_convex_smooth_mesh_is_lit_according_to_its_normals(
    kind: dict[str, Any], level: int, scale: Any
) -> None:
    world, camera = smooth({"sphere": {"level": level}}, scale=scale, **kind)
    to_sun = np.array([0.3, 0.8, 0.5])
    to_sun /= np.linalg.norm(to_sun)
    world.add_light("sun", direction=(-to_sun).tolist(), irradiance=E, angular_diameter=0)
    frame = raycam.render(
        world, camera, samples=1, channels=["color", "shading_normal", "normal", "instance"]
    )
    there = frame["instance"] == 0
    cosine = frame["shading_normal"] @ to_sun
    expected = np.maximum(cosine, 0) * 0.7 / math.pi * E
    seen = frame["color"][..., 1]
    cut = there & (cosine > 0.02) & (frame["normal"] @ to_sun <= 0)
    assert cut.sum() > 3, "triangles that face away from the light, of a surface that does not"
    assert (seen[cut] > 0).mean() > 0.97
    np.testing.assert_array_equal(seen[there & (cosine <= 0)], 0)
    if not kind:
        lit = there & (seen > 0)
        np.testing.assert_allclose(seen[lit], expected[lit], rtol=2e-4, atol=1e-6)


def test_terminator_of_a_coarse_torus_equals_the_terminator_of_a_fine_torus() -> None:
    off = {}
    world, camera = smooth({"torus": {"segments": 1024}})
    for segments in (16, 32, 64, 1024):
        world, _ = smooth({"torus": {"segments": segments}})
        world.add_light("sun", direction=[-0.2, -1, -0.4], irradiance=E, angular_diameter=0)
        off[segments] = raycam.render(world, camera, samples=16)["color"][..., 0]
    for segments, most in ((16, 0.05), (32, 0.02), (64, 0.01)):
        assert np.abs(off[segments] - off[1024]).mean() < most, np.abs(off[segments] - off[1024]).mean()


@pytest.mark.parametrize("kind", [*KINDS, {"type": "metal", "roughness": 0.4, "color": [1, 1, 1]}])
@pytest.mark.parametrize("level", [1, 2])
def test_smooth_mesh_in_a_white_furnace_is_white(kind: dict[str, Any], level: int) -> None:
    world, camera = smooth({"sphere": {"level": level}}, **kind)
    world.set_object(0, color=[1, 1, 1])
    world.add_light("sky", radiance=1.0)
    frame = raycam.render(
        world, camera, integrator="path", samples=64, channels=["color", "instance", "coverage"]
    )
    inside = (frame["instance"] == 0) & (frame["coverage"] == 1)
    mean = frame["color"][inside].mean()
    low = 0.97 if kind.get("type") == "metal" else 0.99
    assert low < mean < 1.003, mean


def test_terminator_does_not_depend_on_threads() -> None:
    world, camera = smooth({"sphere": {"level": 1}})
    world.add_light("sun", direction=[-0.2, -1, -0.4], irradiance=E)
    one, many = (
        raycam.render(world, camera, integrator="path", samples=4, threads=n)["color"] for n in (1, 3)
    )
    np.testing.assert_array_equal(one, many)
