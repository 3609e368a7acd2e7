"""`raycam cameras`: its options compared with OpenCV, and errors for common mistakes."""

from __future__ import annotations

import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
from raycam.cli import main

SIZE = (640, 480)
K = np.array([[512.0, 0, 322.5], [0, 508.0, 238.0], [0, 0, 1]])
K2 = np.array([[520.0, 0, 310.0], [0, 515.0, 250.0], [0, 0, 1]])
D, D2 = np.array([-0.21, 0.083, 0.0011, -0.0007]), np.array([-0.1, 0.02, 1e-3, 2e-3])
TURN = cv2.Rodrigues(np.array([0.02, -0.05, 0.03]))[0]
STEP = np.array([-0.2, 0.01, 0.02])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    left = raycam.Camera(K, np.eye(3), np.zeros(3), SIZE, distortion=D)
    right = raycam.Camera(K2, TURN, -TURN.T @ STEP, SIZE, distortion=D2)
    raycam.save_cameras("calib.yaml", {"camera": left}, "opencv")
    raycam.save_cameras("stereo.yaml", raycam.Rig({"cam0": left, "cam1": right}), "kalibr")
    Path("body.txt").write_text("".join(f"{10 + i}.5 {i} 0 0 0 0 0 1\n" for i in range(3)))
    return tmp_path


def run(command: str) -> int:
    """Runs `raycam cameras` with these words and returns its exit status."""
    return main(["cameras", *shlex.split(command)])


def made(command: str, *, output: str = "out.yaml", format: str = "opencv") -> raycam.Cameras:
    assert run(f"{command} --to {format} -o {output} --quiet") == 0
    return raycam.load_cameras(output)


def test_size_option_scales_the_intrinsics(folder: Path) -> None:
    (camera,) = made("calib.yaml --size 320x240").values()
    # The image borders do not move: cv2.resize maps the pixel x to (x + 0.5) / 2 - 0.5.
    np.testing.assert_allclose(camera.K[:2, 2], (K[:2, 2] + 0.5) / 2 - 0.5, atol=1e-12)
    np.testing.assert_allclose(np.diag(camera.K)[:2], np.diag(K)[:2] / 2, atol=1e-12)
    assert camera.size == (320, 240)
    np.testing.assert_array_equal(camera.distortion, D)


def test_crop_option_applies_after_size(folder: Path) -> None:
    (camera,) = made("calib.yaml --size 320x240 --crop 10,20,200,150").values()
    np.testing.assert_allclose(camera.K[:2, 2], (K[:2, 2] + 0.5) / 2 - 0.5 - [10, 20], atol=1e-12)
    assert camera.size == (200, 150)


def test_pinhole_option_keeps_k_and_writes_opencvs_map(folder: Path) -> None:
    (camera,) = made("calib.yaml --pinhole --maps maps.npz").values()
    assert camera.model == "pinhole"
    np.testing.assert_array_equal(camera.K, K)
    x, y = cv2.initUndistortRectifyMap(K, D, np.eye(3), K, SIZE, cv2.CV_32FC1)
    (table,) = np.load("maps.npz").values()
    np.testing.assert_allclose(table, np.stack([x, y], axis=-1), atol=1e-4)


@pytest.mark.parametrize("balance", ["", "0", "1"])
def test_undistort_option_equals_opencvs_new_camera_matrix(folder: Path, balance: str) -> None:
    (camera,) = made(f"calib.yaml --undistort {balance}").values()
    theirs, _ = cv2.getOptimalNewCameraMatrix(K, D, SIZE, float(balance or 0))
    np.testing.assert_allclose(camera.K, theirs, atol=0.01)
    assert camera.model == "pinhole"


