"""Velodyne's data packets, as a capture file (PCAP) of UDP.

Sources: VLP-16 User Manual 63-9243, section 9.3; VLP-32C User Manual 63-9325, section 9.3; HDL-64E S2 User's Manual,
appendix E. With two returns, the blocks are in the order that velodyne-decoder 3.1 expects.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...errors import LidarError
from .pcap import pcap_file

__all__ = ["Firings", "pcap_bytes", "velodyne_packets"]

BLOCKS = 12
"""Blocks of 32 channels in a packet."""
CHANNELS = 32
PRODUCTS = {"vlp16": 0x22, "puck-hires": 0x24, "vlp32c": 0x28, "hdl32e": 0x21, "vls128": 0xA1, "hdl64e": 0}
"""The last byte of a packet, by device. The last two bytes of an HDL-64E are a status instead: see `_tail`."""
FLAGS = (0xEEFF, 0xDDFF, 0xCCFF, 0xBBFF)
"""The first bytes of blocks: of lasers 0 to 31, 32 to 63, and so on."""
RETURN_MODES = {"strongest": 0x37, "last": 0x38, "dual": 0x39}
CHANNEL = np.dtype([("distance", "<u2"), ("intensity", "u1")])
BLOCK = np.dtype([("flag", "<u2"), ("azimuth", "<u2"), ("channels", CHANNEL, CHANNELS)])
PORT = 2368
MICROSECONDS_PER_HOUR = 3_600_000_000


@dataclass(frozen=True)
class Firings:
    """The data that packets require: the lidar's name, return mode and pulse times."""

    device: str
    returns: str
    rate: float
    cycle: float
    """Time in seconds from one firing cycle to the next."""
    step: float
    """The unit of distances in the packets, in metres."""
    shape: tuple[int, int]
    """The numbers of lasers and of firing cycles in a frame."""


def pcap_bytes(columns: Mapping[str, npt.NDArray[Any]], firings: Firings, start: float = 0.0) -> bytes:
    """Returns a PCAP file with the packets of a frame that starts at `start` seconds."""
    return pcap_file(velodyne_packets(columns, firings, start), PORT)


