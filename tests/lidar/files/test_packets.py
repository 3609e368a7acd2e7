"""Velodyne's packets, decoded by velodyne-decoder and by the equations of the ROS driver."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import raycam
import yaml
from raycam.lidar.velodyne import Laser
from support.velodyne_driver import driver_point

decoder = pytest.importorskip("velodyne_decoder", reason="no wheel for this machine")

MODELS = {
    "vlp16": "VLP16",
    "puck-hires": "PuckHiRes",
    "vlp32c": "VLP32C",
    "hdl32e": "HDL32E",
}


@pytest.fixture(scope="module")
def hall() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [40, 60, 20]}, name="hall", color=[0.5] * 3)
    world.add_object(box={"size": [2, 3, 5]}, name="box", location=[10, 5, -2], yaw=20, color=[0.5] * 3)
    return world


def decode(path: Path, model: str) -> np.ndarray:
    """Rows x, y, z, intensity, time, column, ring, return type of all frames in a file."""
    config = decoder.Config(model=getattr(decoder.Model, model), min_range=0, max_range=300)
    return np.concatenate([points for _, points in decoder.read_pcap(path, config)])


@pytest.mark.parametrize("name", list(MODELS))
@pytest.mark.parametrize("rate", [10.0, 20.0])
def test_decoded_points_equal_the_scan(name: str, rate: float, hall: raycam.World, tmp_path: Path) -> None:
    """The points differ by at most the resolution of the packets.

    This is 2 or 4 mm, twice 0.01 degrees (rotor and correction), and 1 microsecond.
    """
    lidar = raycam.Lidar(name, rate=rate, range_noise=0.02).placed([3, 2, 1], yaw=10)
    scan = raycam.scan(hall, lidar)
    scan.save(tmp_path / "scan.pcap")
    found = decode(tmp_path / "scan.pcap", MODELS[name])
    # The decoder starts a frame where the azimuth passes 0, which is the first column of a scan.
    assert len(found) == scan.count
    time = found[:, 4]
    order = np.lexsort((found[:, 6], np.round(time - time.min(), 6)))
    expected = np.lexsort((scan["ring"], np.round(scan["time"], 6)))
    apart = np.linalg.norm(scan["position"][expected] - found[order, :3], axis=1)
    distance = scan["distance"][expected]
    assert (apart <= np.radians(0.025) * distance + 0.004).all()
    points = scan["position"][expected]
    elevation = np.degrees(np.arcsin(points[:, 2] / np.linalg.norm(points, axis=1)))
    found_elevation = np.degrees(np.arcsin(found[order, 2] / np.linalg.norm(found[order, :3], axis=1)))
    assert np.abs(elevation - found_elevation).max() < 0.002
    assert np.median(apart / distance) < np.radians(0.012)
    shift = scan["time"][expected] - found[order, 4]
    assert np.ptp(shift) < 1.1e-6
    np.testing.assert_array_equal(scan["ring"][expected], found[order, 6])
    np.testing.assert_array_equal(scan["intensity"][expected], found[order, 3])


def test_packets_of_a_vls128_are_decoded(hall: raycam.World, tmp_path: Path) -> None:
    """The decoder uses the firing times of later firmware.

    They differ by at most 15 us, which is 0.055 degrees at 10 Hz.
    """
    lidar = raycam.Lidar("vls128", noise=False).placed([3, 2, 1], yaw=10)
    scan = raycam.scan(hall, lidar)
    scan.save(tmp_path / "scan.pcap")
    found = decode(tmp_path / "scan.pcap", "VLS128")
    assert len(found) == scan.count
    order = np.lexsort((found[:, 6], found[:, 5]))
    expected = np.lexsort((scan["ring"], scan["column"]))
    np.testing.assert_array_equal(scan["ring"][expected], found[order, 6])
    np.testing.assert_array_equal(scan["column"][expected], found[order, 5])
    np.testing.assert_array_equal(scan["intensity"][expected], found[order, 3])
    measured = np.linalg.norm(found[order, :3], axis=1)
    np.testing.assert_allclose(measured, np.linalg.norm(scan["position"][expected], axis=1), atol=0.003)
    apart = np.linalg.norm(scan["position"][expected] - found[order, :3], axis=1)
    angle = np.degrees(apart / scan["distance"][expected])
    assert np.quantile(angle, 0.999) < 0.06
    # The decoder estimates the rotor's speed, and the estimate is less accurate in the first packets.
    assert angle.max() < 0.2
    assert np.ptp(scan["time"][expected] - found[order, 4]) < 1.6e-5


def packets_of(path: Path) -> list[bytes]:
    """The contents of the UDP packets in a capture file."""
    data, at, found = path.read_bytes(), 24, []
    while at < len(data):
        size = struct.unpack_from("<IIII", data, at)[2]
        found.append(data[at + 16 + 42 : at + 16 + size])
        at += 16 + size
    return found


def calibration_file(name: str, folder: Path, flat: bool) -> Path:
    """One of the decoder's calibrations; `flat`: without offsets and two-point corrections."""
    source = Path(decoder.__file__).parent / "calibrations" / f"{name}.yml"
    table = yaml.safe_load(source.read_text(encoding="utf-8"))
    for laser in table["lasers"] if flat else ():
        laser["vert_offset_correction"] = laser["horiz_offset_correction"] = 0.0
        laser["dist_correction_x"] = laser["dist_correction_y"] = laser["dist_correction"]
    path = folder / "unit.yaml"
    path.write_text(yaml.safe_dump(table), encoding="utf-8")
    return path


