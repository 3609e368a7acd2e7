"""Capture files (PCAP) of UDP packets.

Source: the Wireshark project, "Libpcap File Format".
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

__all__ = ["pcap_file"]

HEADER_SIZE = 42
"""Bytes of the Ethernet, IP and UDP headers."""
LARGEST = 65535
"""Bytes of a packet that a file may contain."""


def pcap_file(packets: Iterable[tuple[float, bytes]], port: int) -> bytes:
    """Returns a PCAP file of UDP packets that are sent to `port`.

    Each packet is given by its time in seconds and its contents.
    """
    pieces = [struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, LARGEST, 1)]
    for stamp, data in packets:
        micros = round(stamp * 1e6)
        size = HEADER_SIZE + len(data)
        pieces.append(struct.pack("<IIII", micros // 1_000_000, micros % 1_000_000, size, size))
        pieces.append(_udp_header(len(data), port) + data)
    return b"".join(pieces)


def _udp_header(size: int, port: int) -> bytes:
    """Returns Ethernet, IPv4 and UDP headers from 192.168.1.201 to the broadcast address."""
    ethernet = b"\xff" * 6 + bytes.fromhex("607688000000") + b"\x08\x00"
    fields = (0x45, 0, 28 + size, 0, 0x4000, 255, 17, 0, bytes([192, 168, 1, 201]), b"\xff" * 4)
    ip = struct.pack(">BBHHHBBH4s4s", *fields)
    words = sum(struct.unpack(">10H", ip))
    words = (words & 0xFFFF) + (words >> 16)
    check = ~((words & 0xFFFF) + (words >> 16)) & 0xFFFF
    ip = ip[:10] + struct.pack(">H", check) + ip[12:]
    return ethernet + ip + struct.pack(">HHHH", port, port, 8 + size, 0)
