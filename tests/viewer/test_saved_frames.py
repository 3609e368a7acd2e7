"""Frames read back from .npz files."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.saved_frames import load_frame


def test_frames_come_back(small_world: raycam.World, tmp_path: Path) -> None:
    frame = raycam.render(small_world, samples=1, channels="all", region=(4, 2, 20, 10))
    frame.save(tmp_path / "x.npz")
    back = load_frame(tmp_path / "x.npz")
    assert {name: array.tobytes() for name, array in back.items()} == {
        name: array.tobytes() for name, array in frame.items()
    }
    assert (back.size, back.region, back.camera) == (frame.size, frame.region, frame.camera)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    for text in (b"", b"PK\x03\x04 no", b"\x93NUMPY"):
        path.write_bytes(text)
        with pytest.raises(raycam.FormatError):
            load_frame(path)
    np.savez(path, other=np.zeros(3))
    with pytest.raises(raycam.FormatError, match="no frame"):
        load_frame(path)
    np.savez(path, depth=np.zeros((3, 4), np.float32), size=[4, 4], region=[0, 0, 4, 4])
    with pytest.raises(raycam.FormatError, match="depth is float32"):
        load_frame(path)
    np.savez(path, depth=np.array([[None]]), size=[1, 1], region=[0, 0, 1, 1])
    with pytest.raises(raycam.FormatError):
        load_frame(path)
    assert zipfile.is_zipfile(path)
