"""Rigs: cameras on one moving body, in worlds, files and images."""

from __future__ import annotations

import pickle
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
import raycam
from raycam.calibration import WRITTEN_FORMATS
from scipy.spatial.transform import Rotation, Slerp
from support.raises import has_notice, raises

K = np.array([[420.0, 0.0, 161.5], [0.0, 430.0, 118.25], [0.0, 0.0, 1.0]])


def turned(seed: int) -> np.ndarray:
    return Rotation.random(random_state=seed).as_matrix()


def pair() -> raycam.Rig:
    """Two cameras with lenses, mounted on a body with its own axes."""
    cameras = {
        "left": raycam.Camera(K, turned(1), [0.1, 0.2, 0.0], (320, 240), distortion=[-0.2, 0.05, 0, 0]),
        "right": raycam.Camera(
            K, turned(2), [0.1, -0.2, 0.1], (320, 240), distortion=[0.1] * 4, model="fisheye"
        ),
    }
    return raycam.Rig(cameras, turned(3), [4.0, -2.0, 1.0], name="pair")


def room() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [8, 8, 4]}, location=[0, 0, 1], name="walls")
    rng = np.random.default_rng(0)
    for i in range(6):
        place = [2.5, *rng.uniform(-1, 1, 2)]
        world.add_object(box={"size": 0.5}, location=place, yaw=20 * i, color=rng.uniform(0.2, 1, 3).tolist())
    world.add_light(type="sky", radiance=[1, 1, 1])
    return world


