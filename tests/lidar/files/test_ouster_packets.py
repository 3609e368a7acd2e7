"""Ouster's packets, compared with those that ouster-sdk 1.0.1 encodes."""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

import numpy as np
import pytest
import raycam
from lidar.files.test_packets import packets_of
from raycam.lidar.files.ouster_packets import crc64, ouster_dual_packets, ouster_packets
from support.raises import raises

SDK_PACKETS = "c807fa7da12a44b92177c5950e351041a94e65e9b71151860e40adf323eb9ebf"
"""SHA-256 of the packets of `frame_to_packets` of ouster-sdk 1.0.1 for an OS1-64 in the mode 512x10 with
`SensorInfo.from_default`, RANGE 1000 + 37 row + 11 column, REFLECTIVITY (row + 3 column) mod 256, the other fields 0,
and the time stamps of the columns at 10 Hz. The frame's number and the encoder, which the SDK does not write into each
column, are set to 0."""
SDK_DUAL_PACKETS = "d867b60470d74cd8f1f1e21d83b0fc6f9dcb3a3d4d13980ea601b52dee95f72a"
"""SHA-256 of such packets of the profile RNG19_RFL8_SIG16_NIR16_DUAL, including headers and check sums, for frame 1.

Two thirds of the pixels have RANGE2 2000 + 37 row + 11 column and REFLECTIVITY2 (2 row + column) mod 256.
"""


def test_packets_equal_those_of_ouster_sdk() -> None:
    row, column = (each.ravel() for each in np.mgrid[:64, :512])
    columns = {
        "lost": np.zeros(len(row), np.int8),
        "distance": (1000 + 37 * row + 11 * column) / 1000.0,
        "intensity": ((row + 3 * column) % 256).astype(np.uint8),
        "signal": np.zeros(len(row), np.uint16),
        "laser": row,
        "column": column,
    }
    packets = ouster_packets(columns, (64, 512), 10.0)
    np.testing.assert_allclose([time for time, _ in packets], np.arange(32) / 320)
    table = np.frombuffer(b"".join(data for _, data in packets), np.uint8).reshape(512, 788).copy()
    encoder = table[:, 12:16].copy().view("<u4").ravel()
    np.testing.assert_array_equal(encoder, np.arange(512) * 176)
    table[:, 10:16] = 0
    assert hashlib.sha256(table.tobytes()).hexdigest() == SDK_PACKETS


def test_packets_with_two_returns_equal_those_of_ouster_sdk() -> None:
    row, column = (each.ravel() for each in np.mgrid[:64, :512])
    both = np.flatnonzero((row + column) % 3 != 0)
    distance = (1000 + 37 * row + 11 * column) / 1000.0
    columns = {
        "lost": np.zeros(len(row) + len(both), np.int8),
        "distance": np.concatenate([1.0 + distance[both], distance]),
        "reflectivity": np.concatenate([np.full(len(both), 0.1), np.ones(len(row))]),
        "intensity": np.concatenate([(2 * row + column)[both] % 256, (row + 3 * column) % 256]).astype(
            np.uint8
        ),
        "signal": np.zeros(len(row) + len(both), np.uint16),
        "laser": np.concatenate([row[both], row]),
        "column": np.concatenate([column[both], column]),
    }
    packets = ouster_dual_packets(columns, (64, 512), 10.0)
    np.testing.assert_allclose([time for time, _ in packets], np.arange(32) / 320)
    assert hashlib.sha256(b"".join(data for _, data in packets)).hexdigest() == SDK_DUAL_PACKETS


def test_checksum_equals_the_catalogue_value() -> None:
    """The check value of CRC-64/XZ in the catalogue of parametrised CRC algorithms (G. Cook)."""
    text = np.frombuffer(b"123456789", np.uint8)
    assert crc64(np.stack([text, text])).tolist() == [0x995DC9BBDF1939FA] * 2


def test_saved_packets_with_two_returns_have_the_strongest_first(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [60, 60, 30]}, name="hall", color=[0.5] * 3)
    screen = {"opacity": 0.2, "alpha": "blend"}
    world.add_object(box={"size": [50, 50, 20]}, name="screen", color=[0.5] * 3, **screen)
    scan = raycam.scan(world, raycam.Lidar("os1-16", mode="512x10", returns="dual", noise=False))
    scan.save(tmp_path / "dual.pcap")
    ranges = np.zeros((2, 16, 512))
    for packet in packets_of(tmp_path / "dual.pcap"):
        columns = np.frombuffer(packet, np.uint8)[32:-32].reshape(16, 12 + 16 * 16)
        number = columns[:, 8:10].copy().view("<u2").ravel()
        pixels = columns[:, 12:].copy().view("<u4").reshape(16, 16, 4)
        for echo in range(2):
            ranges[echo][:, number] = (pixels[..., echo] & 0x7FFFF).T / 1000
    energy = scan["reflectivity"] / scan["distance"] ** 2
    near, far = ((scan["returns"] == 2) & (scan["return"] == at) for at in (0, 1))
    assert near.sum() > 5000
    assert (energy[near] < energy[far]).all()
    for at, echo in enumerate((near, far)):
        found = ranges[1 - at, scan["laser"][echo], scan["column"][echo]]
        np.testing.assert_allclose(found, scan["distance"][echo], atol=0.00051)
    unit = json.loads((tmp_path / "dual.json").read_text(encoding="utf-8"))
    assert unit["lidar_data_format"]["udp_profile_lidar"] == "RNG19_RFL8_SIG16_NIR16_DUAL"
    assert raycam.load_lidar(tmp_path / "dual.json").settings["mode"] == "512x10"


