"""Joint values of robots from the pixels of known points."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import raises, warns

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><visual><geometry><box size="0.1 0.1 0.8"/></geometry></visual></link>
  <link name="lower"><visual><origin xyz="0 0 0.2" rpy="0.1 0 0"/>
    <geometry><box size="0.1 0.2 0.6"/></geometry></visual></link>
  <link name="hand"><visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual></link>
  <link name="finger"><visual><geometry><box size="0.05 0.05 0.2"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/>
    <axis xyz="0 1 0.2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.5"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.6"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="grip" type="revolute"><parent link="hand"/><child link="finger"/><origin xyz="0.1 0 0.1"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
    <mimic joint="elbow" multiplier="0.5"/></joint>
</robot>"""
TRUE = {"shoulder": 0.3, "elbow": -0.4, "slide": 0.1}
K = [[400, 0, 320], [0, 410, 240], [0, 0, 1]]


@pytest.fixture
def world(tmp_path: Path) -> raycam.World:
    (tmp_path / "arm.urdf").write_text(ARM, encoding="utf-8")
    world = raycam.World()
    world.add_robot(tmp_path / "arm.urdf", location=[0.2, 0.1, 0], yaw=20)
    world.add_object(box=[3, 3, 0.1], location=[0, 0, -0.05], name="floor")
    return world


def cameras() -> list[raycam.Camera]:
    """A camera with distortion, and a pinhole camera."""
    aim = raycam.Camera.look_at([3, -2, 1.5], [0.2, 0.1, 1], size=(640, 480), fov=50)
    return [
        raycam.Camera(K, aim.R, aim.C, (640, 480), distortion=[-0.2, 0.05, 0.001, 0.002]),
        raycam.Camera.look_at([-1, -4, 2], [0, 0, 1], size=(640, 480), fov=50),
    ]


def corners(world: raycam.World) -> tuple[np.ndarray, list[int]]:
    """Six points on every object of the arm in mesh coordinates, and their objects."""
    one = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1], [-1, -1, 1], [-1, -1, -1]]) * [
        0.05,
        0.04,
        0.1,
    ]
    numbers = [number for number, item in enumerate(world.objects) if item.name.startswith("arm/")]
    return np.tile(one, (len(numbers), 1)), [number for number in numbers for _ in one]


def measure(
    world: raycam.World, views: list[raycam.Camera], points: np.ndarray, objects: list[int]
) -> np.ndarray:
    """The exact pixels [c, n, 2] at the true joint values."""
    moved = world.copy()
    moved.set_joints("arm", TRUE)
    return np.array([raycam.keypoints(moved, view, points, objects).pixels for view in views])


@pytest.mark.parametrize("count", [1, 2])
def test_exact_pixels_return_the_joint_values(world: raycam.World, count: int) -> None:
    points, objects = corners(world)
    views = cameras()[:count]
    pixels = measure(world, views, points, objects)
    found = raycam.refine(world, views, pixels, points, objects, ["joints:arm"])
    np.testing.assert_allclose(found.joints["arm"], list(TRUE.values()), rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.world.robots["arm"].values, list(TRUE.values()), rtol=0, atol=1e-9)
    assert world.robots["arm"].values.tolist() == [0, 0, 0]
    assert found.converged
    assert found.rms < 1e-7
    assert found.residuals.shape == (count, len(points), 2)


def test_points_marked_with_nan_are_ignored(world: raycam.World) -> None:
    points, objects = corners(world)
    pixels = measure(world, cameras(), points, objects)
    pixels[0, ::2] = np.nan
    found = raycam.refine(world, cameras(), pixels, points, objects, ["joints:arm"])
    np.testing.assert_allclose(found.joints["arm"], list(TRUE.values()), rtol=0, atol=1e-9)
    assert np.isnan(found.residuals[0, ::2]).all()


def test_points_in_the_room_seen_from_the_wrist_return_the_joint_values(world: raycam.World) -> None:
    floor = next(number for number, item in enumerate(world.objects) if item.name == "floor")
    points = np.array([[x, y, 0.05] for x in (-0.6, 0.1, 0.5) for y in (-0.6, 0.2, 0.5)])
    moved = world.copy()
    moved.set_joints("arm", TRUE)
    lens = raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480))
    down = np.diag([1.0, -1.0, -1.0])
    wrist = lens.mounted(moved.robots["arm"], "hand", down, C=[0, 0, 0.1])
    pixels = raycam.keypoints(moved, wrist, points, [floor] * 9).pixels
    start = lens.mounted(world.robots["arm"], "hand", down, C=[0, 0, 0.1])
    found = raycam.refine(world, start, pixels, points, [floor] * 9, ["joints:arm"])
    np.testing.assert_allclose(found.joints["arm"], list(TRUE.values()), rtol=0, atol=1e-9)


