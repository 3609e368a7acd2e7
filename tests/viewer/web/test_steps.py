"""The steps of the lecture in the page: the numbers of `raycam.explain`."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import raycam
from raycam.viewer.scene import navigation
from support.node_core import needs_node, run

pytestmark = needs_node
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


def asked(world: raycam.World, camera: raycam.Camera, pixel: tuple[int, int]) -> str:
    return json.dumps(
        {
            "P": camera.P.ravel().tolist(),
            "size": list(camera.size),
            "offset": 0 if camera.pixel_center == "integer" else 0.5,
            "column": pixel[0],
            "row": pixel[1],
            "names": [each.name for each in world.objects],
            "corners": np.asarray(world.triangles()).ravel().tolist(),
            "ids": np.asarray(world.triangle_ids()).ravel().tolist(),
            "colors": np.asarray(world.triangle_colors(), float).ravel().tolist(),
        }
    )


@pytest.mark.parametrize("pixel", [(24, 16), (20, 20), (5, 28), (40, 1), (47, 31)])
@pytest.mark.parametrize("name", ["front", "side"])
def test_text_is_that_of_raycam(small_world: raycam.World, name: str, pixel: tuple[int, int]) -> None:
    camera = small_world.camera(name)
    found = run(f"return explanationText({asked(small_world, camera, pixel)});").splitlines()
    expected = str(raycam.explain(small_world, camera, pixel)).splitlines()
    assert [NUMBER.sub("#", line).split() for line in found] == [
        NUMBER.sub("#", line).split() for line in expected
    ]
    for mine, theirs in zip(found, expected, strict=True):
        values = [[float(number) for number in NUMBER.findall(line)] for line in (mine, theirs)]
        np.testing.assert_allclose(values[0], values[1], rtol=2e-5, atol=1e-9, err_msg=mine)


def test_numbers_are_as_c_prints_them() -> None:
    random = np.random.default_rng(2)
    values = [0.0, 1.0, -2.5, 1e-5, 123456.0, 1234567.0, 999999.5, 0.1, 1 / 3, 1e300, -1e-300]
    values += (random.standard_normal(500) * 10.0 ** random.integers(-12, 12, 500)).tolist()
    found = run(f"return {json.dumps(values)}.map(general);")
    assert found == [f"{value + 0.0:.6g}" for value in values]


@pytest.mark.parametrize("kind", ["orbit", "look", "pan", "dolly", "move", "fit"])
def test_navigation_is_that_of_the_server(small_world: raycam.World, kind: str) -> None:
    camera, pivot = small_world.camera("front"), np.array([0.2, 0.1, 0.3])
    bounds = small_world.bounds
    expected = {
        "orbit": lambda: navigation.orbit(camera, pivot, 0.3, -0.2),
        "look": lambda: navigation.turn_camera(camera, 0.3, -2.0),
        "pan": lambda: navigation.pan(camera, pivot, 12, -7),
        "dolly": lambda: navigation.dolly(camera, pivot, 1.3),
        "move": lambda: navigation.move(camera, 0.1, 0.2, 0.3),
        "fit": lambda: navigation.fit(camera, bounds),
    }[kind]()
    pose = json.dumps({"R": camera.R.ravel().tolist(), "C": camera.C.tolist()})
    up, K, at = "[0, 0, 1]", json.dumps(camera.K.ravel().tolist()), json.dumps(pivot.tolist())
    call = {
        "orbit": f"orbit({pose}, {up}, {at}, 0.3, -0.2)",
        "look": f"lookAround({pose}, {up}, 0.3, -2.0)",
        "pan": f"pan({pose}, {K}, {at}, 12, -7)",
        "dolly": f"dolly({pose}, {at}, 1.3)",
        "move": f"move({pose}, {up}, 0.1, 0.2, 0.3)",
        "fit": f"fit({pose}, {K}, {json.dumps(list(camera.size))}, {json.dumps(bounds.tolist())})",
    }[kind]
    found = run(f"return {call};")
    tolerance = 2e-2 if kind == "fit" else 1e-12  # the server measures the middles of the outer pixels
    np.testing.assert_allclose(np.reshape(found["R"], (3, 3)), expected.R, atol=1e-12)
    np.testing.assert_allclose(found["C"], expected.C, rtol=tolerance, atol=tolerance)
