"""USD files, read by Pixar's library in a separate process: the `raycam[usd]` extra.

The process, `raycam.usd.worker`, runs under `UsdLimits` of time, memory and disk, because files are untrusted. It
writes meshes and images into an empty folder, from which raycam reads them like from any other folder.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FormatError, SettingsError
from ..io.folders import check_folder

if TYPE_CHECKING:
    from subprocess import Popen

__all__ = ["SUFFIXES", "UsdLimits", "read"]

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
"""Endings of USD files."""


@dataclass(frozen=True)
class UsdLimits:
    """Limits for reading one USD file."""

    seconds: float = 300.0
    """Time."""
    memory: int = 8 << 30
    """Address space in bytes."""
    bytes: int = 4 << 30
    """Size in bytes of all files read, and of every file written."""
    triangles: int = 1 << 28
    """Face corners, counted for every instance."""


def read(
    path: str | os.PathLike[str],
    folder: Path,
    budget: UsdLimits | None = None,
    *,
    root: str | os.PathLike[str] | None = None,
    time: float | None = None,
    single: bool = False,
    up: str | None = None,
) -> dict[str, Any]:
    """Reads a USD file as a dict for `World.from_dict`; meshes and images are written into `folder`.

    Layers and images are read from `root` (default: the file's folder). `time` is in seconds (default: the first). With
    `single` all meshes are one object without lights and cameras, turned to the axis `up`. The dict also has
    `"notices"`, and under `"files"` the original names of the images. Raises `OSError` if the file cannot be opened,
    `FormatError` if it cannot be read within the limits, and `SettingsError` without the extra or for a wrong `root` or
    `time`.
    """
    budget = budget or UsdLimits()
    path = Path(path)
    with path.open("rb") as file:  # raises the usual OSErrors
        if not path.is_file():
            raise FormatError(f"{path}: a device, pipe or socket, expected a regular file")
        size = file.seek(0, os.SEEK_END)
    if time is not None and not math.isfinite(time):
        raise SettingsError(f"time is {time}, expected seconds")
    if root is not None:
        check_folder(path, root)
    if size > budget.bytes:
        raise FormatError(f"{path}: {size} bytes, but the budget has {budget.bytes} left")
    if importlib.util.find_spec("pxr") is None:
        raise SettingsError(f"{path}: reading USD needs Pixar's library: pip install 'raycam[usd]'")
    limits = {
        "memory": budget.memory,
        "bytes": budget.bytes,
        "seconds": budget.seconds,
        "triangles": budget.triangles,
        "folder": os.path.abspath(path.parent if root is None else root),
        "time": time,
        "single": single,
        "up": up,
    }
    command = [sys.executable, "-m", "raycam.usd.worker", os.fspath(path.absolute()), os.path.abspath(folder)]
    # Imported here: `import raycam` does not wait for them.
    import signal
    import subprocess
    import tempfile

    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [*command, json.dumps(limits)],
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            # Pixar's library would also look there for layers.
            env={key: value for key, value in os.environ.items() if key != "PXR_AR_DEFAULT_SEARCH_PATH"},
        )
        try:
            status = process.wait(budget.seconds)
        except subprocess.TimeoutExpired:
            raise FormatError(f"{path}: not read within {budget.seconds:g} s, the budget for USD") from None
        finally:
            _terminate(process)
        said.seek(max(0, said.seek(0, os.SEEK_END) - 2000))
        words = said.read().decode("utf-8", "replace").strip()
    answer = folder / "world.json"
    if not answer.is_file() or status != 0:
        last = words.splitlines()[-1] if words else "no reason given"
        how = f"signal {signal.Signals(-status).name}" if status < 0 else f"status {status}"
        raise FormatError(f"{path}: Pixar's library gave up ({how}): {last}")
    found: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
    if "error" in found:
        raise FormatError(f"{path}: {found['error']}")
    return found


def _terminate(process: Popen[bytes]) -> None:
    """Kills the worker and its child processes (Windows: the worker, which has none)."""
    import signal

    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()