@pytest.mark.parametrize(("name", "mode"), [("os1-16", "512x10"), ("os1-128", "1024x20")])
def test_saved_packets_have_the_ranges_of_the_scan_and_the_metadata_of_the_unit(
    name: str, mode: str, tmp_path: Path
) -> None:
    world = raycam.World()
    world.add_object(box={"size": [40, 60, 20]}, name="hall", color=[0.5] * 3)
    lidar = raycam.Lidar(name, mode=mode).placed([3, 2, 1])
    scan = raycam.scan(world, lidar)
    scan.save(tmp_path / "scan.pcap")
    rows, count = scan.pattern.shape
    ranges = np.zeros((rows, count))
    for packet in packets_of(tmp_path / "scan.pcap"):
        size = 16 + 12 * rows + 4
        assert len(packet) == 16 * size
        for start in range(0, len(packet), size):
            time, number = struct.unpack_from("<QH", packet, start)
            assert time == round(number / (count * lidar.rate) * 1e9)
            pixels = np.frombuffer(packet, "<u4", 3 * rows, start + 16).reshape(rows, 3)
            ranges[:, number] = pixels[:, 0] / 1000
    np.testing.assert_allclose(ranges[scan["laser"], scan["column"]], scan["distance"], atol=1e-9)
    assert np.count_nonzero(ranges) == scan.count
    unit = raycam.load_lidar(tmp_path / "scan.json")
    for field in ("directions", "origins", "times"):
        np.testing.assert_array_equal(getattr(unit.pattern(), field), getattr(lidar.pattern(), field))
    assert unit.settings["mode"] == mode
    assert unit.pixel_shifts(count) == lidar.pixel_shifts(count)


def test_metadata_of_other_programs_is_not_replaced(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [40, 60, 20]}, name="hall", color=[0.5] * 3)
    scan = raycam.scan(world, raycam.Lidar("os1-16", mode="512x10"))
    (tmp_path / "scan.json").write_text(json.dumps({"beam_intrinsics": {}}), encoding="utf-8")
    with raises(raycam.LidarError, code="cannot_write", mentions=["scan.json"]):
        scan.save(tmp_path / "scan.pcap")
    assert json.loads((tmp_path / "scan.json").read_text(encoding="utf-8")) == {"beam_intrinsics": {}}
    for _ in range(2):
        scan.save(tmp_path / "other.pcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.json", "other.pcap", "scan.json"]


def test_packets_of_all_returns_or_large_distances_are_refused(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [4000, 60, 20]}, name="hall", color=[0.5] * 3)
    lidar = raycam.Lidar("os1-16", mode="512x10")
    far = lidar.replace(range_10=1e6, max_range=1e6)
    large = far.replace(returns="dual")
    for one, code in (
        (lidar.replace(returns="all"), "cannot_write"),
        (far, "cannot_write"),
        (large, "cannot_write"),
    ):
        with raises(raycam.LidarError, code=code):
            raycam.scan(world, one).save(tmp_path / "scan.pcap")
    assert not list(tmp_path.iterdir())
    with raises(raycam.LidarError, code="wrong_device", mentions=["vlp16"]):
        raycam.Lidar("vlp16").metadata  # noqa: B018


def test_packets_contain_signal_and_near_infrared(tmp_path: Path) -> None:
    """The values are at bytes 6 and 8 of the 12 bytes of a pixel in LEGACY packets.

    With two returns, they are at bytes 8, 10 and 12 of 16 bytes.
    """
    world = raycam.World()
    world.add_object(box={"size": [60, 60, 30]}, name="hall", color=[0.5] * 3)
    world.add_object(box={"size": [50, 50, 20]}, name="screen", color=[0.5] * 3, opacity=0.2, alpha="blend")
    world.add_light("sky", radiance=7.0)
    lidar = raycam.Lidar("os1-16", mode="512x10", noise=False, near_ir_samples=2, near_ir_gain=10)
    scan = raycam.scan(world, lidar)
    assert (scan["near_ir"] > 0).any()
    scan.save(tmp_path / "one.pcap")
    signal, near_ir = scan.image("signal"), np.rint(scan.image("near_ir") * 10)
    data = np.frombuffer(b"".join(packets_of(tmp_path / "one.pcap")), np.uint8).reshape(512, 20 + 16 * 12)
    pixels = data[:, 16:-4].reshape(512, 16, 12)
    np.testing.assert_array_equal(pixels[..., 6:8].copy().view("<u2")[..., 0].T, signal)
    np.testing.assert_array_equal(pixels[..., 8:10].copy().view("<u2")[..., 0].T, near_ir)
    both = raycam.scan(world, lidar.replace(returns="dual"))
    both.save(tmp_path / "dual.pcap")
    data = np.stack([np.frombuffer(p, np.uint8)[32:-32] for p in packets_of(tmp_path / "dual.pcap")])
    pixels = data.reshape(512, 12 + 16 * 16)[:, 12:].reshape(512, 16, 16)
    strongest = np.maximum(both.image("signal"), both.image("signal", echo=1))
    weakest = np.minimum(both.image("signal"), both.image("signal", echo=1))
    for first, expected in ((8, strongest), (10, weakest), (12, near_ir)):
        np.testing.assert_array_equal(pixels[..., first : first + 2].copy().view("<u2")[..., 0].T, expected)
