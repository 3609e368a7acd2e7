"""Patterns of moving mirrors, against the angles that the law of reflection gives."""

from __future__ import annotations

import numpy as np
import pytest
import raycam


def azimuths(lidar: raycam.Lidar, frame: int = 0) -> np.ndarray:
    ways = lidar.pattern(frame).directions
    return np.degrees(np.arctan2(ways[:, 1], ways[:, 0]))


def test_polygon_scans_lines_of_constant_angular_speed_in_one_direction() -> None:
    """Per line, a mirror of 4 facets turns by 90 degrees, and the beam by 180 degrees.

    The field of view of 60 degrees takes a third of this time.
    """
    lidar = raycam.Lidar.with_mirror(
        "polygon", pulse_rate=300_000, facets=4, line_rate=100, field_of_view=60, rate=10
    )
    pattern, angles = lidar.pattern(), azimuths(lidar)
    assert len(pattern) == pytest.approx(30_000 / 3, abs=10)
    assert np.unique(pattern.rings).tolist() == list(range(10))
    np.testing.assert_allclose(pattern.directions[:, 2], 0, atol=1e-12)
    line = pattern.rings == 4
    expected = (np.fmod(pattern.times[line] * 100, 1.0) - 0.5) * 180
    np.testing.assert_allclose(angles[line], expected, atol=1e-9)
    assert abs(angles).max() == pytest.approx(30, abs=0.1)


def test_oscillating_mirror_moves_as_a_sine_and_continues_in_the_next_frame() -> None:
    lidar = raycam.Lidar.with_mirror(
        "oscillating", pulse_rate=50_000, frequency=35, field_of_view=40, rate=10
    )
    for frame in (0, 3):
        times = lidar.pattern(frame).times + frame / 10
        np.testing.assert_allclose(azimuths(lidar, frame), 20 * np.sin(2 * np.pi * 35 * times), atol=1e-7)


def test_conical_mirror_draws_ovals_that_follow_the_law_of_reflection() -> None:
    """Each direction is the laser's direction reflected by a tilted mirror.

    The mirror's normal is 7 degrees from the axis.
    """
    lidar = raycam.Lidar.with_mirror("conical", pulse_rate=20_000, frequency=20, tilt=7, rate=20)
    ways = lidar.pattern().directions
    laser, axis = np.array([0, 0, -1.0]), np.array([1, 0, 1.0]) / np.sqrt(2)
    normals = ways - laser
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(np.degrees(np.arccos(normals @ axis)), 7, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 1, atol=1e-12)
    # The beam is deflected by 14 degrees in the plane of the laser and the axis, and by less across it.
    up = np.degrees(np.arcsin(ways[:, 2]))
    assert (up.min(), up.max()) == pytest.approx((-14, 14), abs=1e-2)
    assert np.degrees(np.arctan2(ways[:, 1], ways[:, 0])).max() == pytest.approx(9.96, abs=0.1)


def test_survey_scan_returns_an_image_with_one_pixel_per_direction() -> None:
    lidar = raycam.Lidar.with_mirror(
        "survey", pulse_rate=100_000, elevations=(-40, 60, 0.5), azimuths=(0, 359.5, 0.5), noise=False
    )
    pattern = lidar.pattern()
    assert pattern.shape == (201, 720)
    assert lidar.rate == pytest.approx(100_000 / (201 * 720))
    np.testing.assert_allclose(np.diff(pattern.times), 1e-5, atol=1e-9)
    world = raycam.World()
    world.add_object(box={"size": [30, 30, 30]}, name="hall", color=[0.5] * 3)
    distances = raycam.scan(world, lidar).image("distance")
    assert distances.shape == (201, 720)
    assert np.isfinite(distances).all()
    assert distances[120, 0] == pytest.approx(15, abs=1e-3)  # row 120 from the top is at 0 degrees
    ways = pattern.directions.reshape(720, 201, 3)
    np.testing.assert_allclose(np.degrees(np.arcsin(ways[5, :, 2])), -40 + 0.5 * np.arange(201), atol=1e-9)


def test_scanner_that_looks_down_measures_the_height() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [500, 500]}, name="ground", color=[0.5] * 3)
    lidar = raycam.Lidar.with_mirror(
        "oscillating", pulse_rate=1000, frequency=50, field_of_view=40, rate=10, noise=False
    )
    scan = raycam.scan(world, lidar.placed([0, 0, 100], pitch=90))
    np.testing.assert_allclose(scan.in_world()[:, 2], 0, atol=1e-9)
    assert np.ptp(scan.in_world()[:, 1]) == pytest.approx(200 * np.tan(np.radians(20)), rel=0.01)
    np.testing.assert_allclose(scan.in_world()[:, 0], 0, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "numbers", "code"),
    [
        ("prism", {}, None),
        ("polygon", {"pulse_rate": 1e5, "facets": 4, "line_rate": 10}, "missing_value"),
        ("polygon", {"pulse_rate": 1e5, "facets": 8, "line_rate": 10, "field_of_view": 91}, "out_of_range"),
        ("conical", {"pulse_rate": 1e5, "frequency": 1, "tilt": 3, "facets": 3}, "unknown_name"),
        ("oscillating", {"pulse_rate": 1e5, "frequency": -1, "field_of_view": 3}, None),
        ("survey", {"pulse_rate": 1e5, "elevations": (0, -1, 1), "azimuths": (0, 1, 1)}, "out_of_range"),
        ("survey", {"pulse_rate": 1e5, "elevations": (0, 1, 0), "azimuths": (0, 1, 1)}, "out_of_range"),
    ],
)
def test_impossible_mirrors_are_refused(kind: str, numbers: dict[str, object], code: str | None) -> None:
    with pytest.raises(raycam.LidarError) as caught:
        raycam.Lidar.with_mirror(kind, **numbers)
    assert code in (None, caught.value.code)


def test_survey_with_too_many_pulses_raises_a_memory_error() -> None:
    with pytest.raises(MemoryError):
        raycam.Lidar.with_mirror(
            "survey", pulse_rate=1e6, elevations=(-40, 60, 0.001), azimuths=(0, 360, 0.001)
        ).pattern()


def test_description_restores_the_scanner() -> None:
    lidar = raycam.Lidar.with_mirror("conical", pulse_rate=2000, frequency=20, tilt=7, seed=3)
    assert raycam.Lidar.from_dict(lidar.to_dict()) == lidar
    assert lidar.settings["seed"] == 3
