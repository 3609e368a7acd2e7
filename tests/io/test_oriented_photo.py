"""Photographs with an EXIF orientation, compared with OpenCV's imread."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.io.oriented_photo import linear_pixels, read_oriented
from support.raises import raises

STORED = np.add.outer(np.arange(6) * 30, np.arange(10) * 9)[..., None].astype("u1") + np.uint8([0, 9, 20])
"""Smooth pixels of 10 columns and 6 rows as they are stored, which differ after every turn."""


def photo(folder: Path, orientation: int, ending: str = ".png") -> Path:
    exif = Image.Exif()
    exif[274] = orientation
    path = folder / f"{orientation}{ending}"
    Image.fromarray(STORED).save(path, exif=exif, **({"quality": 95} if ending == ".jpg" else {}))
    return path


def srgb(linear: np.ndarray) -> np.ndarray:
    linear = linear[..., :3].astype(np.float64)
    return np.round(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))


@pytest.mark.parametrize("ending", [".png", ".jpg", ".webp", ".tif"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_applied_orientation_equals_opencv(tmp_path: Path, orientation: int, ending: str) -> None:
    path = photo(tmp_path, orientation, ending)
    # OpenCV does not rotate TIFF files.
    judged = photo(tmp_path, orientation) if ending == ".tif" else path
    judge = cv2.imread(str(judged))
    assert judge is not None
    expected = judge[..., ::-1].astype(np.float64)
    pixels, notices = read_oriented(path, None, "apply")
    assert notices == []
    # OpenCV and raycam use different decoders for JPEG and WebP.
    assert np.abs(srgb(linear_pixels(pixels)) - expected).max() <= (8 if ending in (".jpg", ".webp") else 0)
    stored, notices = read_oriented(path, None, "ignore")
    assert notices == []
    assert stored.shape[:2] == (6, 10)


@pytest.mark.parametrize(
    ("orientation", "size", "turned", "code"),
    [
        (1, (10, 6), False, None),
        (6, (6, 10), True, "applied_orientation"),
        (8, (60, 100), True, "applied_orientation"),
        (6, (10, 6), False, "ignored_orientation"),
        (3, (10, 6), False, "ignored_orientation"),
        (6, (7, 7), False, "ignored_orientation"),
        (6, None, False, "ignored_orientation"),
    ],
)
def test_photo_is_rotated_if_it_fits_the_camera_only_after_rotation(
    tmp_path: Path, orientation: int, size: tuple[int, int] | None, turned: bool, code: str | None
) -> None:
    path = photo(tmp_path, orientation)
    pixels, notices = read_oriented(path, size)
    assert pixels.shape[:2] == ((10, 6) if turned else (6, 10))
    assert [notice.code for notice in notices] == ([code] if code else [])
    assert all(notice.subjects == (str(path),) for notice in notices)


def test_background_shows_the_photo_that_fits_the_camera(tmp_path: Path) -> None:
    path = photo(tmp_path, 6)
    upright = cv2.imread(str(path))[..., ::-1]
    camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(6, 10))
    world = raycam.World()
    world.add_object(box={"size": 0.001}, location=[50, 0, 0])
    with pytest.warns(raycam.Notice) as caught:
        frame = raycam.render(world, camera, background=str(path), integrator="flat")
    assert "applied_orientation" in [getattr(warning.message, "code", "") for warning in caught]
    np.testing.assert_array_equal(srgb(frame["color"]), upright)


def test_orientation_of_a_background_can_be_chosen(tmp_path: Path) -> None:
    path = photo(tmp_path, 3)
    upright = cv2.imread(str(path))[..., ::-1]
    camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(10, 6))
    world = raycam.World()
    world.add_object(box={"size": 0.001}, location=[50, 0, 0])
    for orientation, expected in (("apply", upright), ("ignore", STORED)):
        background = raycam.Background(str(path), orientation=orientation)  # type: ignore[arg-type]
        with pytest.warns(raycam.Notice):
            frame = raycam.render(world, camera, background=background, integrator="flat")
        np.testing.assert_array_equal(srgb(frame["color"]), expected)
    with raises(raycam.CameraError, code="conflicting_values"):
        camera.with_background(raycam.Background(str(path), orientation="apply"))
    with raises(raycam.CameraError, code="unknown_name"):
        raycam.Background(str(path), orientation="turn")  # type: ignore[arg-type]
