"""Text files in the encodings that editors write."""

from __future__ import annotations

import codecs
from pathlib import Path

import pytest
import raycam
from raycam.io.text_files import decode_text

TEXT = 'name = "ü"\nsize = 3\n'
ENCODED = {
    "utf-8": TEXT.encode(),
    "utf-8 with a byte order mark": codecs.BOM_UTF8 + TEXT.encode(),
    "little endian": codecs.BOM_UTF16_LE + TEXT.encode("utf-16-le"),
    "big endian": codecs.BOM_UTF16_BE + TEXT.encode("utf-16-be"),
    "windows": codecs.BOM_UTF8 + TEXT.replace("\n", "\r\n").encode(),
}


@pytest.mark.parametrize("name", ENCODED)
def test_decode_text_returns_the_same_text_for_every_encoding(name: str) -> None:
    assert decode_text(ENCODED[name]) == TEXT


def test_decode_text_raises_for_invalid_bytes() -> None:
    with pytest.raises(UnicodeDecodeError):
        decode_text(b"\xff\xfa")
    assert decode_text(b"a\xff", "replace") == "a\ufffd"


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_recipes_and_worlds_with_robots_are_read_in_every_encoding(tmp_path: Path, encoding: str) -> None:
    robot = '<robot name="r"><link name="a"><visual><geometry><box size="1 1 1"/></geometry></visual></link></robot>'
    (tmp_path / "r.urdf").write_text(robot)
    recipe, world = tmp_path / "recipe.toml", tmp_path / "world.toml"
    recipe.write_bytes('[[object]]\nname = "ü"\nbox = { size = [1, 1, 1] }\n'.encode(encoding))
    world.write_bytes('[[robot]]\nname = "ü"\nfile = "r.urdf"\n'.encode(encoding))
    assert raycam.sample(recipe).objects[0].name == "ü"
    assert raycam.load(world).objects[0].name == "ü/a"
