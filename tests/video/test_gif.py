"""GIF files and PNG images written without PyAV, read back by Pillow."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import _core
from raycam.cli import main
from raycam.video.gif import GifWriter
from raycam.video.png import decode_png
from support.raises import raises

RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize("size", [(1, 1), (7, 5), (64, 48), (130, 90)])
@pytest.mark.parametrize("kind", ["even", "gradient", "noise"])
def test_decoded_gif_equals_the_images(size: tuple[int, int], kind: str) -> None:
    width, height = size
    pictures = []
    for number in range(3):
        picture = np.full((height, width, 3), 40 * number, np.uint8)
        if kind == "gradient":
            picture[..., 0] = np.linspace(0, 255, width).astype(np.uint8)
            picture[..., 1] = np.linspace(0, 200, height).astype(np.uint8)[:, None]
        elif kind == "noise":
            picture = RANDOM.integers(0, 256, (height, width, 3), np.uint8)
        pictures.append(picture)
    writer = GifWriter(size, 12)
    for number, picture in enumerate(pictures):
        writer.add(number, picture)
    with Image.open(io.BytesIO(writer.finish())) as image:
        assert (image.size, image.n_frames, image.info["loop"]) == (size, 3, 0)
        delays = []
        for number, picture in enumerate(pictures):
            image.seek(number)
            delays.append(image.info["duration"])
            seen = np.asarray(image.convert("RGB")).astype(int)
            assert np.abs(seen - picture).mean() < {"even": 5, "gradient": 8, "noise": 40}[kind]
        assert sum(delays) == 250


@pytest.mark.parametrize("components", [3, 4])
def test_png_encoder_output_is_read_by_pillow(components: int) -> None:
    smooth = np.add.outer(np.arange(40), np.arange(50) * 3)[..., None] + np.arange(components) * 9
    for picture in (
        smooth % 256,
        RANDOM.integers(0, 256, (40, 50, components)),
        np.zeros((1, 1, components)),
    ):
        picture = picture.astype(np.uint8)
        np.testing.assert_array_equal(decode_png(_core.encode_png(picture)), picture)


@pytest.mark.parametrize("kind", [0, 1, 2, 3, 4])
def test_every_png_filter_is_decoded(kind: int) -> None:
    import struct
    import zlib

    rows = RANDOM.integers(0, 256, (6, 13), np.uint8)
    rows[:, 0] = kind
    parts = {
        b"IHDR": struct.pack(">IIBBBBB", 4, 6, 8, 2, 0, 0, 0),
        b"IDAT": zlib.compress(rows.tobytes()),
        b"IEND": b"",
    }
    data = b"\x89PNG\r\n\x1a\n"
    for name, body in parts.items():
        data += struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    with Image.open(io.BytesIO(data)) as image:
        np.testing.assert_array_equal(decode_png(data), np.asarray(image))
    with raises(raycam.FormatError, code="wrong_format", mentions=["PNG"]):
        decode_png(b"GIF")


def test_gif_is_written_without_pyav(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.chdir(tmp_path)
    Path("box.toml").write_text(
        "[camera]\nsize=[32,24]\nfov=40\nlocation=[3,-4,2]\ntarget=[0,0,0]\n[[object]]\nbox={}\n"
    )
    assert main(["video", "box.toml", "-o", "a.gif", "--frames", "0:3", "--samples", "1"]) == 0
    with Image.open("a.gif") as image:
        assert (image.size, image.n_frames) == ((32, 24), 3)
        assert len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)) > 3
    assert main(["video", "box.toml", "-o", "a.mp4", "--samples", "1"]) == 2
    assert "pip install 'raycam[video]', or write a .gif file" in capsys.readouterr().err
