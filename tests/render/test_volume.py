"""Scattering fog of the path tracer, compared with quadrature, Beer's law and furnaces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam

Floats = npt.NDArray[np.float64]


def view(size: tuple[int, int] = (8, 6), **keys: Any) -> raycam.Camera:
    return raycam.Camera.look_at([0, 0, 0], [0, 10, 0], size=size, fov=40, **keys)


def phase(cosine: Floats, g: float) -> Floats:
    """The phase function of Henyey and Greenstein (1941)."""
    return (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)


def path(world: raycam.World, camera: raycam.Camera, **keys: Any) -> Floats:
    return raycam.render(world, camera, integrator="path", **keys)["color"].astype(float)


def single_scattering(
    direction: Floats, lamp: Floats, sigma: Floats, albedo: Floats, g: float, length: float
) -> Floats:
    """In-scattered radiance of a point light of intensity 1, by quadrature along the ray.

    The ray starts at the origin.
    """
    # Samples are uniform in the angle seen from the lamp, which smooths the peak.
    foot = lamp @ direction
    height = np.linalg.norm(lamp - foot * direction)
    ends = np.arctan((np.array([0, length]) - foot) / height)
    nodes, weights = np.polynomial.legendre.leggauss(400)
    angles = ends.mean() + nodes * (ends[1] - ends[0]) / 2
    t = foot + height * np.tan(angles)
    dt = height / np.cos(angles) ** 2 * weights * (ends[1] - ends[0]) / 2
    towards = lamp - t[:, None] * direction
    distance = np.linalg.norm(towards, axis=1)
    cosine = towards @ direction / distance
    light = phase(cosine, g) / distance**2 * dt
    return (light[:, None] * albedo * sigma * np.exp(-sigma * (t + distance)[:, None])).sum(axis=0)


@pytest.mark.parametrize("g", [0.0, 0.8, -0.4])
def test_single_scattering_of_a_lamp_equals_its_integral(g: float) -> None:
    sigma, albedo, lamp = np.array([0.1, 0.3, 0.9]), np.array([1.0, 0.8, 0.5]), np.array([0.4, 5.0, 0.3])
    world = raycam.World()
    world.add_object(plane=400, location=[0, 12, 0], pitch=90, yaw=-90, color=0)
    world.add_light("point", position=lamp, intensity=1)
    world.set_fog(extinction=sigma, albedo=albedo, g=g)
    camera = view()
    image = path(world, camera, samples=4096, max_depth=2)
    for row, column in ((0, 0), (4, 2), (3, 7), (5, 1)):
        # The expected mean over the pixel, computed with a separate grid of rays.
        grid = (np.arange(8) + 0.5) / 8 - 0.5
        pixels = np.stack(np.meshgrid(column + grid, row + grid), -1).reshape(-1, 2)
        rays = np.asarray(camera.rays(pixels)[1])
        exact = np.mean([single_scattering(d, lamp, sigma, albedo, g, 12 / d[1]) for d in rays], axis=0)
        np.testing.assert_allclose(image[row, column], exact, rtol=0.02)


def test_fog_that_only_absorbs_equals_beers_law() -> None:
    sigma = np.array([0.05, 0.1, 0.4])
    world = raycam.World()
    world.add_object(plane=400, location=[0, 6, 0], pitch=90, yaw=-90, emission=[1, 2, 3], color=0)
    world.set_fog(extinction=sigma, albedo=0)
    camera = view()
    frame = raycam.render(
        world, camera, integrator="path", samples=1, max_depth=4, channels=["color", "transmittance"]
    )
    np.testing.assert_allclose(frame["color"], np.array([1, 2, 3]) * frame["transmittance"], rtol=1e-5)


def test_lamps_through_absorbing_fog_equal_beers_law() -> None:
    sigma = 0.3
    world = raycam.World()
    world.add_object(plane=400, location=[0, 6, 0], pitch=90, yaw=-90, color=1)
    world.add_light("point", position=[0, 4, 0], intensity=1)
    camera = view((3, 3))
    clear = path(world, camera, samples=1, max_depth=2)[1, 1]
    world.set_fog(extinction=sigma, albedo=0)
    foggy = path(world, camera, samples=1, max_depth=2)[1, 1]
    np.testing.assert_allclose(foggy, clear * math.exp(-sigma * (6 + 2)), rtol=1e-4)


@pytest.mark.parametrize(
    "fog",
    [
        {"extinction": 0.3, "height": 1.0},
        {"extinction": [0.1, 0.4, 1.2], "height": 1.0, "g": 0.7},
        {"extinction": 0.5, "g": -0.5},
    ],
)
def test_white_furnace_with_fog_returns_the_sky(fog: dict[str, Any]) -> None:
    """Fog below a height has a white ground, because paths would seldom return without it."""
    world = raycam.World()
    world.add_object(sphere={"radius": 1, "level": 4}, location=[0, 5, 0], color=1, type="matte")
    world.add_object(plane=40000, location=[0, 5, -1], color=1, type="matte")
    world.add_light("sky", radiance=1)
    world.set_fog(albedo=1, **fog)
    camera = raycam.Camera.look_at([0, 0, 0.5], [0, 5, 0], size=(16, 12), fov=50)
    image = path(world, camera, samples=1024)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), 1.0, atol=1e-3)


def test_sky_and_sun_of_a_horizontal_layer_equal_the_transport_equation() -> None:
    """A layer over black ground, viewed from above.

    Single scattering has a closed form.
    """
    depth, albedo, g = 0.8, 0.6, 0.5
    world = raycam.World()
    world.add_object(plane=4000, color=0)
    sun = np.array([0.6, 0.0, -0.8])
    world.add_light("sun", direction=sun, irradiance=2)
    world.set_fog(extinction=0.4, albedo=albedo, g=g, height=depth / 0.4)
    camera = raycam.Camera.look_at([0, 0, 8], [0, 0, 0], [0, 1, 0], size=(3, 3), fov=1)
    image = path(world, camera, samples=4096, max_depth=2)[1, 1]
    # Seen from above, the radiance is the integral of exp(-tau) exp(-tau / mu0) over the optical depth.
    mu0 = 0.8
    cosine = float(np.array([0, 0, -1.0]) @ -sun)
    exact = 2 * albedo * phase(np.array(cosine), g) * (1 - math.exp(-depth * (1 + 1 / mu0))) / (1 + 1 / mu0)
    np.testing.assert_allclose(image, exact, rtol=0.01)


def test_fog_attenuates_a_visible_area_light_by_its_distance() -> None:
    world = raycam.World()
    world.add_light(
        "area", position=[0, 5, 0], u=[0.5, 0, 0], v=[0, 0, 0.5], radiance=[2, 2, 2], two_sided=True
    )
    world.add_object(plane=400, location=[0, 9, 0], pitch=90, yaw=-90, color=0)
    world.set_fog(extinction=0.2, albedo=0)
    image = path(world, view((3, 3)), samples=1)
    np.testing.assert_allclose(image[1, 1], 2 * math.exp(-0.2 * 5), rtol=1e-4)


def test_images_with_fog_are_the_same_on_any_number_of_threads() -> None:
    world = raycam.World()
    world.add_object(sphere=1, location=[0, 5, 0])
    world.add_light("point", position=[2, 3, 2], intensity=9)
    world.add_light("sky", radiance=0.3)
    world.set_fog(visibility=8, albedo=0.9, g=0.6)
    images = [path(world, view((40, 30)), samples=8, threads=threads) for threads in (1, 2, 3)]
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])
    part = raycam.render(world, view((40, 30)), integrator="path", samples=8, region=(7, 5, 20, 11))["color"]
    np.testing.assert_array_equal(images[0][5:16, 7:27], part)


def test_fog_does_not_change_the_ground_truth_of_surfaces() -> None:
    world = raycam.World()
    world.add_object(sphere=1, location=[0, 5, 0])
    channels = ["depth", "distance", "position", "normal", "instance", "coverage", "alpha"]
    before = raycam.render(world, view(), integrator="path", samples=4, channels=channels)
    world.set_fog(visibility=2)
    after = raycam.render(world, view(), integrator="path", samples=4, channels=channels)
    for name in channels:
        np.testing.assert_array_equal(before[name], after[name])
