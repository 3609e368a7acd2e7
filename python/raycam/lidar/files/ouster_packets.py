"""Ouster's lidar packets of the profile LEGACY, as a capture file (PCAP) of UDP, and the unit's metadata.

Sources: Ouster Firmware User Manual, "Lidar Data Packet Format" and "LEGACY"; ouster-sdk 1.0.1 decodes the packets.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import LidarError
from ...io.atomic_files import write
from .pcap import pcap_file

__all__ = ["ouster_packets", "save_ouster_packets"]

COLUMNS = 16
"""Columns in a packet."""
ENCODER_COUNTS = 90112
"""Counts of the encoder per turn."""
VALID = 0xFFFFFFFF
"""Status of a column with measurements."""
LARGEST_RANGE_MM = (1 << 20) - 1
PORT = 7502
FRAME = 1
"""Number of the frame in the packets."""
MARK = "written by raycam"
"""`user_data` of metadata files that may be replaced."""
PIXEL = np.dtype(
    [("range", "<u4"), ("reflectivity", "<u2"), ("signal", "<u2"), ("near_ir", "<u2"), ("unused", "<u2")]
)


def ouster_packets(
    columns: Mapping[str, npt.NDArray[Any]], shape: tuple[int, int], rate: float, start: float = 0.0
) -> list[tuple[float, bytes]]:
    """Returns the times in seconds and the bytes of the packets of a frame with `shape` (rows, columns).

    A range of 0 is a pulse without a point. Signal and near infrared are 0. Raises `LidarError` for distances beyond
    20 bits of millimetres.
    """
    rows, count = shape
    kept = columns["lost"] == 0
    millimetres = np.rint(columns["distance"][kept] * 1000.0)
    if len(millimetres) and (millimetres.max() > LARGEST_RANGE_MM or millimetres.min() < 1):
        raise LidarError(
            f"distances are {millimetres.min() / 1000:g} to {millimetres.max() / 1000:g} m; Ouster's packets support "
            f"0.001 to {LARGEST_RANGE_MM / 1000:g} m",
            code="cannot_write",
        )
    column = np.dtype(
        [
            ("time", "<u8"),
            ("number", "<u2"),
            ("frame", "<u2"),
            ("encoder", "<u4"),
            ("pixels", PIXEL, rows),
            ("status", "<u4"),
        ]
    )
    table = np.zeros(count, column)
    number = np.arange(count)
    table["time"] = np.rint((start + number / (count * rate)) * 1e9).astype(np.uint64)
    table["number"], table["frame"], table["status"] = number, FRAME, VALID
    table["encoder"] = number * ENCODER_COUNTS // count
    at = (columns["column"][kept], columns["laser"][kept])
    table["pixels"]["range"][at] = millimetres.astype(np.uint32)
    table["pixels"]["reflectivity"][at] = columns["intensity"][kept]
    packets = []
    for first in range(0, count, COLUMNS):
        packets.append((start + first / (count * rate), table[first : first + COLUMNS].tobytes()))
    return packets


def save_ouster_packets(
    path: Path, columns: Mapping[str, npt.NDArray[Any]], metadata: Mapping[str, Any], returns: str
) -> None:
    """Writes the packets to `path`, and the metadata without which they cannot be decoded to the same name with .json.

    Raises `LidarError` for more than one return per pulse, and if the .json file exists and was not written by raycam.
    """
    if returns not in ("strongest", "last"):
        raise LidarError(
            f"Ouster's legacy packets do not support returns={returns!r}; supported: strongest, last",
            code="cannot_write",
        )
    beside = path.with_suffix(".json")
    if beside.exists() and not _is_own(beside):
        raise LidarError(
            f"{path}: the packets require the metadata {beside.name}, but this file exists and was not written by "
            "raycam; save the packets under another name",
            code="cannot_write",
        )
    layout = metadata["lidar_data_format"]
    shape = (layout["pixels_per_column"], layout["columns_per_frame"])
    packets = ouster_packets(columns, shape, float(layout["fps"]))
    write(beside, json.dumps({**metadata, "user_data": MARK}, indent=1).encode())
    write(path, pcap_file(packets, PORT))


def _is_own(path: Path) -> bool:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(found, dict) and found.get("user_data") == MARK
