"""A pixel asked for."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer import probe


def test_values_of_a_miss_are_numbers_that_json_lacks(small_world: raycam.World) -> None:
    values = probe.values_at(small_world, small_world.camera("front"), None, 0, 0)
    assert values["depth"]["numbers"] == ["Infinity"]
    assert values["position"]["numbers"] == ["NaN"] * 3
    assert values["instance"] == {"dtype": "int32", "numbers": [-1]}


def test_points_are_those_of_position(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    seen = raycam.render(small_world, camera, channels=["position"], samples=1)
    assert np.allclose(probe.point_at(small_world, camera, 24.5, 16.5), seen["position"][16, 24], atol=1e-9)
    assert probe.point_at(small_world, camera, 0.5, 0.5) is None


@pytest.mark.parametrize("pixel", [(24, 16), (40, 20), (3, 29)])
def test_a_lens_is_explained_by_the_pinhole_that_has_the_ray(
    small_world: raycam.World, pixel: tuple[int, int]
) -> None:
    camera = raycam.Camera.look_at(
        [4, -3, 2], [0, 0, 0], size=(48, 32), fov=60, distortion=[0.1, 0, 0, 0], model="fisheye"
    )
    pinhole = probe._pinhole(camera, *pixel)
    at = np.array(pixel) + camera.corner + 0.5
    assert np.allclose(pinhole.rays(at)[1], camera.rays(at)[1], atol=1e-12)
    made = probe.explained(small_world, camera, *pixel)
    assert made["text"].startswith("The camera has a lens (fisheye).")
    seen = raycam.render(small_world, camera, channels=["triangle", "instance"], samples=1)
    instance, triangle = (int(seen[name][pixel[1], pixel[0]]) for name in ("instance", "triangle"))
    assert (f"triangle {triangle}" in made["text"]) == (instance >= 0)


def test_parallel_rays_are_not_explained(small_world: raycam.World) -> None:
    camera = raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], size=(48, 32), height=4)
    with pytest.raises(raycam.CameraError, match="parallel"):
        probe.explained(small_world, camera, 1, 1)