@pytest.mark.parametrize("unit", ["HDL-64E_S2.1-sztaki", "HDL-64E_S3-VeloView"])
@pytest.mark.parametrize("flat", [True, False])
def test_packets_of_an_hdl64e_are_decoded(unit: str, flat: bool, hall: raycam.World, tmp_path: Path) -> None:
    """Points differ by the packets' resolution, or by centimetres with certain corrections.

    These corrections are offsets and two-point corrections, which velodyne-decoder applies differently since
    version 3: it adds vertical offsets along z, and corrects z by the mean of x and y, up to 25.04 m. The ROS
    driver rotates the offsets with the beam and corrects z like y; raycam agrees with the driver.
    """
    path = calibration_file(unit, tmp_path, flat)
    lidar = raycam.load_lidar(path, "hdl64e", min_range=0).placed([3, 2, 1], yaw=10)
    scan = raycam.scan(hall, lidar)
    scan.save(tmp_path / "scan.pcap")
    config = decoder.Config(
        model=decoder.Model.HDL64E_S2,
        calibration=decoder.Calibration.read(str(path)),
        min_range=0,
        max_range=300,
    )
    found = np.concatenate([points for _, points in decoder.read_pcap(tmp_path / "scan.pcap", config)])
    assert len(found) == scan.count > 100_000
    time = found[:, 4] - found[:, 4].min()
    order = np.lexsort((found[:, 6], np.round(time * 1e6)))
    expected = np.lexsort((scan["ring"], np.round(scan["time"] * 1e6)))
    np.testing.assert_array_equal(found[order, 6], scan["ring"][expected])
    np.testing.assert_allclose(time[order], scan["time"][expected], atol=1e-7)
    points = scan["position"][expected]
    apart = np.linalg.norm(found[order, :3] - points, axis=1)
    # The decoder measures the rotor's speed from the azimuths of a packet, in steps of 0.01 degrees.
    steps = np.radians(0.03) * np.linalg.norm(points, axis=1) + 0.002
    if flat:
        assert (apart <= steps).all()
    else:
        assert 0.05 < apart.max() < 0.12


