"""Rotated, grey, transparent, 16-bit, damaged and missing photographs.

The pixels are compared with those read by other programs.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from PIL import Image, ImageOps
from raycam.io.oriented_photo import linear_pixels
from raycam.notices import collected
from raycam.photos.images import PhotoSource
from raycam.srgb import linear_from_srgb
from support.raises import notice_codes, raises

CAMERA = raycam.Camera.look_at([0, 0, 2], [0, 0, 0], up=[0, 1, 0], fov=60, size=(12, 8))


def colors(height: int = 8, width: int = 12) -> np.ndarray:
    return np.random.default_rng(2).integers(0, 256, (height, width, 3)).astype(np.uint8)


def linear(srgb: np.ndarray) -> np.ndarray:
    """Colours by IEC 61966-2-1."""
    return linear_from_srgb(srgb / np.iinfo(srgb.dtype).max)


def read(path: Path) -> np.ndarray:
    return linear_pixels(PhotoSource(path.parent, [path.name]).read(path.name, CAMERA))


@pytest.mark.parametrize("orientation", [2, 3, 4, 5, 6, 7, 8])
def test_exif_orientation_gives_a_notice_and_is_not_applied(tmp_path: Path, orientation: int) -> None:
    exif = Image.Exif()
    exif[274] = orientation
    Image.fromarray(colors()).save(tmp_path / "a.jpg", exif=exif, quality=95, subsampling=0)
    with collected() as notices:
        source = PhotoSource(tmp_path, ["a.jpg"])
        found = source.read("a.jpg", CAMERA)
        source.read("a.jpg", CAMERA)
    assert notice_codes(notices) == ["ignored_orientation"]
    assert "a.jpg" in str(notices[0])
    with Image.open(tmp_path / "a.jpg") as stored:  # Pillow does not rotate the photograph either
        np.testing.assert_allclose(linear_pixels(found)[..., :3], linear(np.asarray(stored)), atol=0.02)


@pytest.mark.parametrize("orientation", [5, 6, 7, 8])
def test_orientation_is_applied_if_the_size_equals_the_cameras_size_only_after_rotation(
    tmp_path: Path, orientation: int
) -> None:
    exif = Image.Exif()
    exif[274] = orientation
    Image.fromarray(colors(12, 8)).save(tmp_path / "a.jpg", exif=exif, quality=95, subsampling=0)
    with collected() as notices:
        found = read(tmp_path / "a.jpg")
    assert notice_codes(notices) == ["applied_orientation"]
    with Image.open(tmp_path / "a.jpg") as stored:
        turned = np.asarray(ImageOps.exif_transpose(stored))
    np.testing.assert_allclose(found[..., :3], linear(turned), atol=0.02)


def test_photograph_of_another_size_is_refused(tmp_path: Path) -> None:
    Image.fromarray(colors(16, 24)).save(tmp_path / "a.png")
    with raises(
        raycam.SettingsError, code="photograph_size", mentions=["a.png", "24 x 16", "12 x 8", "--size"]
    ):
        read(tmp_path / "a.png")


def test_photographs_with_16_bits_keep_their_precision(tmp_path: Path) -> None:
    deep = np.random.default_rng(0).integers(0, 65536, (8, 12, 3)).astype(np.uint16)
    cv2.imwrite(str(tmp_path / "a.png"), deep[..., ::-1])
    found = read(tmp_path / "a.png")
    np.testing.assert_allclose(found[..., :3], linear(deep), atol=8e-6)  # linear light in 16 bits
    np.testing.assert_array_equal(found[..., 3], 1)


@pytest.mark.parametrize("mode", ["L", "LA", "1", "I;16", "P"])
def test_grey_and_palette_photographs_are_read(tmp_path: Path, mode: str) -> None:
    if mode == "I;16":
        picture = Image.fromarray(np.random.default_rng(1).integers(0, 65536, (8, 12)).astype(np.uint16))
        expected = np.repeat(linear(np.asarray(picture))[..., None], 3, axis=2)
    else:
        picture = Image.fromarray(colors()).convert(mode)
        expected = linear(np.asarray(picture.convert("RGB")))
    picture.save(tmp_path / "a.png")
    np.testing.assert_allclose(read(tmp_path / "a.png")[..., :3], expected, atol=1e-5)


def test_alpha_is_opacity_and_does_not_change_the_colour(tmp_path: Path) -> None:
    given = np.dstack([colors(), np.random.default_rng(5).integers(0, 256, (8, 12)).astype(np.uint8)])
    Image.fromarray(given).save(tmp_path / "a.png")
    found = read(tmp_path / "a.png")
    np.testing.assert_allclose(found[..., 3], given[..., 3] / 255, atol=1e-6)
    np.testing.assert_allclose(found[..., :3], linear(given[..., :3]), atol=1e-5)


@pytest.mark.parametrize("damage", ["text", "empty", "cut"])
def test_damaged_photographs_are_refused_with_their_name(tmp_path: Path, damage: str) -> None:
    Image.fromarray(colors()).save(tmp_path / "a.png")
    whole = (tmp_path / "a.png").read_bytes()
    data = {"text": b"<html>404</html>", "empty": b"", "cut": whole[: len(whole) // 2]}[damage]
    (tmp_path / "a.png").write_bytes(data)
    with raises(raycam.FormatError, mentions=["a.png"]):
        read(tmp_path / "a.png")


def test_missing_files_are_counted_before_anything_is_read(tmp_path: Path) -> None:
    Image.fromarray(colors()).save(tmp_path / "0.png")
    names = [f"{i}.png" for i in range(6)]
    with raises(
        FileNotFoundError, code="file_not_found", mentions=["5 of 6", "1.png", "2.png", "3.png", tmp_path]
    ):
        PhotoSource(tmp_path, names)
    with raises(raycam.SettingsError, code="missing_photograph", mentions=["1 of 2", "b.png"]):
        PhotoSource({"a.png": colors()}, ["a.png", "b.png"])
    with raises(FileNotFoundError, code="file_not_found", mentions=["c.png"]):
        PhotoSource({"a.png": tmp_path / "c.png"}, ["a.png"])


@pytest.mark.parametrize("name", ["../secret.png", "/etc/passwd", "sub/../../secret.png"])
def test_photograph_names_outside_of_the_folder_are_refused(tmp_path: Path, name: str) -> None:
    Image.fromarray(colors()).save(tmp_path / "secret.png")
    (tmp_path / "photos").mkdir()
    with raises(raycam.SettingsError, code="outside_root", mentions=[name]):
        PhotoSource(tmp_path / "photos", [name])


def test_symbolic_links_outside_of_the_folder_are_refused(tmp_path: Path) -> None:
    Image.fromarray(colors()).save(tmp_path / "secret.png")
    (tmp_path / "photos").mkdir()
    os.symlink(tmp_path / "secret.png", tmp_path / "photos" / "a.png")
    with raises(raycam.SettingsError, code="outside_root", mentions=["a.png"]):
        PhotoSource(tmp_path / "photos", ["a.png"])
    os.symlink(tmp_path / "photos", tmp_path / "link")  # the folder itself may be a link
    Image.fromarray(colors()).save(tmp_path / "photos" / "b.png")
    PhotoSource(tmp_path / "link", ["b.png"])


DEEP = (colors().astype(np.uint16) * 257)[..., :1]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (colors(), linear(colors())),
        (colors()[..., 0], linear(colors()[..., :1]).repeat(3, 2)),
        (colors()[..., :1], linear(colors()[..., :1]).repeat(3, 2)),
        (DEEP, linear(DEEP).repeat(3, 2)),
        (colors().astype(np.float64) / 99, colors() / 99),
        (colors()[..., 0] > 99, (colors()[..., :1] > 99).repeat(3, 2).astype(float)),
    ],
    ids=["uint8", "grey", "one channel", "uint16", "linear", "bool"],
)
def test_array_dtype_determines_the_encoding(given: np.ndarray, expected: np.ndarray) -> None:
    found = PhotoSource({"a": given}, ["a"]).read("a", CAMERA)
    np.testing.assert_allclose(found[..., :3], expected, atol=1e-6)
    assert (found[..., 3] == 1).all()


@pytest.mark.parametrize("channels", [2, 4])
def test_last_channel_of_an_array_is_opacity(channels: int) -> None:
    given = np.dstack([colors(), colors()])[..., :channels]
    found = PhotoSource({"a": given}, ["a"]).read("a", CAMERA)
    np.testing.assert_allclose(found[..., 3], given[..., -1] / 255, atol=1e-6)


@pytest.mark.parametrize(
    ("given", "code"),
    [
        (np.zeros((8, 12, 5), np.uint8), "wrong_shape"),
        (np.zeros(8, np.uint8), "wrong_shape"),
        ([[1.0, 2.0], [3.0]], "wrong_shape"),
        (np.zeros((0, 12, 3), np.uint8), "wrong_shape"),
        (np.zeros((8, 12, 3), np.int64), "wrong_type"),
        (np.full((8, 12, 3), np.nan), "invalid_value"),
        (np.full((8, 12, 3), np.inf), "invalid_value"),
    ],
)
def test_arrays_of_wrong_shape_type_or_value_are_refused(given: Any, code: str) -> None:
    with raises(raycam.SettingsError, code=code, mentions=["photograph 'a'"]):
        PhotoSource({"a": given}, ["a"]).read("a", CAMERA)
