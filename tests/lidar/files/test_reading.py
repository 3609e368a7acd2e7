"""Damaged calibrations raise a `LidarError` or are read; nothing else happens."""

from __future__ import annotations

import io
import random
from pathlib import Path

import numpy as np
import pytest
import raycam
from lidar.files.test_calibrations import TABLE, hesai_csv, ouster, velodyne_xml, velodyne_yaml


def arrays(compressed: bool) -> bytes:
    stream = io.BytesIO()
    save = np.savez_compressed if compressed else np.savez
    save(stream, directions=np.eye(3), times=[0, 0.1, 0.2], rings=np.arange(3))
    return stream.getvalue()


def single() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.eye(3))
    return stream.getvalue()


FILES = {
    "a.json": ouster().encode(),
    "a.yaml": velodyne_yaml().encode(),
    "a.xml": velodyne_xml().encode(),
    "hesai.csv": hesai_csv().encode(),
    "table.csv": TABLE.encode(),
    "a.npy": single(),
    "a.npz": arrays(False),
    "b.npz": arrays(True),
}
SPLICES = [
    b"nan",
    b"1e999",
    b"-",
    b"{",
    b"]",
    b"\x00",
    b"\xff",
    b"999999999999999999999",
    b",",
    b"\n",
    b'"',
    b"<",
]


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Cuts, doubles, overwrites or splices bytes."""
    found = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at, size = rng.randrange(len(found) + 1), rng.randint(1, 12)
        kind = rng.randrange(4)
        if kind == 0:
            del found[at : at + size]
        elif kind == 1:
            found[at:at] = found[at : at + size]
        elif kind == 2 and at < len(found):
            found[at] = rng.randrange(256)
        else:
            found[at:at] = rng.choice(SPLICES)
    return bytes(found[: rng.randrange(len(found) + 1)] if rng.random() < 0.1 else found)


@pytest.mark.parametrize("name", list(FILES))
def test_damaged_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    rng = random.Random(f"fuzz {name}")
    path = tmp_path / name
    faults: list[raycam.LidarError] = []
    for _ in range(150):
        path.write_bytes(damaged(FILES[name], rng))
        try:
            pattern = raycam.load_lidar(path).pattern()
        except raycam.LidarError as fault:
            faults.append(fault)
        else:
            assert np.isfinite(pattern.directions).all()
            assert np.isfinite(pattern.times).all()
    assert len(faults) > 20
    assert all(name in str(fault) and fault.code != "internal" for fault in faults)
