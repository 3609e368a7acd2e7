"""Formats that raycam writes and reads back, and the options of `raycam cameras`."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.calibration import WRITTEN_FORMATS
from raycam.errors import FormatError
from support.camera_truth import intrinsics, points, pose
from support.raises import has_notice, raises

SIZE = (640, 480)
K = intrinsics(520.0, 520.0, 319.5, 239.5)
BROWN = (-0.1, 0.02, 0.001, -0.002, 0.003)
RATIONAL = (*BROWN, 0.01, 0.002, 0.003)
PRISM = (0.001, -0.0005, 0.0007, 0.0002)
KINDS: dict[str, dict[str, Any]] = {
    "pinhole": {},
    "off": {"K": intrinsics(520.0, 515.5, 322.25, 236.75)},
    "skew": {"K": intrinsics(520.0, 515.5, 322.25, 236.75, 1.5)},
    "half": {"K": intrinsics(520.0, 520.0, 320.0, 240.0), "pixel_center": "half"},
    "opencv": {"distortion": BROWN[:4]},
    "opencv5": {"distortion": BROWN},
    "opencv8": {"distortion": RATIONAL},
    "opencv12": {"distortion": (*RATIONAL, *PRISM)},
    "opencv14": {"distortion": (*RATIONAL, *PRISM, 0.01, -0.02)},
    "fisheye": {"distortion": (0.02, -0.01, 0.004, -0.001), "model": "fisheye"},
    "omni": {"distortion": (1.8, *BROWN[:4]), "model": "omni"},
    "fov": {"distortion": (0.8,), "model": "fov"},
    "prism": {
        "distortion": (0.02, -0.01, 0.001, -0.002, 0.004, -0.001, 0.0005, 0.0003),
        "model": "thin_prism_fisheye",
    },
    "aria": {
        "distortion": (0.02, -0.01, 0.004, -0.001, 0.0002, 0.0001, 0.001, -0.002, *PRISM),
        "model": "rad_tan_thin_prism_fisheye",
    },
    "division": {"distortion": (-0.12,), "model": "division"},
    "eucm": {"distortion": (0.6, 1.1), "model": "eucm"},
    "double sphere": {"distortion": (-0.2, 0.55), "model": "ds"},
    "equirectangular": {"model": "equirectangular"},
    "cylindrical": {"model": "cylindrical"},
}
PLAIN = ("pinhole", "off", "half")
HOLDS = {
    "colmap": (*PLAIN, "opencv", "opencv5", "opencv8", "fisheye", "fov", "prism", "aria", "division", "eucm"),
    "colmap-binary": (
        *PLAIN,
        "opencv",
        "opencv5",
        "opencv8",
        "fisheye",
        "fov",
        "prism",
        "aria",
        "division",
        "eucm",
    ),
    "kalibr": (*PLAIN, "opencv", "fisheye", "omni", "fov", "eucm", "double sphere"),
    "ros": (*PLAIN, "skew", "opencv", "opencv5", "opencv8", "fisheye"),
    "orb-slam": (*PLAIN, "opencv", "opencv5", "fisheye"),
    "camodocal": (*PLAIN, "opencv", "opencv5", "opencv8", "fisheye", "omni"),
    "nerf": (*PLAIN, "opencv", "opencv5", "fisheye"),
    "blender": ("pinhole", "half"),
    "blender-splits": ("pinhole", "half"),
    "3dgs": ("pinhole", "half"),
    "bop": (*PLAIN, "skew"),
    "euroc": tuple(KINDS),
    "opencv": (*PLAIN, "skew", "opencv", "opencv5", "opencv8", "opencv12", "opencv14", "fisheye"),
    "kitti": (*PLAIN, "skew"),
    "poses": tuple(KINDS),
    "kitti-poses": tuple(KINDS),
    "tum": tuple(KINDS),
    "tum-intrinsics": PLAIN,
}
"""The kinds of cameras that each format can store; formats of poses are read with `intrinsics=`."""
ENDINGS = {
    "opencv": ".yml",
    "nerf": ".json",
    "blender": ".json",
    "3dgs": ".json",
    "bop": ".json",
    "euroc": ".csv",
}
ALONE = ("orb-slam", "camodocal", "ros", "tum-intrinsics")
"""Formats of one camera without its pose."""


def camera(kind: str, seed: int) -> raycam.Camera:
    given = {"K": K, **KINDS[kind]}
    return raycam.Camera(given.pop("K"), *pose(seed), SIZE, **given)


def same(found: raycam.Camera, expected: raycam.Camera, posed: bool = True) -> None:
    if not posed:
        expected = expected.at_pose(np.eye(3), np.zeros(3))
    world = points(expected.R, expected.C, 0.4)
    shift = (0.5 if found.pixel_center == "half" else 0) - (0.5 if expected.pixel_center == "half" else 0)
    np.testing.assert_allclose(found.project(world)[0] - shift, expected.project(world)[0], rtol=0, atol=1e-6)


def test_table_of_expected_data_contains_every_written_format() -> None:
    assert set(HOLDS) == set(WRITTEN_FORMATS)


@pytest.mark.parametrize("format", HOLDS)
@pytest.mark.parametrize("kind", KINDS)
def test_written_calibrations_are_read_back(tmp_path: Path, format: str, kind: str) -> None:
    alone = format in ALONE
    cameras = {f"train/{i}": camera(kind, i) for i in range(1 if alone else 3)}
    path = tmp_path / f"out{ENDINGS.get(format, '')}"
    times = {name: 1.4e9 + i for i, name in enumerate(cameras)}
    if kind not in HOLDS[format]:
        with raises(FormatError, code="cannot_write", mentions=['"train/0"']):
            raycam.save_cameras(path, cameras, format, times=times)
        assert not list(tmp_path.iterdir())
        return
    raycam.save_cameras(path, cameras, format, times=times)
    known: dict[str, Any] = {}
    if format in ("poses", "kitti-poses", "euroc", "tum"):
        known = {"intrinsics": camera(kind, 0).at_pose(np.eye(3), np.zeros(3))}
    elif format in ("bop", "kitti", "tum-intrinsics"):
        known = {"size": SIZE}
    back = raycam.load_cameras(path, format=None if format != "ros" else "ros", **known)
    assert len(back) == len(cameras)
    for found, expected in zip(back.values(), cameras.values(), strict=True):
        same(found, expected, posed=not alone)
        assert found.size == SIZE


FILES = tuple(
    format for format in HOLDS if format not in ("colmap", "colmap-binary", "kitti", "blender-splits")
)
"""Formats that write a single file."""


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("format", FILES)
def test_folder_with_a_single_file_opens_like_the_file(tmp_path: Path, format: str, packed: bool) -> None:
    cameras = {f"train/{i}": camera("pinhole", i) for i in range(1 if format in ALONE else 3)}
    times = {name: 1.4e9 + i for i, name in enumerate(cameras)}
    path = tmp_path / "of some day" / f"mine{ENDINGS.get(format, '.txt' if format != 'kalibr' else '.yaml')}"
    path.parent.mkdir()
    raycam.save_cameras(path, cameras, format, times=times)
    (written,) = path.parent.iterdir()
    if packed:
        (path.parent / f"{written.name}.gz").write_bytes(gzip.compress(written.read_bytes()))
        written.unlink()
        (written,) = path.parent.iterdir()
    known: dict[str, Any] = {"intrinsics": camera("pinhole", 0).at_pose(np.eye(3), np.zeros(3))}
    if format not in ("poses", "kitti-poses", "euroc", "tum"):
        known = {"size": SIZE}
    alone, folder = (raycam.load_cameras(given, **known) for given in (written, path.parent))
    assert list(folder) == list(alone)
    for name in alone:
        assert folder[name] == alone[name]


def test_folder_with_gzipped_files_of_a_pair_is_read(tmp_path: Path) -> None:
    turn, shift = cv2.Rodrigues(np.array([0.01, -0.02, 0.005]))[0], np.array([[-0.12], [0.001], [0.002]])
    for name, matrices in {
        "intrinsics": {"M1": K, "D1": np.zeros((1, 5)), "M2": K, "D2": np.zeros((1, 5))},
        "extrinsics": {"R": turn, "T": shift},
    }.items():
        storage = cv2.FileStorage(str(tmp_path / f"{name}.yml.gz"), cv2.FILE_STORAGE_WRITE)
        for key, matrix in matrices.items():
            storage.write(key, matrix)
        storage.release()
    left, right = raycam.load_cameras(tmp_path, size=SIZE).values()
    np.testing.assert_allclose(left.R, np.eye(3))
    np.testing.assert_allclose(right.R, turn, atol=1e-12)
    np.testing.assert_allclose(right.C, (-turn.T @ shift)[:, 0], atol=1e-12)


@pytest.mark.parametrize("lens", ["opencv", "fisheye"])
def test_stereo_pair_is_written_as_orbslam_settings(tmp_path: Path, lens: str) -> None:
    rig = raycam.Rig({"a": camera(lens, 1), "b": camera(lens, 2)})
    raycam.save_cameras(tmp_path / "a.yaml", rig, "orb-slam")
    back = raycam.load_cameras(tmp_path / "a.yaml")
    first, second = rig.values()
    turned = second.at_pose(second.R @ first.R.T, first.R @ (second.C - first.C))
    same(back["Camera2"], turned)
    storage = cv2.FileStorage(str(tmp_path / "a.yaml"), cv2.FILE_STORAGE_READ)
    assert storage.getNode("Stereo.T_c1_c2").mat().shape == (4, 4)
    assert storage.getNode("Camera1.fx").real() == 520.0


def test_splits_are_written_to_their_own_files(tmp_path: Path) -> None:
    cameras = {
        f"{split}/{i}": camera("pinhole", i) for i, split in enumerate(["train", "test", "train", "val"])
    }
    raycam.save_cameras(tmp_path / "set", cameras, "blender-splits")
    table = json.loads((tmp_path / "set/transforms_train.json").read_text())
    assert [frame["file_path"] for frame in table["frames"]] == ["train/0", "train/2"]
    assert list(raycam.load_cameras(tmp_path / "set")) == ["train/0", "train/2", "val/3", "test/1"]
    raycam.save_cameras(tmp_path / "a.json", cameras, "nerf")
    table = json.loads((tmp_path / "a.json").read_text())
    assert table["val_filenames"] == ["val/3"]
    assert len(table["train_filenames"]) == 2


def test_writing_a_format_that_is_only_read_raises(tmp_path: Path) -> None:
    assert "metashape" not in WRITTEN_FORMATS
    with raises(FormatError, code="cannot_write", mentions=["metashape"]):
        raycam.save_cameras(tmp_path / "a", {"a": camera("pinhole", 0)}, "metashape")


def run(*arguments: str) -> str:
    made = subprocess.run(
        [sys.executable, "-m", "raycam", "cameras", *arguments], capture_output=True, text=True, check=True
    )
    return made.stdout + made.stderr


def test_command_crops_undistorts_and_writes_maps(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    given = camera("opencv5", 1)
    raycam.save_cameras(file, {"front": given}, "opencv")
    output, maps = tmp_path / "b.yaml", tmp_path / "maps.npz"
    run(
        str(file),
        "--crop",
        "20,10,600,440",
        "--undistort",
        "0.5",
        "--maps",
        str(maps),
        "--to",
        "opencv",
        "-o",
        str(output),
    )
    (found,) = raycam.load_cameras(output).values()
    cropped = given.cropped(20, 10, 600, 440)
    expected = cropped.undistorted(0.5)
    np.testing.assert_allclose(found.K, expected.K)
    own = intrinsics(520, 520, 299.5, 229.5)
    tables = cv2.initUndistortRectifyMap(own, np.array(BROWN), None, expected.K, (600, 440), cv2.CV_32FC1)
    np.testing.assert_allclose(np.load(maps)["front"], np.stack(tables, axis=-1), atol=1e-3)


def test_time_offset_first_shifts_the_first_time_to_zero(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("".join(f"{1.5e9 + i} 0 0 {i} 0 0 0 1\n" for i in range(3)))
    run(str(file), "--time-offset", "first", "--to", "tum", "-o", str(tmp_path / "b.txt"))
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "b.txt")[:, 0], [0, 1, 2])


def test_command_keeps_the_poses_of_a_rig(tmp_path: Path) -> None:
    rig = raycam.Rig({"cam0": camera("opencv", 1), "cam1": camera("opencv", 2)})
    raycam.save_cameras(tmp_path / "a.yaml", rig, "kalibr")
    run(str(tmp_path / "a.yaml"), "--undistort", "--to", "kalibr", "-o", str(tmp_path / "b.yaml"))
    back = raycam.load_cameras(tmp_path / "b.yaml").rigs["rig"]
    for name, found in back.items():
        assert found.model == "pinhole"
        np.testing.assert_allclose(found.C, rig[name].C, atol=1e-12)


def test_direction_option_determines_the_pose_direction(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n")
    shared = ("--to", "kitti-poses", "-o", str(tmp_path / "b.txt"), "--direction", "camera_from_world")
    told = run(str(tmp_path / "a.txt"), *shared)
    assert "does not specify the direction" not in told
    np.testing.assert_allclose(np.loadtxt(tmp_path / "b.txt").reshape(3, 4)[:, 3], [-5, -6, -7])


def test_orthographic_camera_written_as_kitti_gives_a_notice_about_its_depth_plane(tmp_path: Path) -> None:
    plan = raycam.Camera.orthographic([3, 2, 1], target=[0, 0, 0], height=4, size=SIZE)
    told = raycam.save_cameras(tmp_path / "calib.txt", {"plan": plan}, "kitti")
    assert has_notice(told, "not_written", '"plan"', "depth"), told
    back = raycam.load_cameras(tmp_path / "calib.txt", size=SIZE)["P0"]
    world = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(back.project(world)[0], plan.project(world)[0], atol=1e-9)
    # The camera that was read is at infinity. Its rays have no start plane, so the file loses nothing.
    told = raycam.save_cameras(tmp_path / "again.txt", {"P0": back}, "kitti")
    assert not has_notice(told, "not_written", "depth")
