"""Every video codec: lossless images, opacity and equal bytes; read back by FFmpeg."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from raycam.errors import SettingsError
from raycam.video.codecs import CODECS, codec_of, open_encoder
from support.raises import raises

SIZE = (64, 48)


def decoded(path: Path, components: int) -> list[np.ndarray]:
    """The images of a file.

    Google's VP9 decoder is used, because FFmpeg's own decoder does not support opacity.
    """
    kind = "rgba" if components == 4 else "rgb24"
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        if (stream.codec_context.name, components) != ("vp9", 4):
            return [frame.to_ndarray(format=kind) for frame in file.decode(stream)]
        codec = av.CodecContext.create("libvpx-vp9", "r")
        codec.extradata = stream.codec_context.extradata
        frames = [
            frame for packet in file.demux(stream) for frame in codec.decode(packet if packet.size else None)
        ]
        return [frame.to_ndarray(format=kind) for frame in frames]


@pytest.mark.parametrize(
    "row", CODECS, ids=lambda row: f"{row[0][1:]}{'-lossless' * row[1]}{'-alpha' * row[2]}"
)
def test_decoded_gif_equals_the_images(tmp_path: Path, row: tuple[str, bool, bool]) -> None:
    ending, lossless, alpha = row
    rng = np.random.default_rng(3)
    components = 4 if alpha else 3
    pictures = [rng.integers(0, 256, (*SIZE[::-1], components), np.uint8) for _ in range(5)]
    if not lossless:  # colour patches, whose centres survive chroma subsampling and quantisation
        patches = rng.integers(0, 256, (3, 4, components), np.uint8)
        pictures = [np.kron(np.roll(patches, i, 1), np.ones((16, 16, 1), np.uint8)) for i in range(5)]
    for name in ("one", "two"):
        with open_encoder(tmp_path / (name + ending), SIZE, 12.5, CODECS[row]) as add:
            for number, picture in enumerate(pictures):
                add(number, picture)
    one = tmp_path / ("one" + ending)
    back = decoded(one, components)
    if lossless:
        np.testing.assert_array_equal(back, pictures)
    else:
        off = np.abs(np.array(back, int) - pictures)[:, 4::16, 4::16]
        assert len(back) == 5
        assert off.max() <= 12
        assert off[..., :3].mean() < 4
        assert off[..., 3:].size == 0 or off[..., 3:].mean() < 1.5
    assert one.read_bytes() == (tmp_path / ("two" + ending)).read_bytes()
    with av.open(str(one)) as file:
        stream = file.streams.video[0]
        codec = stream.codec_context
        assert float(stream.average_rate) == 12.5
        # sRGB's curve; BT.709's matrix and limited range, or RGB (ITU-T H.273)
        assert codec.color_trc == 13
        assert codec.colorspace == (1 if "yuv" in CODECS[row].pixels else 0)


def test_unsupported_codec_options_are_refused_with_the_supported_formats() -> None:
    with raises(SettingsError, code="cannot_write", mentions=[".mp4", ".mov", ".mkv", ".webm"]):
        codec_of(".mp4", lossless=False, alpha=True)
    with raises(SettingsError, code="cannot_write", mentions=[".webm", ".mov", ".mkv"]):
        codec_of(".webm", lossless=True, alpha=True)
    assert codec_of(".mkv", lossless=False, alpha=True).encoder == "ffv1"


@pytest.mark.parametrize(("ending", "name"), [(".mp4", "an MP4"), (".webm", "a WebM")])
def test_subsampled_chroma_requires_even_sizes(tmp_path: Path, ending: str, name: str) -> None:
    codec = codec_of(ending, lossless=False, alpha=False)
    with raises(SettingsError, code="out_of_range", mentions=[name, "33 x 21", "34 x 22"]):
        open_encoder(tmp_path / f"a{ending}", (33, 21), 10, codec).__enter__()
    for kept in (".mov", ".mkv"):
        with open_encoder(
            tmp_path / f"a{kept}", (33, 21), 10, codec_of(kept, lossless=True, alpha=False)
        ) as add:
            add(0, np.zeros((21, 33, 3), np.uint8))
