"""Frames over backgrounds: colours, images and arrays, with the studio's shadow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import raises


@pytest.fixture(scope="module")
def clear() -> raycam.Frame:
    world = raycam.World()
    world.add_object(sphere={}, color="tomato")
    camera = world.default_camera((80, 60))
    return raycam.render(world, camera, transparent_background=True, samples=4)


def test_over_accepts_a_color(clear: raycam.Frame) -> None:
    frame = clear.over("skyblue")
    np.testing.assert_array_equal(frame.to_srgb8()[0, 0], [135, 206, 235])
    alpha = clear["alpha"][..., None]
    linear = frame["color"][0, 0]
    np.testing.assert_allclose(frame["color"], clear["color"] + (1 - alpha) * linear, atol=1e-6)
    assert not frame.transparent
    assert "alpha" not in frame
    np.testing.assert_array_equal(frame["depth"], clear["depth"])


def test_over_accepts_an_array(clear: raycam.Frame) -> None:
    photo = np.random.default_rng(1).integers(0, 256, (60, 80, 3), np.uint8)
    seen = clear.over(photo).to_srgb8()
    sky = clear["alpha"] == 0
    np.testing.assert_array_equal(seen[sky], photo[sky])
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["[60", "80", "3]"]):
        clear.over(photo[1:])


@pytest.mark.parametrize("ending", ["png", "jpg"])
def test_over_keeps_an_image_of_the_same_size(clear: raycam.Frame, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"photo.{ending}"
    photo = np.zeros((60, 80, 3), np.uint8)
    photo[..., 0], photo[..., 2] = np.arange(80) * 3, np.arange(60)[:, None] * 4
    Image.fromarray(photo).save(path)
    expected = np.asarray(Image.open(path).convert("RGB"))
    sky = clear["alpha"] == 0
    seen = clear.over(path).to_srgb8()
    difference = np.abs(seen[sky].astype(int) - expected[sky])
    # Decoders enlarge the chroma channels by different methods.
    assert difference.max() <= (0 if ending == "png" else 12)
    assert difference.mean() < 1


@pytest.mark.parametrize("size", [(160, 60), (80, 300), (40, 15)])
def test_background_image_is_scaled_and_cropped_to_cover_the_frame(
    clear: raycam.Frame, size: tuple[int, int], tmp_path: Path
) -> None:
    path = tmp_path / "halves.png"
    photo = np.zeros((size[1], size[0], 3), np.uint8)
    photo[:, size[0] // 2 :] = 255
    Image.fromarray(photo).save(path)
    seen = clear.over(str(path)).to_srgb8()
    np.testing.assert_array_equal(seen[0, :36], 0)
    np.testing.assert_array_equal(seen[0, 44:], 255)


def test_invalid_backgrounds_of_over_are_refused(clear: raycam.Frame, tmp_path: Path) -> None:
    with raises(raycam.SettingsError, code="wrong_type"):
        clear.over("blu")
    with pytest.raises(FileNotFoundError):
        clear.over(tmp_path / "nothing.png")
    (tmp_path / "not.png").write_bytes(b"hello")
    with raises(raycam.FormatError, code="unknown_format", mentions=["PNG", "JPEG"]):
        clear.over(tmp_path / "not.png")
    with raises(raycam.SettingsError, code="missing_value"):
        clear.over("white").over("black")
