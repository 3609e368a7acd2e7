"""Memory of the machine and of processes, as reported by Windows."""

from __future__ import annotations

from typing import Any

__all__ = ["limit_and_used", "peak_bytes"]

QUERY_LIMITED = 0x1000
"""The right to query a process."""


def limit_and_used() -> tuple[int, int]:
    """The machine's memory and the memory in use, in bytes."""
    import ctypes  # imported here, so that `import raycam` is fast

    class MemoryStatus(ctypes.Structure):
        """The structure MEMORYSTATUSEX of the Windows API."""

        # Unused fields have one-letter names.
        _fields_ = [
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            *((name, ctypes.c_ulonglong) for name in ("total", "available", *"abcde")),
        ]

    status = MemoryStatus(length=ctypes.sizeof(MemoryStatus))
    if not _kernel().GlobalMemoryStatusEx(ctypes.byref(status)):
        return 1 << 62, 0
    return status.total, status.total - status.available


def peak_bytes(pid: int) -> int:
    """The peak resident memory of a process in bytes; 0 if unknown."""
    import ctypes

    class Counters(ctypes.Structure):
        """The structure PROCESS_MEMORY_COUNTERS of the Windows API."""

        _fields_ = [
            ("size", ctypes.c_ulong),
            ("faults", ctypes.c_ulong),
            *((name, ctypes.c_size_t) for name in ("peak", *"abcdefg")),
        ]

    kernel = _kernel()
    kernel.OpenProcess.restype = ctypes.c_void_p
    process = kernel.OpenProcess(QUERY_LIMITED, False, pid)
    if not process:
        return 0
    counters = Counters(size=ctypes.sizeof(Counters))
    try:
        asked = kernel.K32GetProcessMemoryInfo(
            ctypes.c_void_p(process), ctypes.byref(counters), counters.size
        )
        return int(counters.peak) if asked else 0
    finally:
        kernel.CloseHandle(ctypes.c_void_p(process))


def _kernel() -> Any:
    """The Windows library kernel32."""
    import ctypes

    return ctypes.windll.kernel32  # type: ignore[attr-defined]