def velodyne_packets(
    columns: Mapping[str, npt.NDArray[Any]], firings: Firings, start: float = 0.0
) -> list[tuple[float, bytes]]:
    """Returns the times in seconds and the 1206 bytes of the packets of a frame.

    `start` is the frame's start in seconds. A distance of 0 is a pulse without a point. The last packet is filled
    with empty cycles. With two returns, each cycle has two blocks: the last echo, then the strongest; a single echo
    is written twice. Raises `LidarError` for devices and modes without packets, and for distances beyond 16 bits.
    """
    _check(firings)
    lasers, cycles = firings.shape
    if lasers > CHANNELS:
        return _packets_of_banks(columns, firings, start)
    per_block = CHANNELS // lasers  # firing cycles per block: 2 for 16 lasers
    layers = _layers(columns, firings)
    blocks_per_turn = -(-cycles // per_block)
    group = BLOCKS // len(layers)
    total = -(-blocks_per_turn // group) * group
    blocks = np.zeros((total, len(layers)), BLOCK)
    turn = 36000.0 * firings.rate * firings.cycle * per_block  # hundredths of a degree per block
    blocks["flag"] = 0xEEFF
    blocks["azimuth"] = (np.rint(np.arange(total) * turn) % 36000).astype(np.uint16)[:, None]
    for layer, (distance, intensity) in enumerate(layers):
        padding = total * per_block - cycles
        for name, values in (("distance", distance), ("intensity", intensity)):
            filled = np.concatenate([values, np.zeros((padding, lasers), values.dtype)])
            blocks["channels"][name][:, layer] = filled.reshape(total, CHANNELS)
    tail = _tail(firings)
    packets = []
    for number, part in enumerate(blocks.reshape(-1, BLOCKS)):
        time = start + number * group * per_block * firings.cycle
        stamp = round(time * 1e6) % MICROSECONDS_PER_HOUR
        packets.append((time, part.tobytes() + struct.pack("<I", stamp) + tail))
    return packets


def _packets_of_banks(
    columns: Mapping[str, npt.NDArray[Any]], firings: Firings, start: float
) -> list[tuple[float, bytes]]:
    """Returns the packets of a device with more than 32 lasers.

    A cycle of the device has a block for each group of 32 lasers. With two returns, the blocks of an HDL-64E
    begin with all blocks of the strongest return, followed by the last return. The blocks of a VLS-128
    alternate, beginning with the last return, and the last four blocks of its packets are empty.
    """
    lasers, cycles = firings.shape
    banks = lasers // CHANNELS
    layers = _layers(columns, firings)
    group = BLOCKS // (banks * len(layers))
    total = -(-cycles // group) * group
    blocks = np.zeros((total, banks, len(layers)), BLOCK)
    blocks["flag"] = np.array(FLAGS[:banks])[:, None]
    turn = 36000.0 * firings.rate * firings.cycle  # hundredths of a degree per cycle
    azimuths = (np.rint(np.arange(total) * turn) % 36000).astype(np.uint16)
    blocks["azimuth"] = azimuths[:, None, None]
    for layer, (distance, intensity) in enumerate(layers):
        for name, values in (("distance", distance), ("intensity", intensity)):
            blocks["channels"][name][:cycles, :, layer] = values.reshape(cycles, banks, CHANNELS)
    if firings.device == "hdl64e":
        blocks = blocks[:, :, ::-1].swapaxes(1, 2)
    filled = np.zeros((total // group, BLOCKS), BLOCK)
    filled["azimuth"] = azimuths[::group, None]
    own = blocks.reshape(total // group, -1)
    filled[:, : own.shape[1]] = own
    tail = _tail(firings)
    packets = []
    for number, part in enumerate(filled):
        time = start + number * group * firings.cycle
        stamp = round(time * 1e6) % MICROSECONDS_PER_HOUR
        packets.append((time, part.tobytes() + struct.pack("<I", stamp) + tail))
    return packets


def _tail(firings: Firings) -> bytes:
    """Returns the last two bytes of a packet.

    The bytes are the return mode and the device, or the status of an HDL-64E (firmware version 0).
    """
    if firings.device == "hdl64e":
        return b"V\0"
    return struct.pack("<BB", RETURN_MODES[firings.returns], PRODUCTS[firings.device])


def _check(firings: Firings) -> None:
    if firings.device not in PRODUCTS:
        raise LidarError(
            f"{firings.device}: packets are not supported; supported devices: {', '.join(PRODUCTS)}",
            code="wrong_device",
        )
    if firings.returns not in RETURN_MODES:
        raise LidarError(
            f"{firings.device}: packets do not support returns={firings.returns!r}; supported: "
            f"{', '.join(RETURN_MODES)}",
            code="cannot_write",
        )


def _layers(
    columns: Mapping[str, npt.NDArray[Any]], firings: Firings
) -> list[tuple[npt.NDArray[np.uint16], npt.NDArray[np.uint8]]]:
    """Returns distances and intensities [cycles, lasers] of each block of a cycle."""
    lasers, cycles = firings.shape
    kept = columns["lost"] == 0
    counts = np.rint(columns["distance"][kept] / firings.step)
    if len(counts) and (counts.max() > 65535 or counts.min() < 1):
        raise LidarError(
            f"distances are {columns['distance'][kept].min():g} to {columns['distance'][kept].max():g} m; packets "
            "support "
            f"{firings.step:g} to {65535 * firings.step:g} m",
            code="cannot_write",
        )
    at = (columns["column"][kept], columns["laser"][kept])
    energy = np.asarray(columns["reflectivity"][kept], float) / np.square(columns["distance"][kept])
    number, intensity = columns["return"][kept], columns["intensity"][kept]

    def layer(order: Floats) -> tuple[npt.NDArray[np.uint16], npt.NDArray[np.uint8]]:
        distance, strength = np.zeros((cycles, lasers), np.uint16), np.zeros((cycles, lasers), np.uint8)
        rows = np.argsort(order, kind="stable")  # later rows replace earlier rows
        where = (at[0][rows], at[1][rows])
        distance[where], strength[where] = counts[rows], intensity[rows]
        return distance, strength

    if firings.returns != "dual":
        return [layer(number)]
    last, strongest = layer(number), layer(energy)
    same = (last[0] == strongest[0]) & (last[0] > 0)
    if same.any():
        # If the last echo is the strongest, the second block contains the second strongest echo. With at most two
        # echoes per pulse, this is the first echo.
        first = layer(-number)
        strongest = (np.where(same, first[0], strongest[0]), np.where(same, first[1], strongest[1]))
    return [last, strongest]