def test_floating_joint_returns_the_pose(tmp_path: Path) -> None:
    text = (
        '<robot name="free"><link name="room"/><link name="cube"><visual><geometry><box size="1 2 3"/></geometry>'
        '</visual></link><joint name="pose" type="floating"><parent link="room"/><child link="cube"/>'
        '<origin rpy="0.3 0.2 0.1"/></joint></robot>'
    )
    (tmp_path / "free.urdf").write_text(text, encoding="utf-8")
    world = raycam.World()
    world.add_robot(tmp_path / "free.urdf")
    points = np.array([[0.5, 1, 1.5], [-0.5, 1, 1.5], [0.5, -1, 1.5], [0.5, 1, -1.5], [-0.5, -1, 1.5]])
    camera = raycam.Camera.look_at([6, -7, 5], [0, 0, 0], size=(640, 480), fov=50)
    moved = world.copy()
    true = [0.2, -0.3, 0.1, *(np.array([0.1, -0.2, 0.15, 0.9]) / np.linalg.norm([0.1, -0.2, 0.15, 0.9]))]
    moved.set_joints("free", true)
    pixels = raycam.keypoints(moved, camera, points, [0] * 5).pixels
    found = raycam.refine(world, camera, pixels, points, [0] * 5, ["joints:free"])
    np.testing.assert_allclose(found.joints["free"], true, rtol=0, atol=1e-9)
    assert found.deviations["free"].shape == (6,)


def test_deviations_equal_the_spread_of_noisy_estimates(world: raycam.World) -> None:
    points, objects = corners(world)
    pixels = measure(world, cameras(), points, objects)
    rng = np.random.default_rng(1)
    found = [
        raycam.refine(
            world,
            cameras(),
            pixels + rng.normal(0, 0.5, pixels.shape),
            points,
            objects,
            ["joints:arm"],
            sigma=0.5,
        )
        for _ in range(60)
    ]
    spread = np.std([one.joints["arm"] for one in found], axis=0)
    np.testing.assert_allclose(found[0].deviations["arm"], spread, rtol=0.3)
    assert 0.5 < found[0].rms < 0.9


def test_undetermined_joints_keep_their_values_with_a_notice(world: raycam.World) -> None:
    points, objects = corners(world)
    upper = [i for i, number in enumerate(objects) if world.objects[number].name == "arm/upper"]
    world.set_joints("arm", {"slide": 0.25})
    chosen = [objects[i] for i in upper]
    pixels = measure(world, cameras(), points[upper], chosen)
    with warns(raycam.Notice, code="missing_value", mentions=["elbow", "slide"]):
        found = raycam.refine(world, cameras(), pixels, points[upper], chosen, ["joints:arm"])
    np.testing.assert_allclose(found.joints["arm"], [0.3, 0, 0.25], rtol=0, atol=1e-9)
    assert np.isfinite(found.deviations["arm"]).tolist() == [True, False, False]


def test_values_beyond_limits_are_kept_with_a_notice(world: raycam.World, tmp_path: Path) -> None:
    points, objects = corners(world)
    pixels = measure(world, cameras(), points, objects)
    (tmp_path / "narrow.urdf").write_text(ARM.replace('lower="-3" upper="3"', 'lower="-0.1" upper="0.1"'))
    narrow = raycam.World()
    narrow.add_robot(tmp_path / "narrow.urdf", location=[0.2, 0.1, 0], yaw=20)
    with warns(raycam.Notice, mentions=["shoulder"]):
        found = raycam.refine(narrow, cameras(), pixels, points, objects, ["joints:arm"])
    assert found.joints["arm"][0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("changes", "code", "fact"),
    [
        ({"parameters": ["joints:arn"]}, "unknown_name", "arm"),
        ({"parameters": ["pose:arm"]}, "unknown_name", "joints:ROBOT"),
        ({"objects": [0]}, "wrong_shape", "objects"),
        ({"pixels": np.zeros((3, 2))}, "wrong_shape", "[2, "),
        ({"sigma": 0}, None, "sigma"),
        ({"cameras": "wrist"}, None, "wrist"),
    ],
)
def test_wrong_arguments_raise(
    world: raycam.World, changes: dict[str, object], code: str | None, fact: str
) -> None:
    points, objects = corners(world)
    given = {"cameras": cameras(), "pixels": np.zeros((2, len(points), 2)), "objects": objects}
    given |= {"points": points, "parameters": ["joints:arm"]} | changes
    with raises(raycam.Error, code=code, mentions=[fact]):
        raycam.refine(world, **given)  # type: ignore[arg-type]


def test_points_behind_the_camera_raise(world: raycam.World) -> None:
    points, objects = corners(world)
    away = raycam.Camera.look_at([3, 0, 1], [6, 0, 1], size=(64, 48), fov=50)
    with raises(raycam.SettingsError, code="out_of_range", mentions=["camera 0", "point 0"]):
        raycam.refine(world, away, np.zeros((len(points), 2)), points, objects, ["joints:arm"])


def test_no_notice_is_given_for_a_complete_estimate(world: raycam.World) -> None:
    points, objects = corners(world)
    pixels = measure(world, cameras(), points, objects)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        raycam.refine(world, cameras(), pixels, points, objects, ["joints:arm"])
