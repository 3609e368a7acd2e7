"""Tables of pulses: CSV files, NumPy arrays, and RGL's matrices.

A CSV file contains time, azimuth, and elevation or zenith.
"""

from __future__ import annotations

import lzma
import math
import re
import struct
import tokenize
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...elementary import cos, sin
from ...errors import LidarError
from ..lidar import MAX_RING, Lidar
from .reading import finite, read_text

__all__ = ["read_table"]

ARRAYS = ("directions", "times", "rings", "origins")
DAMAGES = (
    *(ValueError, TypeError, SyntaxError, OverflowError, RecursionError, tokenize.TokenError),
    *(OSError, EOFError, RuntimeError, struct.error, zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
"""Exceptions that NumPy's header reader and the archive readers raise for damaged files."""
MAX_ROWS = 1 << 22
"""The maximum number of pulses in a table."""
MATRIX_BYTES = 48
"""The size of an RGL matrix in bytes."""
MAX_ARRAY_BYTES = MAX_ROWS * 24
"""The largest array, in bytes."""


def read_table(path: Path, device: str | None) -> dict[str, Any]:
    """Returns the description of a table of pulses.

    If `device` is given, this device supplies the other settings.
    """
    readers = {".npy": _read_arrays, ".npz": _read_arrays, ".mat3x4f": _read_matrices}
    arrays = readers.get(path.suffix.lower(), _read_text_table)(path)
    try:
        description = Lidar.of(**arrays, name=path.stem)._description
    except LidarError as fault:
        raise LidarError(f"{path}: {fault}", code=fault.code) from None
    if device is not None:
        from ..device import device_description

        numbers = device_description(device)
        own = numbers.pop("family")
        numbers.pop(own)
        numbers.pop("generic", None)
        description = {**numbers, "family": "table", "table": description["table"]}
    return description


def _read_arrays(path: Path) -> dict[str, Any]:
    try:
        if path.suffix.lower() == ".npy":
            with path.open("rb") as file:
                return {"directions": _read_array(path, file, path.stat().st_size)}
        with zipfile.ZipFile(path) as archive:
            members = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
            if not {"directions"} <= members.keys() <= set(ARRAYS):
                raise LidarError(
                    f"{path}: the file contains {', '.join(members)}; expected directions and, optionally, times, "
                    "rings, origins",
                    code="wrong_shape",
                )
            arrays = {}
            for name, item in members.items():
                with archive.open(item) as member:
                    arrays[name] = _read_array(path, member, item.file_size)
            return arrays
    except DAMAGES as fault:
        if isinstance(fault, LidarError):
            raise
        raise LidarError(f"{path}: not a file of NumPy arrays: {fault}", code="syntax") from None


def _read_matrices(path: Path) -> dict[str, Any]:
    """Reads the pulses of a file of float32 matrices [n, 3, 4].

    Each ray starts at the translation and points along the matrix's z axis.

    Source: RobotecGPULidar, `rgl_node_rays_from_mat3x4f`.
    """
    size = path.stat().st_size
    if size == 0 or size % MATRIX_BYTES:
        raise LidarError(
            f"{path}: the file has {size} bytes; expected {MATRIX_BYTES} bytes for each pulse (3 x 4 float32)",
            code="wrong_shape",
        )
    if size // MATRIX_BYTES > MAX_ROWS:
        raise LidarError(
            f"{path}: too many pulses: {size // MATRIX_BYTES}; the limit is {MAX_ROWS}",
            code="budget_exceeded",
        )
    matrices = np.frombuffer(path.read_bytes(), "<f4").reshape(-1, 3, 4).astype(np.float64)
    return {"directions": matrices[:, :, 2], "origins": matrices[:, :, 3]}


def _read_array(path: Path, stream: IO[bytes], size: int) -> npt.NDArray[Any]:
    """Reads an array of numbers after a check of its declared size.

    The declared size is compared with the `size` of the array's file.
    """
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"version {version} of the .npy format is not supported; expected (1, 0) or (2, 0)")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # NumPy warns about headers written by Python 2
        shape, is_fortran, kind = read(stream)
    if any(length < 0 for length in shape):
        raise ValueError(f"an array has the invalid shape {shape}")
    if kind.kind not in "fiu":
        raise ValueError(f"an array has the dtype {kind}, expected numbers")
    need = math.prod(shape) * kind.itemsize
    if need > size:
        raise ValueError(f"an array declares {need} bytes, but the file has {size}")
    if need > MAX_ARRAY_BYTES or (len(shape) > 0 and shape[0] > MAX_ROWS):
        raise LidarError(
            f"{path}: an array has the shape {list(shape)}; the limit is {MAX_ROWS} rows",
            code="budget_exceeded",
        )
    data = stream.read(need)
    return np.frombuffer(data, kind).reshape(shape, order="F" if is_fortran else "C")


def _read_text_table(path: Path) -> dict[str, Any]:
    """Reads the columns of a text table by their header.

    The columns are time (s), azimuth (degrees), elevation or zenith (degrees), and ring.
    """
    lines = read_text(path).splitlines()
    if not lines:
        raise LidarError(f"{path}: the file is empty", code="missing_value")
    names = [name.strip().lower() for name in re.split(r"[,;\t]", lines[0])]

    def column(*words: str) -> int | None:
        return next(
            (i for i, name in enumerate(names) if name.split("/")[0].split("(")[0].strip() in words), None
        )

    at = {
        "time": column("time", "t"),
        "azimuth": column("azimuth"),
        "elevation": column("elevation"),
        "zenith": column("zenith"),
        "ring": column("ring", "line"),
    }
    if at["azimuth"] is None or (at["elevation"] is None) == (at["zenith"] is None):
        raise LidarError(
            f"{path}, line 1: expected columns time, azimuth and elevation or zenith; found: {', '.join(names)}",
            code="wrong_shape",
        )
    if len(lines) > MAX_ROWS:
        raise LidarError(
            f"{path}: too many lines: {len(lines)}; the limit is {MAX_ROWS}", code="budget_exceeded"
        )
    rows: list[list[float]] = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = re.split(r"[,;\t]", line)
        values = []
        for name, index in at.items():
            where = f"{path}, line {number}: {name}"
            if index is not None and index >= len(cells):
                raise LidarError(
                    f"{where} is missing; the line has {len(cells)} values, the header {len(names)} columns",
                    code="missing_value",
                )
            limit = MAX_RING if name == "ring" else math.inf
            values.append(0.0 if index is None else finite(cells[index], where, limit))
        if not values[4].is_integer():
            raise LidarError(
                f"{path}, line {number}: ring is {values[4]:g}; expected a whole number", code="out_of_range"
            )
        if at["zenith"] is not None:
            values[2] = 90.0 - values[3]
        if abs(values[2]) > 90.0:
            given = f"elevation is {values[2]:g}; expected degrees within +-90"
            if at["zenith"] is not None:
                given = f"zenith is {values[3]:g}; expected 0 to 180 degrees"
            raise LidarError(f"{path}, line {number}: {given}", code="out_of_range")
        if rows and values[0] < rows[-1][0]:
            raise LidarError(
                f"{path}, line {number}: time is {values[0]:g}, less than the previous time {rows[-1][0]:g}",
                code="unordered_times",
            )
        rows.append(values)
    if not rows:
        raise LidarError(f"{path}: the table has no rows", code="missing_value")
    azimuth, elevation = np.radians([row[1:3] for row in rows]).T
    flat = cos(elevation)
    directions = np.stack([flat * cos(azimuth), flat * sin(azimuth), sin(elevation)], axis=1).tolist()
    first = rows[0][0]
    table: dict[str, Any] = {"directions": directions, "times": [row[0] - first for row in rows]}
    if at["ring"] is not None:
        table["rings"] = np.array([row[4] for row in rows], dtype=np.int32)
    return table
