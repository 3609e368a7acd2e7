"""Probes: the values of a pixel."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer import probe


def test_infinity_and_nan_of_a_miss_are_sent_as_strings(small_world: raycam.World) -> None:
    values = probe.values_at(small_world, small_world.camera("front"), None, 0, 0, ["box", "floor"])
    assert values["depth"]["numbers"] == ["Infinity"]
    assert values["position"]["numbers"] == ["NaN"] * 3
    assert values["instance"] == {"dtype": "int32", "numbers": [-1]}


def test_probed_point_equals_the_position_channel(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    seen = raycam.render(small_world, camera, channels=["position"], samples=1)
    found = probe.locate(small_world, camera, 24.5, 16.5)
    assert np.allclose(found["point"], seen["position"][16, 24], atol=1e-9)
    assert np.allclose(found["bounds"], [[-0.5] * 3, [0.5] * 3])
    along = np.subtract(found["point"], found["origin"])
    assert np.allclose(along / np.linalg.norm(along), found["direction"])
    missed = probe.locate(small_world, camera, 0.5, 0.5)
    assert (missed["point"], missed["bounds"]) == (None, None)
    assert np.allclose(missed["direction"], camera.rays([0, 0])[1], atol=1e-9)


@pytest.mark.parametrize("pixel", [(24, 16), (40, 20), (3, 29)])
def test_pixel_of_a_lens_is_explained_with_light_and_tree(
    small_world: raycam.World, pixel: tuple[int, int]
) -> None:
    camera = raycam.Camera.look_at(
        [4, -3, 2], [0, 0, 0], size=(48, 32), fov=60, distortion=[0.1, 0, 0, 0], model="fisheye"
    )
    made, lines = probe.explained(small_world, camera, *pixel)
    assert made["text"] == str(raycam.explain(small_world, camera, pixel))
    assert [each["title"] for each in made["sections"]] == ["The light", "The tree"]
    assert all(each["figure"]["lines"] and each["text"] for each in made["sections"])
    assert lines[0].points.shape[1] == 3
