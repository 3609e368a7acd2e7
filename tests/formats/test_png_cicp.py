"""Code points of colour spaces in PNG files (cICP, PNG third edition)."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.texels import albedo_of


def png_with(points: tuple[int, int, int, int]) -> bytes:
    """A PNG file with a cICP chunk after its header."""
    stream = io.BytesIO()
    Image.fromarray(np.full((4, 4, 3), 90, np.uint8)).save(stream, "PNG")
    whole = stream.getvalue()
    chunk = b"cICP" + bytes(points)
    return whole[:33] + struct.pack(">I", 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + whole[33:]


@pytest.mark.parametrize(
    ("points", "names"),
    [
        ((9, 16, 0, 1), ["Rec. 2020", "PQ"]),
        ((9, 18, 0, 1), ["Rec. 2020", "HLG"]),
        ((12, 13, 0, 1), ["Display P3", "sRGB"]),
        ((1, 8, 0, 1), ["linear"]),
        ((1, 13, 0, 0), ["limited range"]),
        ((1, 13, 0, 1), []),
    ],
)
def test_unsupported_color_space_gives_a_notice(
    tmp_path: Path, points: tuple[int, int, int, int], names: list[str]
) -> None:
    (tmp_path / "a.png").write_bytes(png_with(points))
    found, notices = albedo_of(tmp_path / "a.png", (4, 4))
    np.testing.assert_allclose(found, ((90 / 255 + 0.055) / 1.055) ** 2.4, atol=1e-6)
    assert [notice.code for notice in notices] == (["ignored_color_profile"] if names else [])
    assert all(name in str(notices[0]) for name in names)
