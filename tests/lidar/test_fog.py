"""The echo of fog, compared with numerical integration by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.lidar.fog import attenuation, soft_echo
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

LENGTH = 4e-9 * 299792458 / 2


def expected_echo(visibility: float, length: float) -> tuple[float, float]:
    alpha, beta = np.log(20) / visibility, 0.046 / visibility
    sigma = length / 2.3548200450309493

    def height(r: float) -> float:
        def density(s: float) -> float:
            overlap = min(1.0, max(0.0, (s - 0.9) / 0.1))
            pulse = np.exp(-0.5 * ((r - s) / sigma) ** 2)
            return float(np.pi * beta * overlap * np.exp(-2 * alpha * s) / s**2 * pulse)

        return float(quad(density, 0.9, 1.0)[0] + quad(density, 1.0, 12.0, limit=200)[0])

    best = minimize_scalar(lambda r: -height(r), bounds=(0.9, 3.0), method="bounded")
    return float(best.x), float(-best.fun)


@pytest.mark.parametrize("visibility", [20.0, 80.0, 500.0])
@pytest.mark.parametrize("length", [LENGTH, 0.2])
def test_soft_echo_is_the_maximum_of_the_integral(visibility: float, length: float) -> None:
    distance, energy = soft_echo(visibility, length)
    place, height = expected_echo(visibility, length)
    assert distance == pytest.approx(place, abs=0.01)
    assert energy == pytest.approx(height, rel=1e-3)


def hall() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [40, 40, 40]}, name="hall", color=[0.5, 0.5, 0.5])
    return world


def test_fog_attenuates_surfaces_and_its_echo_belongs_to_no_object() -> None:
    lidar = raycam.Lidar("vlp16", noise=False, returns="all", min_range=0, range_10=200, visibility=50)
    clear = raycam.scan(hall(), lidar.replace(visibility=None))
    foggy = raycam.scan(hall(), lidar)
    fog = foggy["instance"] == -1
    assert fog.sum() == len(foggy.pattern)
    np.testing.assert_allclose(foggy["distance"][fog], soft_echo(50.0, LENGTH)[0], atol=1e-6)
    assert set(foggy["material"][fog].tolist()) == {-1}
    assert np.isnan(foggy["normal"][fog]).all()
    ratio = foggy["reflectivity"][~fog] / clear["reflectivity"]
    np.testing.assert_allclose(ratio, np.exp(-2 * attenuation(50.0) * clear["distance"]), rtol=1e-5)
    np.testing.assert_allclose(foggy["distance"][~fog], clear["distance"], atol=1e-6)


def test_strongest_echo_is_the_stronger_of_fog_and_surface() -> None:
    lidar = raycam.Lidar("vlp16", noise=False, returns="strongest", min_range=0, range_10=1000)
    for visibility in (30.0, 3000.0):
        scan = raycam.scan(hall(), lidar.replace(visibility=visibility))
        surface = 0.5 / 20**2 * np.exp(-2 * attenuation(visibility) * 20)
        is_fog = scan["instance"][np.argmin(scan["true_distance"])] == -1
        assert is_fog == (soft_echo(visibility, LENGTH)[1] > surface)
    assert not is_fog


def test_echo_of_fog_below_the_threshold_adds_nothing() -> None:
    lidar = raycam.Lidar("vlp16", noise=False, returns="all", range_10=2, min_range=0)
    world = raycam.World()
    everything = raycam.scan(world, lidar.replace(visibility=2000), keep_lost=True)
    assert set(everything["lost"].tolist()) == {1}


def test_fog_of_the_world_attenuates_like_the_visibility_setting() -> None:
    lidar = raycam.Lidar("vlp16", noise=False, returns="last", range_10=200)
    world = hall()
    expected = raycam.scan(world, lidar.replace(visibility=60))
    world.set_fog(visibility=60)
    found = raycam.scan(world, lidar)
    np.testing.assert_allclose(found["reflectivity"], expected["reflectivity"], rtol=1e-5)
    clear = raycam.scan(world, lidar.replace(visibility=np.inf))
    assert (clear["reflectivity"] > found["reflectivity"]).all()


def test_fog_below_a_height_attenuates_only_the_part_of_the_beam_inside_it() -> None:
    """The lidar is 3 m above the fog, and the floor is 20 m below the lidar.

    No echo comes from the air above the fog.
    """
    world = hall()
    world.set_fog(visibility=60, height=-3)
    ways = np.array([[0, 0, -1.0], [1, 0, -1.2], [1, 0, 0.1]])
    lidar = raycam.Lidar.of(ways, noise=False, returns="all")
    found, clear = raycam.scan(world, lidar), raycam.scan(hall(), lidar)
    np.testing.assert_array_equal(found["pulse"], clear["pulse"])
    share = np.array([17 / 20, 1 - 3 / (20 / 1.2 * 1.2), 0.0])
    depth = attenuation(60.0) * clear["distance"] * share
    np.testing.assert_allclose(found["reflectivity"] / clear["reflectivity"], np.exp(-2 * depth), rtol=1e-5)
    inside = raycam.scan(world, lidar.placed([0, 0, -5]))
    assert (inside["instance"] == -1).sum() == 3
