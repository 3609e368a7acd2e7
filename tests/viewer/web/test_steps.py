"""The steps of the lecture in the page, compared with `raycam.explain`."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import raycam
from raycam import _core
from raycam.explanation import lens
from raycam.viewer import probe
from support.node_core import needs_core, needs_node, run, run_core
from support.raises import raises

pytestmark = needs_node
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


def asked(world: raycam.World, camera: raycam.Camera, pixel: tuple[int, int]) -> str:
    offset = 0 if camera.pixel_center == "integer" else 0.5
    center = np.add(pixel, offset)
    origin, direction = camera.rays(center)
    ray = {
        "model": "parallel" if camera.is_parallel else camera.model,
        "coefficients": [] if camera.distortion is None else camera.distortion.tolist(),
        "origin": origin.tolist(),
        "direction": [value if np.isfinite(value) else None for value in direction.tolist()],
        "R": lens.at_line(camera, *pixel).R.ravel().tolist(),
        "back": camera.project(origin + direction)[0].tolist()
        if np.isfinite(direction).all()
        else [None] * 2,
    }
    return json.dumps(
        {
            "K": camera.K.ravel().tolist(),
            "lensRay": ray,
            "size": list(camera.size),
            "offset": offset,
            "column": pixel[0],
            "row": pixel[1],
            "names": [each.name for each in world.objects],
            "corners": np.asarray(world.triangles()).ravel().tolist(),
            "ids": np.asarray(world.triangle_ids()).ravel().tolist(),
            "colors": np.asarray(world.triangle_colors(), float).ravel().tolist(),
        }
    )


FRONT = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=40)
LENSES = {
    "pinhole": FRONT,
    "side": raycam.Camera.look_at([-4, -3, 2], [0, 0, 0], size=(48, 32), fov=40, pixel_center="half"),
    "opencv": FRONT.replace(distortion=[-0.2, 0.05, 0.01, -0.02], model="opencv"),
    "fisheye": FRONT.replace(distortion=[0.1, 0, 0, 0], model="fisheye").with_aperture(0.05, focus=4.0),
    "panorama": FRONT.replace(distortion=[], model="equirectangular"),
    "parallel": raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], height=3, size=(48, 32)),
    "rolling": FRONT.moving(FRONT.at_pose(FRONT.R, [3.5, -3.2, 2.2]), exposure=0.01, readout=0.05),
    "rolling fisheye": FRONT.replace(distortion=[0.1, 0, 0, 0], model="fisheye").moving(
        FRONT.at_pose(FRONT.R, [3.5, -3.2, 2.2]), exposure=0.01, readout=0.05
    ),
}


@pytest.mark.parametrize("pixel", [(24, 16), (20, 20), (5, 28), (40, 1), (47, 31)])
@pytest.mark.parametrize("name", LENSES)
def test_explanation_text_equals_raycam(small_world: raycam.World, name: str, pixel: tuple[int, int]) -> None:
    camera = LENSES[name]
    found = run(f"return explanationOf({asked(small_world, camera, pixel)}).text;").splitlines()
    expected = str(raycam.explain(small_world, camera, pixel)).splitlines()
    assert [NUMBER.sub("#", line).split() for line in found] == [
        NUMBER.sub("#", line).split() for line in expected
    ]
    for mine, theirs in zip(found, expected, strict=True):
        values = [[float(number) for number in NUMBER.findall(line)] for line in (mine, theirs)]
        np.testing.assert_allclose(values[0], values[1], rtol=2e-5, atol=1e-9, err_msg=mine)


@needs_core
def test_core_returns_the_ray_of_every_lens(small_world: raycam.World) -> None:
    world = raycam.World()
    for name, camera in LENSES.items():
        world.add_camera(camera, name)
    pixels = [(24, 16), (5, 28), (40, 1)]
    asks = [
        (name, json.loads(asked(small_world, LENSES[name], pixel))) for name in LENSES for pixel in pixels
    ]
    centers = [[ask["column"] + ask["offset"], ask["row"] + ask["offset"]] for _, ask in asks]
    found = run_core(
        "const world = core.World.unpack(worlds.cameras);"
        f"return {json.dumps([[name, *at] for (name, _), at in zip(asks, centers, strict=True)])}"
        ".map(([name, u, v]) => JSON.parse(world.camera(name, 48, 32).lensRay(u, v)));",
        {"cameras": bytes(_core.world_to_bytes(world._core))},
    )
    for ray, (name, ask) in zip(found, asks, strict=True):
        further = ray.pop("further")
        assert further == {"fisheye": ["aperture"]}.get(name, ["shutter"] if "rolling" in name else [])
        expected = ask["lensRay"]
        assert ray.pop("model") == expected.pop("model")
        for key, values in expected.items():
            np.testing.assert_allclose(ray[key], values, rtol=1e-12, atol=1e-12, err_msg=f"{name} {key}")


def test_pixel_without_a_ray_is_refused(small_world: raycam.World) -> None:
    camera = FRONT.replace(distortion=[-0.8, 0, 0, 0], model="opencv")
    with raises(raycam.CameraError, code="out_of_range"):
        raycam.explain(small_world, camera, (0, 0))
    text = asked(small_world, camera, (0, 0))
    said = run(f"try {{ explanationOf({text}); }} catch (error) {{ return error.message; }}")
    assert "outside of the image of the lens (opencv)" in said


def test_numbers_are_formatted_as_in_c() -> None:
    random = np.random.default_rng(2)
    values = [0.0, 1.0, -2.5, 1e-5, 123456.0, 1234567.0, 999999.5, 0.1, 1 / 3, 1e300, -1e-300]
    # Values halfway between two decimal numbers.
    values += [1.015625, -1.015625, 1.046875, 12345.25, 123456.5, 123457.5, 5e-324]
    values += (random.standard_normal(500) * 10.0 ** random.integers(-12, 12, 500)).tolist()
    found = run(f"return {json.dumps(values)}.map(general);")
    assert found == [f"{value + 0.0:.6g}" for value in values]


@pytest.mark.parametrize("up", ["z", "y"])
def test_ground_height_equals_that_of_the_server(up: str) -> None:
    random = np.random.default_rng(7)
    world = raycam.World(up=up)
    world.add_object(vertices=random.uniform(-2, 2, (60, 3)), triangles=random.integers(0, 60, (80, 3)))
    camera = raycam.Camera.look_at([3, 4, 5], [0, 0, 0], up, size=(8, 8), fov=50)
    places = random.uniform(-2, 2, (60, 3))
    asked = json.dumps({"corners": world.triangles().ravel().tolist(), "places": places.tolist()})
    axis = [0, 0, 1] if up == "z" else [0, 1, 0]
    found = run(
        f"const {{ corners, places }} = {asked};"
        f"return places.map((place) => groundBelow(corners, {axis}, place, 0.2));"
    )
    expected = [probe.ground_below(world, camera, place, 0.2) for place in places]
    assert 10 < sum(each is None for each in expected) < 50
    assert found == [None if each is None else pytest.approx(each, abs=1e-5) for each in expected]
