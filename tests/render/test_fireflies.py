"""Fireflies: their pixels, and the lights and objects that cause them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.notices import collected
from raycam.render.fireflies import bright_pixels
from raycam.render.request import image_request
from scipy import ndimage

SIDE = 0.004


def quad(center: list[float], u: list[float], v: list[float]) -> tuple[Any, Any]:
    c, u_, v_ = (np.array(each, dtype=float) for each in (center, u, v))
    return np.array([c - u_ - v_, c + u_ - v_, c + u_ + v_, c - u_ + v_]), [[0, 1, 2], [0, 2, 3]]


def room(lamp: str, material: dict[str, Any]) -> raycam.World:
    """A lit floor in front of a wall that reflects a tiny bright lamp."""
    world = raycam.World()
    grey = {"color": [0.7] * 3}
    world.add_mesh(*quad([0, 0, 0], [3, 0, 0], [0, 3, 0]), material=grey, name="floor")
    world.add_mesh(*quad([0, 3, 1.5], [3, 0, 0], [0, 0, 1.5]), material=material, name="wall")
    world.add_mesh(*quad([0, 0, 3], [-3, 0, 0], [0, 3, 0]), material=grey, name="ceiling")
    world.add_light(
        {"type": "area", "position": [0, 0, 2.9], "u": [4, 0, 0], "v": [0, -4, 0], "radiance": [0.05] * 3}
    )
    glare = [3e5] * 3
    if lamp == "area 1":
        world.add_light(
            {
                "type": "area",
                "position": [0.5, 1.5, 1],
                "u": [SIDE, 0, 0],
                "v": [0, 0, -SIDE],
                "radiance": glare,
            }
        )
    elif lamp == "point 1":
        intensity = [3e5 * SIDE**2] * 3
        world.add_light(
            {"type": "point", "position": [0.5, 1.5, 1], "radius": SIDE / 2, "intensity": intensity}
        )
        world.add_mesh(
            *quad([0.5, 1.4, 1], [0.5, 0, 0], [0, 0, 0.5]), material={"color": [0, 0, 0]}, name="shield"
        )
    else:
        spark = {"color": [0, 0, 0], "emission": glare}
        world.add_mesh(*quad([0.5, 1.5, 1], [SIDE, 0, 0], [0, 0, -SIDE]), material=spark, name="spark")
    return world


CAMERA = raycam.Camera.look_at([0, -2.5, 2.5], [0, 1, 0], [0, 0, 1], size=(64, 48), fov=60)
MIRROR = {"type": "metal", "metal": "silver", "roughness": 0.0}


def fireflies(world: raycam.World, **options: Any) -> list[str]:
    chosen: dict[str, Any] = {"integrator": "path", "samples": 256, "max_depth": 6} | options
    with collected():
        frame = raycam.render(world, CAMERA, **chosen)
    return [notice for notice in frame.notices if notice.code == "fireflies"]


@pytest.mark.parametrize("lamp", ["area 1", "point 1", "the object 'spark'"])
def test_firefly_notice_names_the_light_and_the_object(lamp: str) -> None:
    world = room(lamp, MIRROR)
    notice = next(notice for seed in range(8) for notice in fireflies(world, seed=seed))
    ways = str(notice).split(": ", 2)[2].split(". ")[0].split("; ")
    # The last entry may be "other paths (N)", which contains no names.
    named = [way for way in ways if not way.startswith("other paths")]
    assert named
    for way in named:
        assert f"light of {lamp} " in way
        assert "'wall'" in way


def test_matte_wall_has_no_fireflies() -> None:
    assert not fireflies(room("area 1", {"color": [0.7] * 3}))


@pytest.mark.parametrize("options", [{"samples": 64}, {"clamp": 1.0}, {"integrator": "direct"}])
def test_no_firefly_notice_with_few_samples_or_clamping(options: dict[str, Any]) -> None:
    assert not fireflies(room("area 1", MIRROR), **options)


def test_firefly_search_does_not_change_the_image() -> None:
    world = room("area 1", MIRROR)
    with collected():
        whole = raycam.render(world, CAMERA, integrator="path", samples=256, max_depth=6)
        part = raycam.render(
            world, CAMERA, integrator="path", samples=256, max_depth=6, region=(0, 0, 64, 24)
        )
    np.testing.assert_array_equal(whole["color"][:24], part["color"])


def test_share_of_the_brightest_sample_is_at_least_one_divided_by_the_samples() -> None:
    """The share is 1 for one sample, and 1 / samples if all samples are equal."""
    world = room("area 1", MIRROR)
    even = raycam.World()
    even.add_light({"type": "sky", "radiance": 1.0})
    even.add_mesh(*quad([0, 0, 0], [3, 0, 0], [0, 3, 0]), material={"color": [0.5] * 3})
    pixels = [(x, 40) for x in range(0, 64, 8)]
    for samples in (1, 16):
        for seen in (world, even):
            request, _, _ = image_request(
                seen,
                {"integrator": "path", "samples": samples, "max_depth": 6},
                names=["color"],
                surface="first",
                frame=0,
                transparent_background=False,
                region=None,
            )
            found = seen._core.brightest_samples(CAMERA._core, request, pixels)
            shares = np.array([each[0] for each in found if each is not None])
            assert len(shares) == len(pixels)
            assert (shares >= (1 - 1e-6) / samples).all()
            if seen is even or samples == 1:
                np.testing.assert_allclose(shares, 1 / samples, rtol=1e-5)
            else:
                assert (shares > 1.01 / samples).any()


def test_bright_pixels_equal_those_of_a_median_filter() -> None:
    """Compared with SciPy's median of the eight neighbours."""
    light = np.random.default_rng(4).lognormal(0, 1.6, (40, 50)).astype(np.float32)
    around = np.ones((3, 3), dtype=bool)
    around[1, 1] = False
    median = ndimage.generic_filter(light, np.median, footprint=around, mode="nearest")
    expected = {(x, y) for y, x in np.argwhere(light > 20 * median)}
    found = bright_pixels(np.repeat(light[..., None], 3, axis=2))
    assert len(expected) > 5
    assert {(x, y) for x, y in found.tolist()} == expected
    values = light[found[:, 1], found[:, 0]]
    assert (np.diff(values) <= 0).all()


def test_bright_pixels_of_a_dark_image_are_empty() -> None:
    color = np.zeros((9, 9, 3), dtype=np.float32)
    color[4, 4] = 5
    assert not len(bright_pixels(color))
    assert not len(bright_pixels(color[:2]))
