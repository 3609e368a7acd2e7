"""Images of depth, normals, ids and other channels, and JPEG files, read back by Pillow."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.render.channel_picture import channel_picture
from raycam.render.frame import CHANNELS
from support.raises import raises

UNIFORM = (
    *("error", "category", "shadow", "transmittance"),
    *("indirect", "specular", "volume", "metallic", "projector_uv"),
)
"""Channels that have one value everywhere in the image."""


@pytest.fixture(scope="module")
def frame() -> raycam.Frame:
    world = raycam.World()
    world.add_object(sphere={}, color="tomato")
    world.add_object(plane={"size": 4}, location=[0, 0, -1])
    world.add_light("sky", radiance=0.7)
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(61, 43), fov=50)
    return raycam.render(world, camera, samples=4, channels="all")


@pytest.mark.parametrize("name", CHANNELS)
@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_every_channel_is_written_as_an_image(
    frame: raycam.Frame, name: str, ending: str, tmp_path: Path
) -> None:
    path = tmp_path / f"x{ending}"
    frame.save(path, channel=name)
    with Image.open(path) as image:
        assert image.size == (61, 43)
        pixels = np.asarray(image.convert("RGB")).astype(int)
    shown = frame.to_srgb8() if name == "color" else channel_picture(name, frame[name])
    off = np.abs(pixels - shown.astype(int))
    assert off.max() == 0 if ending == ".png" else off.mean() < 12
    if name not in ("color", *UNIFORM):
        assert pixels.std() > 5


def test_frame_with_one_channel_is_saved_without_a_channel_argument(
    frame: raycam.Frame, tmp_path: Path
) -> None:
    one = raycam.Frame({"depth": frame["depth"]}, camera=None, size=(61, 43))
    one.save(tmp_path / "depth.png")
    two = raycam.Frame({"depth": frame["depth"], "uv": frame["uv"]}, camera=None, size=(61, 43))
    with raises(raycam.SettingsError, code="cannot_write", mentions=["both.png"]):
        two.save(tmp_path / "both.png")


def test_depth_image_maps_near_to_yellow_and_far_to_violet(frame: raycam.Frame) -> None:
    depth = frame["depth"]
    shown = channel_picture("depth", depth).astype(int).sum(axis=2)
    seen = np.isfinite(depth)
    assert (shown[~seen] == 0).all()
    assert (channel_picture("depth", depth)[depth == depth[seen].min()][0] == [0xFD, 0xE7, 0x25]).all()
    assert (channel_picture("depth", depth)[depth == depth[seen].max()][0] == [0x44, 0x01, 0x54]).all()


def test_normal_image_uses_the_encoding_of_normal_maps(frame: raycam.Frame) -> None:
    shown = channel_picture("normal", frame["normal"])
    seen = frame["normal"].any(axis=2)
    assert np.abs(shown[seen] / 255 * 2 - 1 - frame["normal"][seen]).max() < 1 / 254
    assert (shown[~seen] == 0).all()


def test_id_has_the_same_color_in_every_image() -> None:
    ids = np.arange(-1, 300, dtype=np.int32)
    together = channel_picture("instance", ids[np.newaxis])[0]
    for number in (0, 1, 7, 299):
        alone = channel_picture("instance", np.full((2, 2), number, np.int32))
        assert (alone == together[number + 1]).all()
    assert (together[0] == 0).all()
    assert len(np.unique(together[1:], axis=0)) > 290
    assert together[1:].max(axis=1).min() > 100


def test_viridis_equals_matplotlib() -> None:
    colormaps = pytest.importorskip("matplotlib").colormaps
    values = np.linspace(0, 1, 256, dtype=np.float32)[np.newaxis]
    shown = channel_picture("coverage", values)[0] / 255
    assert np.abs(shown - colormaps["viridis"](values[0])[:, :3]).max() < 0.02


def test_jpeg_files_are_baseline(frame: raycam.Frame) -> None:
    with Image.open(io.BytesIO(frame.to_jpeg())) as image:
        assert image.format == "JPEG"
        assert "progressive" not in image.info
