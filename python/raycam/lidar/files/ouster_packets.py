"""Ouster's lidar packets as a capture file (PCAP) of UDP, and the unit's metadata.

Packets with one return have the profile LEGACY, packets with two returns RNG19_RFL8_SIG16_NIR16_DUAL. Sources: Ouster
Firmware User Manual, "Lidar Data Packet Format"; ouster-sdk 1.0.1 decodes the packets.
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
from ..intensity import near_ir_counts
from .pcap import pcap_file

__all__ = ["crc64", "ouster_dual_packets", "ouster_packets", "save_ouster_packets"]

COLUMNS = 16
"""Columns in a packet."""
ENCODER_COUNTS = 90112
"""Counts of the encoder per turn."""
VALID = 0xFFFFFFFF
"""Status of a column with measurements."""
LARGEST_RANGE_MM = (1 << 20) - 1
LARGEST_DUAL_RANGE_MM = (1 << 19) - 1
"""The largest distance in packets with two returns, in millimetres."""
DUAL_PROFILE = "RNG19_RFL8_SIG16_NIR16_DUAL"
LIDAR_PACKET = 1
"""The type of lidar packets, given in the headers of packets with two returns."""
CRC64_POLYNOMIAL = 0xC96C5795D7870F42
"""The polynomial of ECMA-182 with reflected bits."""
PORT = 7502
FRAME = 1
"""Number of the frame in the packets."""
MARK = "written by raycam"
"""The `user_data` of metadata files that raycam has written, and may therefore replace."""
PIXEL = np.dtype(
    [("range", "<u4"), ("reflectivity", "<u2"), ("signal", "<u2"), ("near_ir", "<u2"), ("unused", "<u2")]
)
DUAL_PIXEL = np.dtype(
    [
        ("range", "<u4"),
        ("range2", "<u4"),
        ("signal", "<u2"),
        ("signal2", "<u2"),
        ("near_ir", "<u2"),
        ("unused", "<u2"),
    ]
)
"""The ranges have 19 bits; their highest 8 bits are the reflectivities."""


def ouster_packets(
    columns: Mapping[str, npt.NDArray[Any]],
    shape: tuple[int, int],
    rate: float,
    start: float = 0.0,
    near_ir: Any = 0,
) -> list[tuple[float, bytes]]:
    """Returns the times in seconds and the bytes of the packets of a frame.

    `shape` is the frame's (rows, columns), `rate` the number of frames per second, and `start` the frame's start in
    seconds. A range of 0 is a pulse without a point. `near_ir` are the counts of near infrared light [n] (default:
    0).

    Raises `LidarError` for distances beyond 20 bits of millimetres.
    """
    rows, count = shape
    kept = columns["lost"] == 0
    millimetres = _millimetres(columns["distance"][kept], LARGEST_RANGE_MM)
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
    table["pixels"]["range"][at] = millimetres
    table["pixels"]["reflectivity"][at] = columns["intensity"][kept]
    table["pixels"]["signal"][at] = columns["signal"][kept]
    table["pixels"]["near_ir"][at] = np.broadcast_to(near_ir, len(kept))[kept]
    packets = []
    for first in range(0, count, COLUMNS):
        packets.append((start + first / (count * rate), table[first : first + COLUMNS].tobytes()))
    return packets


def ouster_dual_packets(
    columns: Mapping[str, npt.NDArray[Any]],
    shape: tuple[int, int],
    rate: float,
    start: float = 0.0,
    near_ir: Any = 0,
) -> list[tuple[float, bytes]]:
    """Returns the times in seconds and the bytes of packets with up to two returns per pulse.

    `shape` is the frame's (rows, columns). The first range of a pixel is the strongest return, and ranges
    have 19 bits. Other values and errors are the same as for `ouster_packets`.
    """
    rows, count = shape
    kept = np.flatnonzero(columns["lost"] == 0)
    words = _millimetres(columns["distance"][kept], LARGEST_DUAL_RANGE_MM)
    words |= columns["intensity"][kept].astype(np.uint32) << 24
    energy = np.asarray(columns["reflectivity"][kept], float) / np.square(columns["distance"][kept])
    pulse = columns["column"][kept].astype(np.int64) * rows + columns["laser"][kept]
    order = np.lexsort((-energy, pulse))
    pulse, words, signal = pulse[order], words[order], columns["signal"][kept][order]
    is_first = np.append(True, np.diff(pulse) != 0)[: len(pulse)]
    pixels = np.zeros(rows * count, DUAL_PIXEL)
    pixels["range"][pulse[is_first]] = words[is_first]
    pixels["range2"][pulse[~is_first]] = words[~is_first]
    pixels["signal"][pulse[is_first]] = signal[is_first]
    pixels["signal2"][pulse[~is_first]] = signal[~is_first]
    pixels["near_ir"][pulse] = np.broadcast_to(near_ir, len(columns["lost"]))[kept][order]
    column = np.dtype([("time", "<u8"), ("number", "<u2"), ("status", "<u2"), ("pixels", DUAL_PIXEL, rows)])
    packet = np.dtype(
        [
            ("type", "<u2"),
            ("frame", "<u2"),
            ("header", "u1", 28),
            ("columns", column, COLUMNS),
            ("footer", "u1", 24),
            ("check", "<u8"),
        ]
    )
    table = np.zeros(count // COLUMNS, packet)
    number = np.arange(count).reshape(-1, COLUMNS)
    table["type"], table["frame"] = LIDAR_PACKET, FRAME
    table["columns"]["time"] = np.rint((start + number / (count * rate)) * 1e9).astype(np.uint64)
    table["columns"]["number"], table["columns"]["status"] = number, 1
    table["columns"]["pixels"] = pixels.reshape(-1, COLUMNS, rows)
    table["check"] = crc64(table.view(np.uint8).reshape(len(table), -1)[:, :-8])
    return [
        (start + first / (count * rate), row.tobytes())
        for first, row in zip(number[:, 0], table, strict=True)
    ]


def crc64(data: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint64]:
    """Returns the CRC-64/XZ of each row of bytes [n, m] (ECMA-182), uint64 [n]."""
    table = np.arange(256, dtype=np.uint64)
    for _ in range(8):
        table = (table >> np.uint64(1)) ^ np.where(
            table & np.uint64(1), np.uint64(CRC64_POLYNOMIAL), np.uint64(0)
        )
    register = np.full(len(data), ~np.uint64(0))
    for byte in np.ascontiguousarray(data.T):
        register = table[(register & np.uint64(0xFF)) ^ byte] ^ (register >> np.uint64(8))
    return ~register


def _millimetres(distances: npt.NDArray[np.float64], largest: int) -> npt.NDArray[np.uint32]:
    """Returns the distances in millimetres.

    Raises `LidarError` for distances below 1 mm or above `largest` mm.
    """
    counts = np.rint(distances * 1000.0)
    if len(counts) and (counts.max() > largest or counts.min() < 1):
        raise LidarError(
            f"distances are {counts.min() / 1000:g} to {counts.max() / 1000:g} m; Ouster's packets support "
            f"0.001 to {largest / 1000:g} m",
            code="cannot_write",
        )
    return counts.astype(np.uint32)


def save_ouster_packets(
    path: Path,
    columns: Mapping[str, npt.NDArray[Any]],
    metadata: Mapping[str, Any],
    returns: str,
    near_ir_gain: float,
) -> None:
    """Writes the packets to `path`, and the metadata to the same name with .json.

    Decoders require the metadata.

    `near_ir_gain` is the number of counts for a radiance of 1 W/(m² sr) in the field `near_ir`, if present.

    Raises `LidarError` for returns other than "strongest", "last" and "dual", and if the .json file exists and was not
    written by raycam.
    """
    if returns not in ("strongest", "last", "dual"):
        raise LidarError(
            f"Ouster's packets do not support returns={returns!r}; supported: strongest, last, dual",
            code="cannot_write",
        )
    beside = path.with_suffix(".json")
    if beside.exists() and not _is_own(beside):
        raise LidarError(
            f"{path}: the packets require the metadata {beside.name}, but this file exists and was not written by "
            "raycam; save the packets under another name",
            code="cannot_write",
        )
    layout = dict(metadata["lidar_data_format"])
    shape = (layout["pixels_per_column"], layout["columns_per_frame"])
    encode = ouster_packets
    if returns == "dual":
        encode, layout["udp_profile_lidar"] = ouster_dual_packets, DUAL_PROFILE
    counts: Any = near_ir_counts(columns["near_ir"], near_ir_gain) if "near_ir" in columns else 0
    packets = encode(columns, shape, float(layout["fps"]), near_ir=counts)
    own = {**metadata, "lidar_data_format": layout, "user_data": MARK}
    write(beside, json.dumps(own, indent=1).encode())
    write(path, pcap_file(packets, PORT))


def _is_own(path: Path) -> bool:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(found, dict) and found.get("user_data") == MARK
