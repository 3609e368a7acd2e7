"""The self-check with OpenCV, and its result if OpenCV is missing or the image is wrong."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
import raycam
from raycam import cli
from raycam.calibration_check.board import Board
from support.raises import raises

K = [[520.0, 0.0, 242.0], [0.0, 526.0, 177.0], [0.0, 0.0, 1.0]]


def camera(size: tuple[int, int] = (480, 360), **lens: Any) -> raycam.Camera:
    return raycam.Camera(K, np.eye(3), [3.0, -1.0, 2.0], size, **lens)


@pytest.mark.parametrize(
    ("given", "board"),
    [
        (camera(distortion=[-0.2, 0.06, 1e-3, -5e-4]), "charuco"),
        (
            raycam.Camera(
                [[240.0, 0.0, 242.0], [0.0, 241.0, 177.0], [0.0, 0.0, 1.0]],
                np.eye(3),
                np.zeros(3),
                (480, 360),
                distortion=[0.03, -0.01, 0.004, -0.002],
                model="fisheye",
                pixel_center="half",
            ),
            "charuco",
        ),
        (camera(), "checkerboard"),
    ],
    ids=["opencv", "fisheye", "checkerboard"],
)
def test_opencv_recovers_the_camera_from_rendered_images(given: raycam.Camera, board: str) -> None:
    found = raycam.selfcheck(given, views=12, samples=9, board=board)
    assert found.corners > 12 * 20
    assert found.detected.rms < 0.12
    assert found.detected.focal_error < 2e-3
    assert found.detected.center_error < 1.0
    assert found.detected.picture_error < 0.8
    assert found.detector_bias < 0.02  # an error of half a pixel would be detected
    assert found.picture_largest < 1e-6
    assert found.cause == "detector"
    assert "the residual comes from the corner detector" in str(found)


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12, 14])
def test_opencv_recovers_the_camera_from_exact_projections(count: int) -> None:
    from raycam.calibration_check.check import _calibrate

    lens = [-0.2, 0.06, 1e-3, -5e-4, 0.02, 0.1, 0.02, 0.01, 1e-3, -2e-3, 5e-4, 1e-3, 0.01, -0.02][:count]
    given = camera(distortion=lens or None)
    target = Board()
    points, corners = [], []
    for place in target.cameras(given, 20):
        pixels, seen = place.project(target.corners)
        points.append(target.corners[seen])
        corners.append(pixels[seen])
    found = _calibrate(given, points, corners)
    assert found.rms < 1e-4  # OpenCV requires corners in float32
    assert found.picture_error < (2e-3 if count < 14 else 1e-2)
    assert found.focal_error < 1e-5


def test_image_shifted_by_half_a_pixel_is_reported_as_the_cause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    honest = sys.modules["raycam.calibration_check.check"].render

    def shifted(world: raycam.World, place: raycam.Camera, **options: Any) -> Any:
        k = place.K + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        return honest(world, raycam.Camera(k, place.R, place.C, place.size), **options)

    monkeypatch.setattr(sys.modules["raycam.calibration_check.check"], "render", shifted)
    found = raycam.selfcheck(camera(), views=4, samples=4)
    assert found.picture_largest == pytest.approx(0.5, abs=1e-6)
    assert found.detected.center_error > 0.3
    assert found.cause == "picture"


def test_board_corners_equal_those_of_opencv() -> None:
    import cv2

    target = Board()
    front = raycam.Camera([[60, 0, 0], [0, 60, 0], [0, 0, 1]], np.eye(3), [-1.0, -1.0, -1.0], (660, 540))
    picture = raycam.render(target.world, front, integrator="flat", samples=4, channels="color").to_srgb8()
    numbers, places = target.detect(np.ascontiguousarray(picture[..., 0]))
    assert len(numbers) == len(target.corners) == len(target._charuco.getChessboardCorners())
    np.testing.assert_allclose(places, front.project(target.corners[numbers])[0], atol=0.05)
    np.testing.assert_allclose(
        target._charuco.getChessboardCorners()[numbers], target.corners[numbers], atol=1e-6
    )
    assert cv2.__version__


def test_board_views_cover_the_whole_image() -> None:
    target, given = Board(), camera()
    pixels = np.concatenate([place.project(target.corners)[0] for place in target.cameras(given, 20)])
    inside = pixels[((pixels > 0) & (pixels < given.size)).all(axis=1)]
    cells = np.floor(inside / (np.array(given.size) / 6)).astype(int)
    assert len({tuple(cell) for cell in cells.tolist()}) >= 30  # the corners reach 30 of the image's 36 cells


def test_selfcheck_refuses_cameras_and_boards_without_an_opencv_equivalent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["OpenCV"]):
        raycam.selfcheck(camera(distortion=[0.5], model="fov"))
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["skew"]):
        raycam.selfcheck(camera(skew=1.0))
    with raises(raycam.SettingsError, code="invalid_value", mentions=["'dots'"]):
        raycam.selfcheck(camera(), board="dots")
    with raises(raycam.SettingsError, code="out_of_range", mentions=["views"]):
        raycam.selfcheck(camera(), views=2)
    monkeypatch.setitem(sys.modules, "cv2", None)
    with raises(raycam.SettingsError, code="missing_dependency"):
        raycam.selfcheck(camera())


def test_selfcheck_command_prints_the_comparison_and_writes_the_images(tmp_path: Any, capsys: Any) -> None:
    raycam.save_cameras(tmp_path / "c.yaml", camera(distortion=[-0.2, 0.06, 1e-3, -5e-4, 0.0]), "opencv")
    words = ["selfcheck", "--camera", str(tmp_path / "c.yaml"), "--views", "4", "--samples", "4"]
    assert cli.main([*words, "-o", str(tmp_path / "boards")]) == 0
    told = capsys.readouterr().out
    assert "OpenCV's RMS" in told
    assert "k1" in told
    assert len(list((tmp_path / "boards").glob("*.png"))) == 4
    assert cli.main(["selfcheck", "--camera", str(tmp_path / "none.yaml")]) == 1
