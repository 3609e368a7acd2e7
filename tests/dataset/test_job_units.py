"""Records of the units of a data set."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam
from raycam.dataset.job_units import read_record, record_name
from raycam.jobs import Job
from support.box_table import ring, table
from support.raises import raises


def write(folder: Path) -> None:
    raycam.dataset.write(table(), folder, "coco", cameras=ring(2), integrator="flat", samples=1)


def test_records_are_compressed_and_belong_to_the_job(tmp_path: Path) -> None:
    write(tmp_path)
    paths = [tmp_path / record_name(unit) for unit in range(2)]
    assert all("size" in read_record(path) or "image" in read_record(path) for path in paths)
    assert all(b'"' not in path.read_bytes()[:2] for path in paths)
    assert Job(tmp_path).verify() == {}


@pytest.mark.parametrize("damage", ["not compressed", "cut"])
def test_damaged_record_is_reported_with_its_path(tmp_path: Path, damage: str) -> None:
    write(tmp_path)
    path = tmp_path / record_name(1)
    data = path.read_bytes()
    path.write_bytes(
        b"{}".ljust(len(data)) if damage == "not compressed" else data[:20].ljust(len(data), b"\0")
    )
    with raises(raycam.JobError, code="damaged_job", mentions=[str(path)]):
        write(tmp_path)