def test_rectify_option_equals_opencvs_rectification(folder: Path) -> None:
    rig = made("stereo.yaml --rectify --maps maps.npz", format="kalibr").rigs["rig"]
    R1, R2, *_ = cv2.stereoRectify(K, D, K2, D2, SIZE, TURN, STEP[:, None], alpha=-1)
    left, right = rig.values()
    np.testing.assert_array_equal(left.K, right.K)
    np.testing.assert_allclose(right.R @ left.R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(left.R @ (right.C - left.C), [np.linalg.norm(STEP), 0, 0], atol=1e-12)
    maps = np.load("maps.npz")
    assert list(maps) == ["left", "right"]
    for name, k, d, turn in (("left", K, D, R1), ("right", K2, D2, R2)):
        x, y = cv2.initUndistortRectifyMap(k, d, turn, left.K, SIZE, cv2.CV_32FC1)
        np.testing.assert_allclose(maps[name], np.stack([x, y], axis=-1), atol=1e-4)


def test_time_offset_option_subtracts_from_the_times(folder: Path) -> None:
    for offset, first in (("first", 0.0), ("10", 0.5), ("-1.5", 12.0)):
        cameras = made(
            f"body.txt --intrinsics calib.yaml --time-offset={offset}", output="t.txt", format="tum"
        )
        np.testing.assert_allclose(list(cameras.times.values()), first + np.arange(3), atol=1e-12)


def test_file_colon_name_selects_one_camera(folder: Path) -> None:
    (camera,) = made("stereo.yaml:cam1 --pinhole").values()
    np.testing.assert_allclose(camera.K, K2, atol=1e-12)


def test_only_calibration_in_a_folder_is_read_and_several_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "session").mkdir()
    (folder / "session/notes.txt").write_text("a calibration of the left camera\n")
    (folder / "calib.yaml").rename(folder / "session/2026-11-27 left.yml")
    assert run("session") == 0
    shown = capsys.readouterr()
    assert "640 x 480" in shown.out
    assert "2026-11-27 left.yml is the only calibration in the folder; it was opened as opencv" in shown.err
    (folder / "stereo.yaml").rename(folder / "session/stereo.yaml")
    assert run("session") != 0
    told = capsys.readouterr().err
    assert "2 calibrations" in told
    assert "2026-11-27 left.yml (opencv), stereo.yaml (kalibr)" in told
    # The name of an existing folder takes precedence.
    (folder / "session/2026-11-27 left.yml").rename(folder / "session/calibration.yml")
    assert run("session") == 0
    (folder / "empty").mkdir()
    assert run("empty") != 0
    assert "no calibration found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("calib.yaml --size 320", "WIDTHxHEIGHT"),
        ("calib.yaml --size 320x200", "320"),
        ("calib.yaml --crop 1,2,3", "X,Y,WIDTH,HEIGHT"),
        ("calib.yaml --crop 0.5,0,9,9", "X,Y,WIDTH,HEIGHT"),
        ("calib.yaml --crop 0,0,0,9", "expected 1 to 65536"),
        ("calib.yaml --undistort 2", "expected 0 to 1"),
        ("calib.yaml --undistort x", "invalid float value"),
        ("calib.yaml --maps a.npz", "--undistort, --pinhole or --rectify"),
        ("calib.yaml --pinhole --undistort", "not allowed with"),
        ("calib.yaml --rectify", "1: camera"),
        ("calib.yaml --time-offset 3", "--time-offset"),
        ("body.txt --intrinsics calib.yaml --time-offset soon", "soon"),
        ("calib.yaml -o a.yaml", "--to"),
        ("calib.yaml --to opencvv", "did you mean 'opencv'"),
        ("stereo.yaml:cam2", "did you mean 'cam1'"),
        ("calib.yaml --direction camera_from_world", "omit direction= and axes="),
        ("calib.yaml --lens fish", "did you mean"),
        ("calib.yaml --format kalibrr", "did you mean"),
        ("none.yaml", "No such file"),
        ("body.txt", "--intrinsics"),
    ],
)
def test_invalid_camera_commands_print_one_error_with_a_remedy(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str, reason: str
) -> None:
    try:
        code = run(command)
    except SystemExit as fault:
        code = fault.code
    told = capsys.readouterr().err
    assert code != 0
    assert reason in told
    assert len([line for line in told.splitlines() if "error" in line]) == 1
    assert "Traceback" not in told


def test_rectify_option_reports_exchanged_cameras(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    left = raycam.Camera(K, np.eye(3), np.zeros(3), SIZE)
    raycam.save_cameras("pair.yaml", raycam.Rig({"a": left.replace(C=[0.2, 0, 0]), "b": left}), "kalibr")
    assert run("pair.yaml --rectify") != 0
    assert "to the right" in capsys.readouterr().err
