"""Saving scans: the format by the file's extension, and the fields that its readers expect."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import LidarError, nearest
from ...io.atomic_files import write
from ...io.npz import npz_bytes
from .csv import csv_bytes
from .feather import feather_bytes
from .las import las_bytes, laz_bytes
from .pcd import pcd_bytes, pcd_compressed, pcd_text
from .ply import ply_bytes

__all__ = ["FORMATS", "save_scan"]

Arrays = dict[str, npt.NDArray[Any]]

CLOUD_FIELDS = ("intensity", "ring", "time", "return", "instance", "category")


def kitti_bytes(arrays: Arrays) -> bytes:
    """Returns KITTI's .bin: x, y, z and intensity from 0 to 1, float32 [n, 4].

    Source: KITTI's devkit.
    """
    reflectance = arrays["intensity"].astype(np.float32) / np.float32(255.0)
    rows = np.concatenate([arrays["position"].astype("<f4"), reflectance[:, None]], axis=1)
    return rows.astype("<f4").tobytes()


FEATHER_FIELDS = ("intensity", "laser", "time", "instance", "category")
LAS_FIELDS = ("intensity", "return", "returns", "time", "instance", "category", "ring")
FORMATS: dict[str, tuple[Callable[[Arrays], bytes], tuple[str, ...] | None]] = {
    ".pcd": (pcd_bytes, CLOUD_FIELDS),
    ".ply": (ply_bytes, CLOUD_FIELDS),
    ".csv": (csv_bytes, CLOUD_FIELDS),
    ".las": (las_bytes, LAS_FIELDS),
    ".laz": (laz_bytes, LAS_FIELDS),
    ".feather": (feather_bytes, FEATHER_FIELDS),
    ".bin": (kitti_bytes, ("intensity",)),
    ".npz": (npz_bytes, None),
}
"""The writer of each extension, and the fields besides the position; None: all."""

REQUIRED_FIELDS = {
    ".las": ("intensity", "return", "returns", "time"),
    ".laz": ("intensity", "return", "returns", "time"),
    ".feather": ("intensity", "laser", "time"),
}
"""Fields that are always written, even if they are not selected."""


def save_scan(
    columns: Mapping[str, npt.NDArray[Any]],
    position: npt.NDArray[Any],
    path: str | os.PathLike[str],
    fields: Iterable[str] | None,
    text: bool = False,
    compress: bool = False,
) -> None:
    """Writes a scan's fields with the points `position` [n, 3]; see `Scan.save`."""
    write(path, encode_scan(columns, position, Path(path).suffix, fields, text, compress))


def check_extension(extension: str) -> None:
    """Raises `LidarError` if `extension`, such as ".pcd", belongs to no format of point clouds."""
    known = [*FORMATS, ".pcap"]
    if extension.lower() not in known:
        raise LidarError(nearest("extension of a point cloud", extension, known), code="unknown_format")


def encode_scan(
    columns: Mapping[str, npt.NDArray[Any]],
    position: npt.NDArray[Any],
    extension: str,
    fields: Iterable[str] | None = None,
    text: bool = False,
    compress: bool = False,
) -> bytes:
    """Returns the bytes of a file of points; `extension` selects the format, such as ".pcd".

    `columns` are the scan's fields, `position` [n, 3] are the points, and `fields` are the names of the fields to
    write. `text` and `compress` select PCD's other forms.
    """
    check_extension(extension)
    write, defaults = FORMATS[extension.lower()]
    if text or compress:
        if extension.lower() != ".pcd":
            option = "text" if text else "compress"
            raise LidarError(
                f"{extension}: {option} requires a .pcd file; other text format: .csv, other compressed format: .laz",
                code="cannot_write",
            )
        if text and compress:
            raise LidarError(
                "text and compress cannot be combined; use only one of them", code="conflicting_values"
            )
        write = pcd_text if text else pcd_compressed
    chosen = _chosen(columns, extension, fields, defaults)
    if "scan_angle" in columns:
        chosen.append("scan_angle")
    rows = slice(None) if extension.lower() == ".npz" else columns["lost"] == 0
    return write({"position": position[rows], **{name: columns[name][rows] for name in chosen}})


def _chosen(
    columns: Mapping[str, npt.NDArray[Any]],
    extension: str,
    fields: Iterable[str] | None,
    defaults: tuple[str, ...] | None,
) -> list[str]:
    if fields is None:
        return list(defaults if defaults is not None else (name for name in columns if name != "position"))
    if isinstance(fields, str):
        raise LidarError(f"fields must be a list of names, not the string {fields!r}", code="wrong_type")
    names = [name for name in fields if name != "position"]
    for name in names:
        if name not in columns:
            raise LidarError(nearest("field of a scan", name, list(columns)), code="unknown_name")
    if extension.lower() == ".bin" and names != ["intensity"]:
        raise LidarError(
            f"KITTI's .bin has position and intensity only; fields given: {', '.join(names)}",
            code="cannot_write",
        )
    required = REQUIRED_FIELDS.get(extension.lower(), ())
    return [*(name for name in required if name not in names), *names]
