"""Bytes of .npz files."""

from __future__ import annotations

import io
import struct
import zipfile

import numpy as np
import pytest
from raycam.io.npz import npz_bytes

ARRAYS = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "name": np.array("x"), "n": np.array(3)}


@pytest.mark.parametrize("compressed", [False, True])
def test_written_npz_is_read_by_numpy(compressed: bool) -> None:
    with np.load(io.BytesIO(npz_bytes(ARRAYS, compressed=compressed))) as read:
        assert read.files == list(ARRAYS)
        for name, array in ARRAYS.items():
            assert np.array_equal(read[name], array)
            assert read[name].dtype == array.dtype


def test_npz_bytes_depend_only_on_the_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    first = npz_bytes(ARRAYS)
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert npz_bytes(ARRAYS) == first
    for member in zipfile.ZipFile(io.BytesIO(first)).infolist():
        assert (member.create_system, member.date_time[0], member.external_attr >> 16) == (3, 1980, 0o644)
    # The signature, version 2.0, no flags, stored, 1980-01-01 00:00: the local header of APPNOTE.TXT.
    assert first[:14] == struct.pack("<4s5H", b"PK\3\4", 20, 0, 0, 0, 33)
