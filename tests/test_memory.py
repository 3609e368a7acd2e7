"""Memory limits, on made-up machines."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from raycam import memory

GIB = 1 << 30


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """16 GiB, 10 of them free."""
    monkeypatch.setattr(memory, "CGROUP", tmp_path / "cgroup")
    monkeypatch.setattr(memory, "PROC", tmp_path / "proc")
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 16 * GIB // 4096}.get)
    write(tmp_path / "proc/meminfo", f"MemTotal: {16 << 20} kB\nMemAvailable: {10 << 20} kB\n")
    return tmp_path


def write(path: Path, text: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{text}\n")


def test_a_bare_machine(machine: Path) -> None:
    assert (memory.limit(), memory.used()) == (16 * GIB, 6 * GIB)


def test_the_smallest_group_around_counts(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "0::/slice/job/task")
    write(machine / "cgroup/slice/job/task/memory.max", "max")
    write(machine / "cgroup/slice/job/task/memory.current", GIB)
    write(machine / "cgroup/slice/job/memory.max", 4 * GIB)
    write(machine / "cgroup/slice/job/memory.current", 3 * GIB)
    write(machine / "cgroup/slice/job/memory.stat", f"anon 1\ninactive_file {GIB}")
    write(machine / "cgroup/slice/memory.max", 8 * GIB)
    write(machine / "cgroup/slice/memory.current", 7 * GIB)
    assert (memory.limit(), memory.used()) == (4 * GIB, 2 * GIB)


def test_groups_of_the_first_version(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "4:cpu,cpuacct:/a\n7:memory:/batch/1")
    folder = machine / "cgroup/memory/batch/1"
    write(folder / "memory.limit_in_bytes", 2 * GIB)
    write(folder / "memory.usage_in_bytes", GIB)
    write(folder / "memory.stat", f"total_inactive_file {GIB // 2}")
    write(machine / "cgroup/memory/batch/memory.limit_in_bytes", 9223372036854771712)
    write(machine / "cgroup/memory/batch/memory.usage_in_bytes", GIB)
    assert (memory.limit(), memory.used()) == (2 * GIB, GIB // 2)


def test_the_peak_of_this_process_is_about_right() -> None:
    before = memory.peak(os.getpid())
    block = bytearray(64 << 20)
    assert memory.peak(os.getpid()) >= len(block)
    assert before > 1 << 20
    assert memory.peak(1 << 30) == 0
    assert 0 < memory.used() < memory.limit()
