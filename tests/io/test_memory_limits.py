"""Memory limits on simulated machines."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from raycam import errors
from raycam.io import memory_limits
from support.raises import raises

GIB = 1 << 30


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with 16 GiB, of which 10 GiB are free."""
    monkeypatch.setattr(memory_limits, "CGROUP", tmp_path / "cgroup")
    monkeypatch.setattr(memory_limits, "PROC", tmp_path / "proc")
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 16 * GIB // 4096}.get)
    write(tmp_path / "proc/meminfo", f"MemTotal: {16 << 20} kB\nMemAvailable: {10 << 20} kB\n")
    return tmp_path


def write(path: Path, text: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{text}\n")


def group(folder: Path, first: bool = False, **values: object) -> None:
    """Writes the files of a control group of version 1 or 2.

    The files contain `limit`, `used`, and lines of statistics.
    """
    limit, used = (
        ("memory.limit_in_bytes", "memory.usage_in_bytes") if first else ("memory.max", "memory.current")
    )
    for name, file in (("limit", limit), ("used", used), ("high", "memory.high")):
        if name in values:
            write(folder / file, values.pop(name))
    if values:
        write(folder / "memory.stat", "\n".join(f"{name} {value}" for name, value in values.items()))


def test_machine_without_control_groups_is_limited_by_its_memory(machine: Path) -> None:
    assert memory_limits.limits() == [(16 * GIB, 6 * GIB)]
    assert (memory_limits.available_bytes(), memory_limits.available_bytes(0.5)) == (10 * GIB, 2 * GIB)


def test_parent_control_groups_reduce_free_memory_and_page_caches_do_not(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "0::/slice/job/task")
    slice = machine / "cgroup/slice"
    group(slice / "job/task", limit="max", used=GIB)
    group(slice / "job", limit=4 * GIB, used=3 * GIB, anon=1, inactive_file=GIB // 2, active_file=GIB // 2)
    group(slice, limit=8 * GIB, used=5 * GIB)
    assert memory_limits.limits() == [(16 * GIB, 6 * GIB), (4 * GIB, 2 * GIB), (8 * GIB, 5 * GIB)]
    assert (memory_limits.available_bytes(), memory_limits.available_bytes(0.5)) == (2 * GIB, -GIB)


def test_control_group_with_the_least_free_memory_determines_the_limit(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "0::/job/task")
    group(machine / "cgroup/job", limit=8 * GIB, used=8 * GIB - 1)
    group(machine / "cgroup/job/task", limit=4 * GIB, used=GIB)
    assert memory_limits.available_bytes() == 1
    # A limit above the machine's memory has no effect, and memory used by other processes counts.
    group(machine / "cgroup/job", limit=64 * GIB, used=63 * GIB)
    write(machine / "proc/meminfo", f"MemAvailable: {1 << 20} kB")
    assert memory_limits.available_bytes() == GIB


def test_memory_high_counts_as_a_limit(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "0::/job")
    group(machine / "cgroup/job", limit=8 * GIB, high=3 * GIB, used=GIB)
    assert memory_limits.available_bytes() == 2 * GIB
    group(machine / "cgroup/job", limit="max", high="max", used=GIB)
    assert memory_limits.available_bytes() == 10 * GIB


def test_limits_inside_a_container_are_found(machine: Path) -> None:
    # In a cgroup namespace, the root folder of version 2 is the container's group. Without a namespace, the
    # group's path does not exist in the container.
    for path in ("/", "/system.slice/docker-1234.scope", "/../../pod/1"):
        write(machine / "proc/self/cgroup", f"0::{path}")
        group(machine / "cgroup", limit=2 * GIB, used=GIB)
        assert memory_limits.available_bytes() == GIB, path


def test_cgroup_version_1_limits_are_read(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "4:cpu,cpuacct:/a\n7:memory:/batch/1\n1:name=systemd:/\n0::/\n")
    batch = machine / "cgroup/memory/batch"
    group(batch / "1", first=True, limit=2 * GIB, used=GIB, inactive_file=7, total_inactive_file=GIB // 2)
    group(batch, first=True, limit=9223372036854771712, used=GIB)
    assert memory_limits.available_bytes() == 3 * GIB // 2
    # The limit of a pod is visible inside its containers only through this file.
    container = machine / "cgroup/memory"
    group(container, first=True, limit=9223372036854771712, used=GIB, hierarchical_memory_limit=2 * GIB)
    write(machine / "proc/self/cgroup", "7:memory:/kubepods/pod1/c2")
    assert memory_limits.available_bytes() == GIB


def test_usage_beyond_the_limit_gives_a_negative_amount(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "0::/job")
    group(machine / "cgroup/job", limit=GIB, used=GIB)
    assert memory_limits.available_bytes(0.9) < 0
    group(machine / "cgroup/job", limit=0, used=GIB)
    assert memory_limits.available_bytes(0.9) == -GIB


def test_malformed_limit_files_are_ignored(machine: Path) -> None:
    write(machine / "proc/self/cgroup", "nonsense\n0::/job\n:")
    write(machine / "cgroup/job/memory.max", "lots")
    write(machine / "cgroup/job/memory.current", "")
    assert memory_limits.limits() == [(16 * GIB, 6 * GIB)]
    (machine / "proc/meminfo").unlink()
    assert memory_limits.limits() == [(16 * GIB, 0)]


def test_peak_memory_of_this_process_is_plausible() -> None:
    before = memory_limits.peak_bytes(os.getpid())
    block = bytearray(64 << 20)
    assert memory_limits.peak_bytes(os.getpid()) >= len(block)
    assert before > 1 << 20
    assert memory_limits.peak_bytes(1 << 30) == 0
    assert memory_limits.available_bytes() > 0
    assert all(0 < used < limit for limit, used in memory_limits.limits())


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (512, 512),
        ("512", 512),
        ("1 KiB", 1024),
        ("1kB", 1000),
        ("1.5 MiB", 3 << 19),
        (" 2GB ", 2 * 10**9),
        ("3tib", 3 << 40),
    ],
)
def test_memory_sizes_are_parsed_in_common_notations(text: int | str, count: int) -> None:
    assert memory_limits.parse_size("limit", text) == count


@pytest.mark.parametrize("text", ["", "GiB", "-1", "1 XB", "1e9", "1 M", 0, True, "99999999 TiB"])
def test_invalid_memory_size_raises_with_the_argument_name(text: int | str) -> None:
    with raises(errors.SettingsError, code="wrong_type", mentions=["limit"]):
        memory_limits.parse_size("limit", text)


VM_STAT = """Mach Virtual Memory Statistics: (page size of 16384 bytes)
Pages free:                                5000.
Pages active:                            300000.
Pages inactive:                          200000.
Pages speculative:                         1000.
Pages throttled:                              0.
"""


def test_available_memory_on_macos_is_read_from_vm_stat(monkeypatch: pytest.MonkeyPatch) -> None:
    assert memory_limits.mac_available(VM_STAT) == 206_000 * 16384
    assert memory_limits.mac_available("") == 0
    monkeypatch.setattr(memory_limits.sys, "platform", "darwin")
    monkeypatch.setattr(
        memory_limits, "_command_output", lambda *command: VM_STAT if command[0] == "vm_stat" else "4096\n"
    )
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    assert memory_limits.limits() == [(total, max(0, total - 206_000 * 16384))]
    assert memory_limits.peak_bytes(1) == 4096 * 1024


def test_available_memory_on_windows_uses_its_job_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_limits.sys, "platform", "win32")
    monkeypatch.setattr(memory_limits.windows_memory, "limit_and_used", lambda: (8 * GIB, 5 * GIB))
    assert memory_limits.available_bytes() == 3 * GIB
