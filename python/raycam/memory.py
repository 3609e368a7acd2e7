"""How much memory there is for this process: the machine's, or what its control groups allow."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["limit", "peak", "used"]

CGROUP = Path("/sys/fs/cgroup")
PROC = Path("/proc")


def limit() -> int:
    """Bytes that this process and its children may use together.

    The smallest of the machine's memory and the limits of its control groups and all above them (Linux, versions 1
    and 2, as containers and batch systems set them).
    """
    return min(value for value, _ in _bounds())


def used() -> int:
    """Bytes in use of what `limit` is about, by everybody who shares it; file caches, which make room, not counted."""
    return min(_bounds())[1]


def peak(pid: int) -> int:
    """The most bytes that a process has had in memory; 0 where nobody says."""
    return _line(PROC / str(pid) / "status", "VmHWM:") * 1024


def _bounds() -> list[tuple[int, int]]:
    """(limit, used) of the machine and of every control group around this process."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 1 << 62
    available = _line(PROC / "meminfo", "MemAvailable:") * 1024
    found = [(total, max(0, total - available) if available else 0)]
    for folder, names in _groups():
        top, now, cache = names
        for path in [folder, *folder.parents]:
            value, usage = _number(path / top), _number(path / now)
            if value is not None and usage is not None and value < total:
                found.append((value, max(0, usage - _line(path / "memory.stat", cache))))
            if path == CGROUP:
                break
    return found


def _groups() -> list[tuple[Path, tuple[str, str, str]]]:
    """The folders of this process's control groups that limit memory, and what their files are called."""
    second = ("memory.max", "memory.current", "inactive_file")
    first = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
    try:
        lines = (PROC / "self" / "cgroup").read_text().splitlines()
    except OSError:
        return []
    groups = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if not controllers:
            groups.append((CGROUP / path.lstrip("/"), second))
        elif "memory" in controllers.split(","):
            groups.append((CGROUP / "memory" / path.lstrip("/"), first))
    return groups


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):  # "max" is no limit
        return None


def _line(path: Path, key: str) -> int:
    """The number after a key in a file of lines; 0 where there is none."""
    try:
        for line in path.read_text().splitlines():
            if line.startswith(key):
                return int(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    return 0
