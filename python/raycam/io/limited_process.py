"""Processes under limits of time, memory and disk, for libraries that read untrusted files."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FormatError

if TYPE_CHECKING:
    from subprocess import Popen

__all__ = ["apply_rlimits", "describe_status", "run_limited"]

OUTPUT_BYTES = 2000
"""Number of bytes kept from the end of a process's output."""


def apply_rlimits(memory: int, seconds: float, size: int) -> None:
    """Limits the address space, processor time and file size of this process.

    `memory` is in bytes, `seconds` is the processor time, and `size` is the size of a written file in bytes. The
    limits apply on systems that support such limits.
    """
    try:
        import resource
    except ImportError:  # Windows has no such module
        return
    limits = {
        resource.RLIMIT_AS: (memory, memory),
        resource.RLIMIT_CPU: (int(seconds) + 1, int(seconds) + 2),
        resource.RLIMIT_FSIZE: (size, size),
        resource.RLIMIT_CORE: (0, 0),
    }
    for kind, limit in limits.items():
        try:
            resource.setrlimit(kind, limit)
        except (ValueError, OSError):
            if sys.platform != "darwin":  # macOS refuses limits of the address space
                raise


def run_limited(
    command: Sequence[str], seconds: float, path: Path, what: str, environment: Mapping[str, str]
) -> tuple[int, str]:
    """Returns the exit status of a command and the end of its output.

    Raises `FormatError` with `path` if the command takes longer than `seconds`, the time limit for `what`.
    """
    # imported here, so that `import raycam` is fast
    import subprocess
    import tempfile

    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env=environment,
        )
        try:
            status = process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise FormatError(
                f"{path}: not read within {seconds:g} s, the time limit for {what}", code="budget_exceeded"
            ) from None
        finally:
            _terminate(process)
        output.seek(max(0, output.seek(0, os.SEEK_END) - OUTPUT_BYTES))
        return status, output.read().decode("utf-8", "replace").strip()


def describe_status(status: int) -> str:
    """Returns an exit status as text.

    The text is "status 1", for example, or "signal SIGKILL" for a process that a signal ended.
    """
    import signal

    return f"signal {signal.Signals(-status).name}" if status < 0 else f"status {status}"


def _terminate(process: Popen[bytes]) -> None:
    """Kills the process and its child processes; on Windows, the process has no child processes."""
    import signal

    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()