@pytest.mark.parametrize("unit", ["HDL-64E_S2.1-sztaki", "HDL-64E_S3-VeloView"])
def test_packets_of_an_hdl64e_are_decoded_as_by_the_driver(
    unit: str, hall: raycam.World, tmp_path: Path
) -> None:
    path = calibration_file(unit, tmp_path, flat=False)
    rows = yaml.safe_load(path.read_text(encoding="utf-8"))["lasers"]
    names = [name for name in Laser.__dataclass_fields__ if name != "height"]
    lasers = {row["laser_id"]: Laser(**{name: row[name] for name in names if name in row}) for row in rows}
    lidar = raycam.load_lidar(path, "hdl64e", min_range=0).placed([3, 2, 1], yaw=10)
    scan = raycam.scan(hall, lidar)
    scan.save(tmp_path / "scan.pcap")
    at = {
        (column, laser): row
        for row, (column, laser) in enumerate(
            zip(scan["column"].tolist(), scan["laser"].tolist(), strict=True)
        )
    }
    fired = scan["time"] - scan["column"] * 48e-6
    compared = 0
    for number, packet in list(enumerate(packets_of(tmp_path / "scan.pcap")))[::20]:
        assert len(packet) == 1206
        assert packet[1204:] == b"V\0"
        for block in range(12):
            flag, azimuth = struct.unpack_from("<HH", packet, 100 * block)
            bank = {0xEEFF: 0, 0xDDFF: 32}[flag]
            assert bank == 32 * (block % 2)
            for channel in range(32):
                raw = struct.unpack_from("<H", packet, 100 * block + 4 + 3 * channel)[0]
                row = at.get((6 * number + block // 2, bank + channel))
                assert (raw > 0) == (row is not None)
                if row is not None:
                    angle = np.radians(azimuth / 100 + 3600 * fired[row])
                    point = driver_point(lasers[bank + channel], angle, 0.002 * raw)
                    limit = np.radians(0.0051) * scan["distance"][row] + 0.0011
                    assert np.linalg.norm(scan["position"][row] - point) <= limit
                    compared += 1
    assert compared > 5000


def test_two_returns_are_decoded_as_the_strongest_and_the_last(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [60, 60, 30]}, name="hall", color=[0.5] * 3)
    screen = {"opacity": 0.5, "alpha": "blend"}
    world.add_object(box={"size": [20, 20, 20]}, name="screen", color=[0.5] * 3, **screen)
    lidar = raycam.Lidar("vlp16", returns="dual", range_noise=0).placed([0, 0, 0])
    scan = raycam.scan(world, lidar)
    assert (scan["returns"] == 2).any()
    scan.save(tmp_path / "dual.pcap")
    found = decode(tmp_path / "dual.pcap", "VLP16")
    both = set(np.unique(found[:, 7]))
    assert len(both) > 1
    measured = np.sort(np.linalg.norm(found[:, :3], axis=1))
    expected = np.sort(np.linalg.norm(scan["position"], axis=1))
    assert len(measured) == len(expected)
    np.testing.assert_allclose(measured, expected, atol=0.003)


@pytest.fixture
def screened() -> raycam.World:
    """A hall around a box whose surface returns half of the light."""
    world = raycam.World()
    world.add_object(box={"size": [60, 60, 30]}, name="hall", color=[0.5] * 3)
    screen = {"opacity": 0.5, "alpha": "blend"}
    world.add_object(box={"size": [20, 20, 20]}, name="screen", location=[2, 0, 0], color=[0.5] * 3, **screen)
    return world


def compare_two_returns(found: np.ndarray, scan: raycam.Scan) -> None:
    """Compares both returns of every pulse: columns, rings and distances."""
    assert (scan["returns"] == 2).sum() > 50_000
    assert len(np.unique(found[:, 7])) > 1
    measured = np.linalg.norm(found[:, :3], axis=1)
    expected = np.linalg.norm(scan["position"], axis=1)
    assert len(measured) == len(expected)
    order = np.lexsort((measured, found[:, 6], found[:, 5]))
    own = np.lexsort((expected, scan["ring"], scan["column"]))
    np.testing.assert_array_equal(found[order, 5], scan["column"][own])
    np.testing.assert_array_equal(found[order, 6], scan["ring"][own])
    np.testing.assert_allclose(measured[order], expected[own], atol=0.004)


def test_two_returns_of_a_vls128_are_decoded(screened: raycam.World, tmp_path: Path) -> None:
    scan = raycam.scan(screened, raycam.Lidar("vls128", returns="dual", noise=False))
    scan.save(tmp_path / "dual.pcap")
    for packet in packets_of(tmp_path / "dual.pcap")[::100]:
        flags = [struct.unpack_from("<H", packet, 100 * block)[0] for block in range(12)]
        assert flags == [0xEEFF] * 2 + [0xDDFF] * 2 + [0xCCFF] * 2 + [0xBBFF] * 2 + [0] * 4
        assert packet[1204] == 0x39
    compare_two_returns(decode(tmp_path / "dual.pcap", "VLS128"), scan)


def test_two_returns_of_an_hdl64e_are_decoded(screened: raycam.World, tmp_path: Path) -> None:
    path = calibration_file("HDL-64E_S2.1-sztaki", tmp_path, flat=True)
    lidar = raycam.load_lidar(path, "hdl64e", min_range=0, returns="dual", noise=False)
    scan = raycam.scan(screened, lidar)
    scan.save(tmp_path / "dual.pcap")
    config = decoder.Config(
        model=decoder.Model.HDL64E_S2,
        calibration=decoder.Calibration.read(str(path)),
        min_range=0,
        max_range=300,
    )
    found = np.concatenate([points for _, points in decoder.read_pcap(tmp_path / "dual.pcap", config)])
    compare_two_returns(found, scan)


def test_packet_has_the_layout_of_the_manual(hall: raycam.World, tmp_path: Path) -> None:
    """The fields of one packet are read by hand.

    A packet has 12 blocks of 100 bytes, a time stamp and two factory bytes.
    """
    lidar = raycam.Lidar("vlp16", noise=False).placed([3, 2, 1])
    scan = raycam.scan(hall, lidar)
    scan.save(tmp_path / "scan.pcap")
    data = io.BytesIO((tmp_path / "scan.pcap").read_bytes())
    assert struct.unpack("<I", data.read(24)[:4])[0] == 0xA1B2C3D4
    _, _, size, _ = struct.unpack("<IIII", data.read(16))
    assert size == 42 + 1206
    packet = data.read(size)[42:]
    for block in range(12):
        flag, azimuth = struct.unpack_from("<HH", packet, 100 * block)
        assert flag == 0xEEFF
        assert azimuth == round(100 * 360 * 10 * 2 * 55.296e-6 * block)
    distances = [struct.unpack_from("<H", packet, 4 + 3 * i)[0] for i in range(32)]
    np.testing.assert_array_equal(distances, np.rint(scan["distance"][:32] / 0.002))
    assert packet[-2:] == b"\x37\x22"
    assert struct.unpack_from("<I", packet, 1200)[0] == 0


@pytest.mark.parametrize(
    ("name", "settings", "code"),
    [
        ("pandar64", {}, "wrong_device"),
        ("vls128", {"returns": "all"}, "cannot_write"),
        ("hdl64e", {"returns": "all"}, "cannot_write"),
        ("vlp16", {"returns": "all"}, "cannot_write"),
        ("vlp16", {"step": 1e-4}, "cannot_write"),
    ],
)
def test_scans_without_packets_are_refused(
    name: str, settings: dict[str, object], code: str, hall: raycam.World, tmp_path: Path
) -> None:
    scan = raycam.scan(hall, raycam.Lidar(name, **settings).placed([3, 2, 1]))  # type: ignore[arg-type]
    with pytest.raises(raycam.LidarError) as caught:
        scan.save(tmp_path / "scan.pcap")
    assert caught.value.code == code
