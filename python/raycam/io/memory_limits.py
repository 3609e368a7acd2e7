"""Determines memory limits of this process, and parses sizes.

The limits are those of the machine and of the process's control groups.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from pathlib import Path
from typing import NamedTuple

from ..arguments import real
from ..errors import SettingsError
from . import windows_memory

__all__ = ["available_bytes", "mac_available", "parse_size", "peak_bytes"]

CGROUP = Path("/sys/fs/cgroup")
PROC = Path("/proc")
"""Linux's folder of processes; other systems have no such folder, or a different folder."""


def available_bytes(share: float = 1.0) -> int:
    """Returns the bytes that this process and its children may still allocate.

    The result is the number of bytes until `share` of a limit is used. The result is negative if more is
    already used. The limits are the machine's memory and those of the process's control groups and their
    parents (Linux, versions 1 and 2, as set by containers and batch systems). The lowest limit applies. Used
    memory includes all processes under the same limit, but not file caches, which the kernel can drop.
    """
    return min(int(share * limit) - used for limit, used in limits())


def peak_bytes(pid: int) -> int:
    """The peak resident memory of a process in bytes (macOS: the current memory); 0 if unknown."""
    if sys.platform == "darwin":
        return _number_in(_command_output("ps", "-o", "rss=", "-p", str(pid)), r"(\d+)") * 1024
    if sys.platform == "win32":
        return windows_memory.peak_bytes(pid)
    return _line(PROC / str(pid) / "status", "VmHWM") * 1024


def parse_size(name: str, size: int | str | None) -> int | None:
    """Parses the size called `name`, and returns the number of bytes.

    `size` is a whole number, or a string such as "512 MiB", "2GB", "1.5 GiB". The result is None if `size` is
    None. K, M, G and T are powers of 1024 with `iB` and of 1000 with `B`. Raises `SettingsError` for an
    invalid size, or a size below one byte.
    """
    if size is None:
        return None
    count = 0
    if isinstance(size, str):
        found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*(?:([kmgt]?)(i?)b)?\s*", size, re.IGNORECASE)
        step = 1024 if found and found[3] else 1000
        exponent = " kmgt".index((found[2] or " ").lower()) if found else 0
        count = int(float(found[1]) * step**exponent) if found else 0
    else:
        with contextlib.suppress(SettingsError):
            count = int(size) if real(name, size).is_integer() else 0
    if not 0 < count < 1 << 63:
        raise SettingsError(
            f'{name} is {size!r}; expected a number of bytes, or a size such as "512 MiB"', code="wrong_type"
        )
    return count


def limits() -> list[tuple[int, int]]:
    """Returns the memory limits that apply to this process, as pairs (limit, used) in bytes.

    The limits are those of the machine and of every limited control group of this process.
    """
    if sys.platform == "win32":
        return [windows_memory.limit_and_used()]
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if sys.platform == "darwin":
        return [(total, max(0, total - mac_available(_command_output("vm_stat"))))]
    available = _line(PROC / "meminfo", "MemAvailable") * 1024
    found = [(total, max(0, total - available) if available else 0)]
    for folder, files in _groups():
        for path in [folder, *folder.parents]:
            statistics = path / "memory.stat"
            own = [_number(path / name) for name in files.limits]
            # Version 1 also lists the limits of parent groups that are not visible inside a
            # container.
            own.append(_line(statistics, "hierarchical_memory_limit") or None)
            limit = min((value for value in own if value is not None), default=total)
            used = _number(path / files.used)
            if limit < total and used is not None:
                caches = sum(_line(statistics, name) for name in files.caches)
                found.append((limit, max(0, used - caches)))
            if path == CGROUP:
                break
    return found


def mac_available(vm_stat: str) -> int:
    """Returns the bytes available on macOS without swapping, from the text of `vm_stat`.

    These are the free, speculative and inactive pages.
    """
    page = _number_in(vm_stat, r"page size of (\d+) bytes")
    return page * sum(_number_in(vm_stat, rf"Pages {kind}:\s+(\d+)") for kind in MAC_AVAILABLE)


MAC_AVAILABLE = ("free", "speculative", "inactive")


def _command_output(*command: str) -> str:
    """The output of a system command; empty if the command fails."""
    from subprocess import SubprocessError, run  # imported here, so that `import raycam` is fast

    try:
        return run(command, capture_output=True, text=True, check=True, timeout=5).stdout
    except (OSError, SubprocessError):
        return ""


def _number_in(text: str, pattern: str) -> int:
    """The number in a text that matches the pattern's group; 0 without a match."""
    found = re.search(pattern, text)
    return int(found[1]) if found else 0


class _Files(NamedTuple):
    """File names of a control group, and the lines of its statistics about file caches."""

    limits: tuple[str, ...]
    used: str
    caches: tuple[str, ...]


VERSION_1 = _Files(
    ("memory.limit_in_bytes",), "memory.usage_in_bytes", ("total_inactive_file", "total_active_file")
)
# Above the limit "memory.high", a group is not killed, but slowed down almost to a standstill.
VERSION_2 = _Files(("memory.max", "memory.high"), "memory.current", ("inactive_file", "active_file"))


def _groups() -> list[tuple[Path, _Files]]:
    """The folders of this process's control groups that limit memory, and their file names."""
    try:
        lines = (PROC / "self" / "cgroup").read_text().splitlines()
    except OSError:
        return []
    groups = []
    for line in lines:
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        if not controllers:
            groups.append((CGROUP / path.lstrip("/"), VERSION_2))
        elif "memory" in controllers.split(","):
            groups.append((CGROUP / "memory" / path.lstrip("/"), VERSION_1))
    return groups


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):  # "max" means no limit
        return None


def _line(path: Path, key: str) -> int:
    """Returns the number after a key at the start of a line of a file; 0 if the key is missing."""
    try:
        for line in path.read_text().splitlines():
            words = line.replace(":", " ", 1).split()
            if words[:1] == [key]:
                return int(words[1])
    except (OSError, ValueError, IndexError):
        pass
    return 0