def ahead(rows: int = 60, **options: object) -> raycam.Camera:
    return raycam.Camera.from_pose([0, 0, 0.5], size=(rows * 4 // 3, rows), focal=rows * 1.2, **options)


def test_rig_cameras_project_points_in_the_axes_of_the_body() -> None:
    rig = pair()
    points = np.random.default_rng(0).normal(size=(200, 3)) * 5
    in_body = (points - rig.C) @ rig.R.T
    for name, mount in rig.mounts.items():
        expected, seen = mount.project(in_body)
        pixels, also = rig[name].project(points)
        assert (seen == also).all()
        assert seen.any()
        np.testing.assert_allclose(pixels[seen], expected[seen], atol=1e-9)
    assert list(rig) == ["left", "right"]
    np.testing.assert_allclose(np.linalg.norm(rig.baseline()), np.linalg.norm([0, 0.4, -0.1]), atol=1e-12)


def test_rig_of_placed_cameras_keeps_their_poses() -> None:
    rig = pair()
    again = raycam.Rig.of(dict(rig), rig.R, rig.C, name="pair")
    first = raycam.Rig.of(dict(rig))
    for name in rig:
        np.testing.assert_allclose(again.mounts[name].C, rig.mounts[name].C, atol=1e-12)
        np.testing.assert_allclose(first[name].R, rig[name].R, atol=1e-12)
        np.testing.assert_allclose(first[name].C, rig[name].C, atol=1e-12)
    np.testing.assert_allclose(first.mounts["left"].R, np.eye(3), atol=1e-12)
    moved = rig.placed([1, 2, 3], 10, 20, 30)
    np.testing.assert_allclose(moved.roll_pitch_yaw, [10, 20, 30], atol=1e-9)
    expected = Rotation.from_euler("ZYX", [30, 20, 10], degrees=True).as_matrix()
    np.testing.assert_allclose(moved.R.T, expected, atol=1e-12)


def test_rigs_support_descriptions_pickle_and_equality() -> None:
    rig = pair()
    moving = rig.moving(rig.at_pose(turned(4), [5.0, 0.0, 0.0]), exposure=0.01, readout=0.03)
    for one in (rig, moving):
        assert raycam.Rig.from_dict(one.to_dict()) == one == pickle.loads(pickle.dumps(one))
        assert hash(pickle.loads(pickle.dumps(one))) == hash(one)
    assert moving != rig
    assert rig.shutter is None
    assert moving.shutter["readout"] == 0.03
    assert "left" in repr(rig)


def test_rows_of_a_rotating_rig_have_origins_on_arcs() -> None:
    rig = pair()
    end = rig.at_pose(turned(5), [4.5, -2.0, 1.2])
    moving = rig.moving(end, readout=0.04)["left"]
    mount = rig.mounts["left"]
    turns = Slerp([0, 1], Rotation.from_matrix([rig.R, end.R]))
    for row in (0.0, 60.0, 200.5):
        part = (row + 0.5) / 240
        body_from_world, place = turns(part).as_matrix(), rig.C + part * (end.C - rig.C)
        origin, _ = moving.rays([100.0, row])
        np.testing.assert_allclose(origin, place + body_from_world.T @ mount.C, atol=1e-12)
    assert rig.moving(end, readout=0.04).still().shutter is None


def test_world_files_define_rigs_that_videos_move(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text("""
[[object]]
box = { size = 1 }

[[rig]]
name = "car"
location = [0, 0, 1]
[[rig.camera]]
name = "left"
size = [64, 48]
focal = 50
location = [1, 0.2, 0]
[[rig.camera]]
name = "right"
size = [64, 48]
focal = 50
location = [1, -0.2, 0]

[video]
interpolation = "linear"
keyframe = [
    { time = 0, rig = "car", location = [0, 0, 1], yaw = 0 },
    { time = 2, rig = "car", location = [0, 4, 1], yaw = 90 },
]
""")
    world = raycam.load(path)
    assert list(world.cameras) == ["car/left", "car/right"]
    rig = world.rigs["car"]
    assert all(rig[name] == world.cameras[f"car/{name}"] for name in rig)
    np.testing.assert_allclose(rig.baseline(), [0.4, 0, 0], atol=1e-12)
    later = world.rig_at(rig, 2.0)
    np.testing.assert_allclose(later["left"].C, [-0.2, 5, 1], atol=1e-12)
    np.testing.assert_allclose(later["right"].forward, [0, 1, 0], atol=1e-12)
    again = raycam.World.from_bytes(world.to_bytes())
    assert again.rigs == world.rigs
    other = raycam.World()
    other.add_rig(rig)
    other.add_rig(rig)
    assert list(other.rigs) == ["car", "car-2"]
    assert "car-2/left" in other.cameras
    with raises(raycam.WorldError, code="wrong_shape", mentions=["rig[0].camera[0]"]):
        raycam.World.from_dict({"rig": {"camera": {"focal": 9, "location": [1, 2]}}})


def test_kalibr_files_keep_the_mounts_without_the_pose(tmp_path: Path) -> None:
    rig = pair()
    notices = raycam.save_cameras(tmp_path / "chain.yaml", rig, "kalibr")
    assert has_notice(notices, "not_written", "Kalibr", "pose")
    (read,) = raycam.load_cameras(tmp_path / "chain.yaml").rigs.values()
    for (name, mount), other in zip(rig.mounts.items(), read.mounts.values(), strict=True):
        np.testing.assert_allclose(other.R, mount.R, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(other.C, mount.C, atol=1e-12)
        assert other.model == mount.model
    many = {"a": rig, "b": rig.placed([0, 0, 0])}
    with raises(raycam.FormatError, code="cannot_write", mentions=['"pair"']):
        raycam.save_cameras(tmp_path / "many.yaml", many, "kalibr")


def test_kitti_files_contain_the_pair_in_the_axes_of_the_first_camera(tmp_path: Path) -> None:
    rig = raycam.Rig.stereo(ahead(), 0.54)
    raycam.save_cameras(tmp_path / "calib.txt", rig, "kitti")
    found = raycam.load_cameras(tmp_path / "calib.txt", size=(80, 60))
    (read,) = found.rigs.values()
    np.testing.assert_allclose(read.baseline(), [0.54, 0, 0], atol=1e-12)
    rows = [line.split()[1:] for line in (tmp_path / "calib.txt").read_text().splitlines()]
    P1 = np.array(rows[1], dtype=float).reshape(3, 4)
    np.testing.assert_allclose(P1, rig["right"].K @ np.column_stack([np.eye(3), [-0.54, 0, 0]]), atol=1e-12)
    text = (tmp_path / "calib.txt").read_text()
    raycam.save_cameras(tmp_path / "again.txt", found, "kitti")
    assert (tmp_path / "again.txt").read_text() == text


@pytest.mark.parametrize("format", ["colmap", "colmap-binary"])
def test_colmap_rigs_and_frames_round_trip_with_pycolmap(tmp_path: Path, format: str) -> None:
    rig = pair()
    given = {f"f{i}": rig.at_pose(turned(10 + i), [i, 0.5, 2.0]) for i in range(3)}
    raycam.save_cameras(tmp_path / "model", given, format)
    model = pycolmap.Reconstruction(str(tmp_path / "model"))
    assert model.num_rigs() == 1
    assert model.num_frames() == 3
    assert model.num_cameras() == 2
    for image in model.images.values():
        frame, name = image.name.split("/")
        pose = image.cam_from_world()
        np.testing.assert_allclose(pose.rotation.matrix(), given[frame][name].R, atol=1e-12)
        np.testing.assert_allclose(pose.translation, given[frame][name].t, atol=1e-12)
    (tmp_path / "again").mkdir()
    write = model.write_text if format == "colmap" else model.write_binary
    write(str(tmp_path / "again"))
    for folder in ("model", "again"):
        read = raycam.load_cameras(tmp_path / folder)
        assert len(read.rigs) == 3
        assert len(read) == 6
        for one, expected in zip(read.rigs.values(), given.values(), strict=True):
            np.testing.assert_allclose(
                [camera.C for camera in one.values()], [camera.C for camera in expected.values()], atol=1e-12
            )
    raycam.save_cameras(tmp_path / "third", raycam.load_cameras(tmp_path / "model"), format)
    for path in (tmp_path / "model").iterdir():
        assert (tmp_path / "third" / path.name).read_bytes() == path.read_bytes()


def test_unsupported_properties_of_a_rig_give_notices_on_writing(tmp_path: Path) -> None:
    blurred = ahead().with_aperture(0.01, focus=2).with_vignetting(cos4=True)
    moving = ahead().moving(ahead().at_pose(np.eye(3), [1, 0, 0]), exposure=0.1)
    single = {"ros", "camodocal", "orb-slam", "tum-intrinsics"}  # these formats contain one camera
    for format in sorted(set(WRITTEN_FORMATS) - single):
        options = {"times": {"a": 1.0, "b": 2.0}} if format in ("tum", "euroc") else {}
        notices = raycam.save_cameras(tmp_path / format, {"a": blurred, "b": moving}, format, **options)
        text = "\n".join(map(str, notices))
        assert "'a': its aperture and vignetting" in text.replace('"', "'"), format
        assert "'b': its shutter is" in text.replace('"', "'"), format
    said = raycam.save_cameras(tmp_path / "t.json", raycam.Rig.stereo(ahead(), 0.1), "nerf")
    assert has_notice(said, "not_written", "nerf", "rig")


def test_disparity_of_a_rig_equals_the_closed_form_and_opencvs_points() -> None:
    world = room()
    rig = raycam.Rig.stereo(ahead(120), 0.2)
    frames = rig.render(world, channels=["depth", "position", "disparity"], samples=1)
    left, right = frames["left"], frames["right"]
    f = rig["left"].K[0, 0]
    for frame in (left, right):
        np.testing.assert_allclose(frame["disparity"], f * 0.2 / frame["depth"], rtol=1e-5)
    k, zero = rig["left"].K, np.zeros(5)
    *_, Q, _, _ = cv2.stereoRectify(
        k, zero, k, zero, rig["left"].size, np.eye(3), np.array([[-0.2], [0], [0]]), alpha=-1,
        flags=cv2.CALIB_ZERO_DISPARITY,
    )  # fmt: skip
    Q[:2, 3] = -k[:2, 2]  # OpenCV chooses its own principal point
    Q[2, 3] = k[0, 0]
    points = cv2.reprojectImageTo3D(left["disparity"].astype(np.float32), Q)
    in_camera = (left["position"] - rig["left"].C) @ rig["left"].R.T
    np.testing.assert_allclose(points, in_camera, rtol=1e-4, atol=1e-4)
    only = rig.render(world, channels="disparity", samples=1)
    assert list(only["left"]) == ["disparity"]
    assert raycam.disparity(world, rig)["occluded"].any()


def test_disparity_requires_a_rectified_pair() -> None:
    world, rig = room(), pair()
    with raises(raycam.CameraError, code="unsupported_camera"):
        rig.render(world, channels=["disparity"])
    moving = raycam.Rig.stereo(ahead(), 0.1)
    moving = moving.moving(moving.placed([0, 1, 0.5]), exposure=0.01)
    with raises(raycam.CameraError, code="unsupported_camera"):
        raycam.disparity(world, moving)
    with raises(raycam.CameraError, code="unknown_name"):
        rig.pair("lef")
    with raises(raycam.CameraError, code="missing_value"):
        raycam.Rig({"a": ahead()}).pair()
    with raises(raycam.CameraError, code="missing_value", mentions=["rig"]):
        raycam.Rig({})
    with raises(raycam.CameraError, code="not_a_rotation"):
        raycam.Rig({"a": ahead()}, R=np.ones((3, 3)))
    affine = raycam.Camera.from_matrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], (9, 9))
    with raises(raycam.CameraError, code="unsupported_camera"):
        raycam.Rig.of({"a": affine})
