"""Lidars: settings, poses, descriptions and refused input."""

from __future__ import annotations

import json
import pickle
from typing import Any

import numpy as np
import pytest
import raycam


def refuse(code: str, *facts: str, call: Any) -> None:
    """Checks that a call raises a `LidarError` with this code, whose text contains the facts."""
    with pytest.raises(raycam.LidarError) as caught:
        call()
    assert caught.value.code == code
    for fact in facts:
        assert fact in str(caught.value)


def test_unknown_device_is_refused_with_the_nearest_name() -> None:
    refuse(
        "unknown_name", "vlp61", "did you mean 'vlp16'", "raycam lidars", call=lambda: raycam.Lidar("vlp61")
    )
    refuse("unknown_name", call=lambda: raycam.Lidar(3))  # type: ignore[arg-type]


def test_unsupported_rate_is_refused_with_the_supported_rates_and_can_be_forced() -> None:
    for name, rate, supported in (
        ("vlp16", 30, "5 to 20"),
        ("os1-64", 7, "10 and 20"),
        ("pandar64", 1, "10 to 20"),
    ):
        refuse(
            "unsupported_rate",
            str(rate),
            supported,
            "force_rate=True",
            call=lambda n=name, r=rate: raycam.Lidar(n, rate=r),
        )
        assert raycam.Lidar(name, rate=rate, force_rate=True).rate == rate


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"rate": "10"}, "wrong_type"),
        ({"rate": -1}, "out_of_range"),
        ({"rate": float("nan")}, "out_of_range"),
        ({"retruns": "dual"}, "unknown_name"),
        ({"returns": "both"}, "unknown_name"),
        ({"beam_samples": 5, "beam_divergence": 1e-3}, "unknown_name"),
        ({"beam_samples": 7}, "missing_value"),
        ({"beam_divergence": (1e-3, 1e-3, 1e-3)}, "wrong_shape"),
        ({"min_range": 5, "max_range": 4}, "conflicting_values"),
        ({"seed": 1.5}, "wrong_type"),
        ({"noise": 1}, "wrong_type"),
        ({"max_bounces": 17}, "out_of_range"),
        ({"visibility": 0}, "out_of_range"),
        ({"step": -0.1}, "out_of_range"),
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, Any], code: str) -> None:
    refuse(code, call=lambda: raycam.Lidar("vlp16", **settings))


@pytest.mark.parametrize(
    ("arguments", "code", "fact"),
    [
        ({"directions": [[1.0, 0]]}, "wrong_shape", "directions"),
        ({"directions": [[1.0, 0, 0], [np.nan, 0, 0]]}, "out_of_range", "directions[1]"),
        ({"directions": [[1.0, 0, 0], [0, 0, 0]]}, "out_of_range", "directions[1]"),
        ({"directions": [[1.0, 0, 0]] * 2, "times": [0.1, 0.05]}, "unordered_times", "times[1]"),
        ({"directions": [[1.0, 0, 0]] * 2, "times": [0.1]}, "wrong_shape", "times"),
        ({"directions": [[1.0, 0, 0]] * 2, "times": [0, np.inf]}, "out_of_range", "times[1]"),
        ({"directions": [[1.0, 0, 0]] * 2, "rings": [0.5, 1]}, "wrong_type", "rings"),
        ({"directions": [[1.0, 0, 0]] * 2, "origins": [[0, 0, 0]]}, "wrong_shape", "origins"),
    ],
)
def test_impossible_patterns_are_refused(arguments: dict[str, Any], code: str, fact: str) -> None:
    refuse(code, fact, call=lambda: raycam.Lidar.of(**arguments))


def test_replace_with_none_restores_the_value_of_the_device() -> None:
    lidar = raycam.Lidar("vlp16", max_range=20)
    assert lidar.max_range == 20
    assert lidar.replace(max_range=None).max_range == 100
    assert lidar.replace(rate=20).rate == 20
    assert lidar.rate == 10


def test_beam_given_at_half_maximum_is_converted_to_1_over_e2() -> None:
    """exp(-2 r² / w²) has the full width w sqrt(2 ln 2) at half maximum, and 2 w at 1/e²."""
    fwhm = np.radians(0.18)
    assert raycam.Lidar("os1-128").beam_divergence[0] == pytest.approx(fwhm * 2 / np.sqrt(2 * np.log(2)))


@pytest.mark.parametrize("up", ["z", "y"])
def test_placed_lidar_has_the_axes_of_a_camera_with_equal_angles(up: Any) -> None:
    lidar = raycam.Lidar("vlp16", up=up).placed([1, 2, 3], roll=10, pitch=20, yaw=30)
    camera = raycam.Camera.from_pose([1, 2, 3], 10, 20, 30, fov=60, size=(64, 48), up=up)
    # Camera axes are x right, y down, z forward; the lidar's x forward, y left, z up.
    expected = np.asarray(camera.R).T @ np.array([[0, -1, 0], [0, 0, -1], [1.0, 0, 0]])
    np.testing.assert_allclose(lidar.pose[:3, :3], expected, atol=1e-12)
    np.testing.assert_array_equal(lidar.pose[:3, 3], [1, 2, 3])


def test_at_pose_accepts_the_rotation_sensor_from_world() -> None:
    lidar = raycam.Lidar("vlp16").placed([0, 0, 2], yaw=90)
    same = raycam.Lidar("vlp16").at_pose(lidar.pose[:3, :3].T, lidar.pose[:3, 3])
    np.testing.assert_allclose(same.pose, lidar.pose, atol=1e-15)
    refuse("not_a_rotation", call=lambda: lidar.at_pose(2 * np.eye(3), [0, 0, 0]))
    refuse("out_of_range", call=lambda: lidar.placed([np.nan, 0, 0]))


def test_moving_interpolates_between_the_poses() -> None:
    lidar = raycam.Lidar("vlp16", rate=10)
    moving = lidar.moving(lidar.placed([2, 0, 0], yaw=60))
    turns, places = moving.track.at(np.array([0.0, 0.05, 0.1, 0.3]))
    np.testing.assert_allclose(places[:, 0], [0, 1, 2, 2], atol=1e-12)
    yaw = np.degrees(np.arctan2(turns[:, 1, 0], turns[:, 0, 0]))
    np.testing.assert_allclose(yaw, [0, 30, 60, 60], atol=1e-9)
    assert moving.is_moving
    refuse("unordered_times", call=lambda: lidar.moving([(0.1, lidar), (0.1, lidar)]))
    for unfit in ([], 5, [lidar], [(0.1,)], [(0.1, 2)]):
        refuse("wrong_type", call=lambda to=unfit: lidar.moving(to))


def test_description_restores_an_equal_lidar() -> None:
    lidar = raycam.Lidar("os1-128", returns="dual", beam_samples=7).placed([1, 2, 3], yaw=17)
    moving = lidar.moving(lidar.placed([2, 0, 0]))
    text = json.dumps(moving.to_dict())
    again = raycam.Lidar.from_dict(json.loads(text))
    assert again == moving == pickle.loads(pickle.dumps(moving))
    assert hash(again) == hash(moving)
    assert again != lidar
    np.testing.assert_array_equal(again.pattern().directions, lidar.pattern().directions)


def test_lidar_implements_the_sensor_protocol() -> None:
    lidar = raycam.Lidar("vlp16")
    assert isinstance(lidar, raycam.Sensor)
    assert len(lidar.times) == 28928
