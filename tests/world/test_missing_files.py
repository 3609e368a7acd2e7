"""Errors of missing files."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam
from support.raises import raises


@pytest.mark.parametrize("address", ["https://example.com/a.glb", "s3://bucket/a.glb"])
def test_web_address_is_refused_with_a_remedy(address: str) -> None:
    for given in (address, Path(address)):
        with raises(FileNotFoundError, mentions=["download the file"]):
            raycam.load(given)


def test_missing_file_is_reported_with_the_nearest_names(tmp_path: Path) -> None:
    for name in ("room1.glb", "room2.glb", "room3.glb"):
        (tmp_path / name).write_bytes(b"")
    with raises(FileNotFoundError, mentions=["did you mean", ".glb, ", ".glb or "]):
        raycam.load(tmp_path / "room.glb")
    (tmp_path / "room1.glb").unlink()
    (tmp_path / "room2.glb").unlink()
    with raises(FileNotFoundError, mentions=[f"did you mean {tmp_path / 'room3.glb'}?"]):
        raycam.load(tmp_path / "room.glb")
