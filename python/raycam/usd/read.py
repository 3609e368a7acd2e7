"""Starting the process that reads a USD file, and reading its answer.

The process, `raycam.usd.worker`, runs under `UsdLimits` of time, memory and disk, because files are untrusted. It
writes arrays, materials and images into an empty folder. Its output is checked like any other file.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import FormatError, SettingsError, WorldError
from ..io.folders import check_folder
from ..io.limited_process import describe_status, run_limited
from .arrays import read_arrays

__all__ = ["SUFFIXES", "StageContents", "UsdLimits", "read"]

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
"""Endings of USD files."""


@dataclass(frozen=True)
class UsdLimits:
    """Limits for reading one USD file."""

    seconds: float = 300.0
    """Maximum time in seconds."""
    memory: int = 8 << 30
    """Maximum address space of the process in bytes."""
    bytes: int = 4 << 30
    """Maximum size in bytes of all files read together, and of each file written."""
    corners: int = 1 << 28
    """Maximum number of face corners of all meshes; if all become one object, of all instances."""


@dataclass(frozen=True)
class StageContents:
    """The parts of a stage that the process has read."""

    world: dict[str, Any]
    """Up axis, lights and cameras, for `World.from_dict`."""
    polygons: dict[str, Any]
    """Meshes and objects, as `_core.world_from_polygons` accepts them."""
    notices: list[tuple[str, str]]
    """Code and text of each notice."""
    files: dict[str, str]
    """The original names of the images in the folder."""
    variants: list[str]
    """All variants, as "SET=NAME"."""


def read(
    path: str | os.PathLike[str],
    folder: Path,
    budget: UsdLimits | None = None,
    *,
    root: str | os.PathLike[str] | None = None,
    time: float | None = None,
    single: bool = False,
    up: str | None = None,
    variant: str | None = None,
) -> StageContents:
    """Reads a USD file; its materials and images are written into `folder`.

    Layers and images are read from `root` (default: the file's folder). `time` is in seconds (default: the first
    time). With `single`, all meshes become one object, turned to the axis `up`, and lights and cameras are omitted.
    `variant` selects variants: "NAME", "SET=NAME" or "/PRIM{SET=NAME}", several separated by commas. Raises `OSError`
    if the file cannot be opened, `FormatError` if it cannot be read within the limits, `WorldError` for an unknown
    variant, and `SettingsError` without the extra `raycam[usd]` or for a wrong `root` or `time`.
    """
    budget = budget or UsdLimits()
    path = Path(path)
    with path.open("rb") as file:  # raises OSError if the file cannot be read
        if not path.is_file():
            raise FormatError(
                f"{path}: a device, pipe or socket, expected a regular file", code="unknown_format"
            )
        size = file.seek(0, os.SEEK_END)
    if time is not None and not math.isfinite(time):
        raise SettingsError(f"time must be a finite number of seconds, got {time}", code="wrong_type")
    if root is not None:
        check_folder(path, root)
    if size > budget.bytes:
        raise FormatError(
            f"{path}: file too large: {size} bytes; the limit is {budget.bytes}", code="budget_exceeded"
        )
    if importlib.util.find_spec("pxr") is None:
        raise SettingsError(
            f"{path}: reading USD requires Pixar's library: pip install 'raycam[usd]'",
            code="missing_dependency",
        )
    limits = {
        "memory": budget.memory,
        "bytes": budget.bytes,
        "seconds": budget.seconds,
        "corners": budget.corners,
        "folder": os.path.abspath(path.parent if root is None else root),
        "time": time,
        "single": single,
        "up": up,
        "variant": variant,
    }
    command = [sys.executable, "-m", "raycam.usd.worker", os.fspath(path.absolute()), os.path.abspath(folder)]
    # OpenUSD would also search for layers in the folders of this variable.
    environment = {key: value for key, value in os.environ.items() if key != "PXR_AR_DEFAULT_SEARCH_PATH"}
    status, output = run_limited([*command, json.dumps(limits)], budget.seconds, path, "USD", environment)
    answer = folder / "world.json"
    if not answer.is_file() or status != 0:
        last = output.splitlines()[-1] if output else "the process printed no reason"
        raise FormatError(
            f"{path}: the process that reads USD failed ({describe_status(status)}): {last}",
            code="failed_process",
        )
    return _contents(json.loads(answer.read_text(encoding="utf-8")), folder, path, variant)


def _contents(answer: dict[str, Any], folder: Path, path: Path, variant: str | None) -> StageContents:
    """The answer of the process; raises the error that it contains."""
    if "error" in answer:
        raise FormatError(f"{path}: {answer['error']}", code=answer["code"])
    if "unknown_variant" in answer:
        known = ", ".join(answer["variants"][:50]) or "none"
        raise WorldError(
            f"{path}: no variant {answer['unknown_variant']!r} (variant={variant!r}); the stage has: {known}",
            code="unknown_name",
        )
    try:
        polygons: dict[str, Any] = dict(read_arrays(folder))
    except (OSError, ValueError) as error:
        raise FormatError(
            f"{path}: the process that reads USD wrote an incomplete result: {error}", code="failed_process"
        ) from None
    polygons |= {"names": answer["names"], "materials": answer["materials"]}
    notices = [(code, text) for code, text in answer["notices"]]
    return StageContents(answer["world"], polygons, notices, answer["files"], answer["variants"])
