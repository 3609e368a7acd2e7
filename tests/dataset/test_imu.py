"""The motion of a body, compared with SciPy and closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from dataset.test_mcap_lidars import car, decoded
from dataset.test_semantickitti import street
from raycam.dataset import write
from raycam.dataset.imu import GRAVITY, BodyMotion, specific_force
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from support.raises import raises

RADIUS, SPIN = 10.0, 0.5


def quaternions(yaws: np.ndarray) -> np.ndarray:
    found: np.ndarray = Rotation.from_rotvec(np.column_stack([0 * yaws, 0 * yaws, yaws])).as_quat()
    return found


def circle(times: np.ndarray, sign: np.ndarray | float = 1.0) -> BodyMotion:
    """A body that drives forward on a circle, counterclockwise.

    `sign` multiplies the quaternions, which does not change the rotations.
    """
    angle = SPIN * times
    places = RADIUS * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return BodyMotion.of(times, quaternions(angle + np.pi / 2) * np.reshape(sign, (-1, 1)), places)


def test_positions_and_accelerations_equal_scipys_spline() -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.1, 0.3, 12))
    places = random.normal(size=(12, 3))
    motion = BodyMotion.of(times, quaternions(np.zeros(12)), places)
    spline = CubicSpline(times, places, bc_type="not-a-knot")
    moments = np.linspace(times[0], times[-1], 77)
    _, found, accelerations, spins = motion.at(moments)
    np.testing.assert_allclose(found, spline(moments), atol=1e-10)
    np.testing.assert_allclose(accelerations, spline(moments, 2), atol=1e-8)
    np.testing.assert_allclose(spins, 0, atol=1e-12)


def test_motion_on_a_circle_gives_spin_and_centripetal_acceleration() -> None:
    times = np.linspace(0, 4, 81)
    motion = circle(times, np.where(np.arange(81) % 3, 1.0, -1.0))
    turns, _, accelerations, spins = motion.at(np.linspace(0, 4, 200))
    np.testing.assert_allclose(spins, np.tile([0, 0, SPIN], (200, 1)), atol=1e-5)
    # Forward is along the circle, left is towards the circle's centre, and gravity acts like an upward acceleration.
    force = specific_force(turns, accelerations, "z")
    np.testing.assert_allclose(force, np.tile([0, RADIUS * SPIN**2, GRAVITY], (200, 1)), atol=2e-3)
    y_up = specific_force(np.tile([0, 0, 0, 1.0], (2, 1)), np.zeros((2, 3)), "y")
    np.testing.assert_allclose(y_up, [[0, GRAVITY, 0]] * 2)


def test_rotation_about_a_tilted_axis_has_its_angular_velocity_in_body_axes() -> None:
    axis = np.array([0.36, 0.48, 0.8])
    times = np.linspace(0, 2, 81)
    start = Rotation.from_euler("xyz", [0.3, -0.5, 1.1])
    turns = (Rotation.from_rotvec(1.5 * times[:, None] * axis) * start).as_quat()
    _, _, _, spins = BodyMotion.of(times, turns, np.zeros((81, 3))).at(np.linspace(0, 2, 50))
    np.testing.assert_allclose(spins, np.tile(start.inv().apply(1.5 * axis), (50, 1)), atol=1e-4)


def test_too_few_or_unordered_poses_are_refused() -> None:
    for times in ([0.0, 1, 2], [0.0, 1, 1, 2]):
        with raises(raycam.SettingsError, code="missing_value", mentions=["imu", "4"]):
            circle(np.array(times))


def test_bag_contains_the_imu_of_the_body(tmp_path: Path) -> None:
    rig = car("vlp16")
    rig = raycam.Rig({"camera": rig.mounts["camera"]})
    angles = SPIN * 0.1 * np.arange(6)
    rigs = [
        rig.placed([RADIUS * np.cos(a), RADIUS * np.sin(a), 0], yaw=float(np.degrees(a)) + 90) for a in angles
    ]
    times = [0.1 * i for i in range(6)]
    write(street(), tmp_path, "mcap", cameras=rigs, times=times, samples=1, imu=100)
    messages = decoded(tmp_path / "raycam.mcap")["/imu"]
    assert len(messages) == 51
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages]
    assert stamps == [10**9 + 10**7 * i for i in range(51)]
    for message in messages:
        assert message.header.frame_id == "base_link"
        spin, force = message.angular_velocity, message.linear_acceleration
        np.testing.assert_allclose([spin.x, spin.y, spin.z], [0, 0, SPIN], atol=1e-3)
        np.testing.assert_allclose([force.x, force.y, force.z], [0, RADIUS * SPIN**2, GRAVITY], atol=2e-2)
    q = messages[20].orientation
    yaw = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_euler("zyx")[0]
    assert yaw == pytest.approx(SPIN * 0.2 + np.pi / 2, abs=1e-6)


@pytest.mark.parametrize(("imu", "code"), [(-1, "out_of_range"), ("x", "wrong_type"), (100, "missing_value")])
def test_invalid_rates_are_refused(imu: object, code: str, tmp_path: Path) -> None:
    camera = raycam.Camera.look_at([0, 0, 2], [10, 0, 0], fov=40, size=(8, 6))
    with raises(raycam.SettingsError, code=code, mentions=["imu"]):
        write(street(), tmp_path, "mcap", cameras=[camera], samples=1, imu=imu)
