"""Files of point clouds, read back with the libraries that people use."""

from __future__ import annotations

import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
import raycam
import trimesh
from pyarrow import feather
from pypcd4 import PointCloud
from support.raises import raises


@pytest.fixture(scope="module")
def scan(yard: raycam.World) -> raycam.Scan:
    lidar = raycam.Lidar("vlp16", returns="dual", beam_samples=7, beam_divergence=3e-3)
    return raycam.scan(yard, lidar.placed([0, 0, 1.8], yaw=30))


def test_pcd_is_read_by_pypcd4(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "scan.pcd")
    cloud = PointCloud.from_path(tmp_path / "scan.pcd")
    assert cloud.fields == ("x", "y", "z", "intensity", "ring", "time", "return", "instance", "category")
    data = cloud.pc_data
    for i, axis in enumerate("xyz"):
        np.testing.assert_array_equal(data[axis], scan["position"][:, i].astype(np.float32))
    for name in ("intensity", "ring", "time", "return", "instance", "category"):
        np.testing.assert_array_equal(data[name], scan[name])


def test_text_pcd_restores_every_bit(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "text.pcd", text=True, fields=["time", "intensity", "normal"])
    scan.save(tmp_path / "binary.pcd", fields=["time", "intensity", "normal"])
    assert b"DATA ascii" in (tmp_path / "text.pcd").read_bytes()
    text, binary = (PointCloud.from_path(tmp_path / f"{name}.pcd") for name in ("text", "binary"))
    assert text.fields == binary.fields
    for name in text.fields:
        np.testing.assert_array_equal(text.pc_data[name], binary.pc_data[name])
    with raises(raycam.LidarError, code="cannot_write", mentions=[".ply", ".pcd"]):
        scan.save(tmp_path / "scan.ply", text=True)


def test_compressed_pcd_is_read_by_pypcd4(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "small.pcd", compress=True)
    scan.save(tmp_path / "plain.pcd")
    assert b"DATA binary_compressed" in (tmp_path / "small.pcd").read_bytes()[:400]
    assert (tmp_path / "small.pcd").stat().st_size < 0.8 * (tmp_path / "plain.pcd").stat().st_size
    small, plain = (PointCloud.from_path(tmp_path / f"{name}.pcd") for name in ("small", "plain"))
    assert small.fields == plain.fields
    np.testing.assert_array_equal(small.pc_data, plain.pc_data)
    with raises(raycam.LidarError, code="conflicting_values"):
        scan.save(tmp_path / "scan.pcd", text=True, compress=True)
    with raises(raycam.LidarError, code="cannot_write", mentions=[".csv", ".laz"]):
        scan.save(tmp_path / "scan.csv", compress=True)


def test_scan_angles_of_las_are_angles_from_straight_down(yard: raycam.World, tmp_path: Path) -> None:
    """The lidar faces along y; its beams meet the ground right of it, below it and left of it."""
    ways = [[0, -1, -1], [0, 0, -1], [0.5, 1, -1], [1, 0, 0]]
    lidar = raycam.Lidar.of(ways, noise=False).placed([0, -10, 3], yaw=90)
    scan = raycam.scan(yard, lidar)
    scan.save(tmp_path / "scan.las")
    las = laspy.read(tmp_path / "scan.las")
    tilted = np.degrees(np.arctan(np.sqrt(1.25)))
    np.testing.assert_allclose(las.scan_angle * 0.006, [45, 0, -tilted], atol=0.004)


def test_waveforms_are_numbered_columns(yard: raycam.World, tmp_path: Path) -> None:
    lidar = raycam.Lidar.of([[0, 0, -1.0]], noise=False, waveform=True).placed([0, 0, 3])
    scan = raycam.scan(yard, lidar)
    scan.save(tmp_path / "scan.csv", fields=["waveform", "signal", "radial_velocity"])
    table = np.genfromtxt(tmp_path / "scan.csv", delimiter=",", names=True)
    found = [float(table[f"waveform_{i}"]) for i in range(65)]
    np.testing.assert_array_equal(np.float32(found), scan["waveform"][0])


def test_laz_has_the_points_of_las(
    scan: raycam.Scan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan.save(tmp_path / "scan.las")
    scan.save(tmp_path / "scan.laz")
    assert (tmp_path / "scan.laz").stat().st_size < (tmp_path / "scan.las").stat().st_size
    plain, packed = laspy.read(tmp_path / "scan.las"), laspy.read(tmp_path / "scan.laz")
    np.testing.assert_array_equal(plain.points.array, packed.points.array)
    monkeypatch.setitem(sys.modules, "lazrs", None)
    with raises(raycam.LidarError, code="missing_dependency", mentions=["raycam[laz]"]):
        scan.save(tmp_path / "other.laz")


def test_ply_is_read_by_trimesh(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "scan.ply", fields=["ring", "normal"])
    cloud = trimesh.load(tmp_path / "scan.ply")
    np.testing.assert_array_equal(cloud.vertices, scan["position"].astype(np.float32))
    vertex = cloud.metadata["_ply_raw"]["vertex"]
    assert list(vertex["properties"]) == ["x", "y", "z", "ring", "normal_x", "normal_y", "normal_z"]
    np.testing.assert_array_equal(vertex["data"]["ring"].reshape(-1), scan["ring"])


def test_las_is_read_by_laspy(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "scan.las", in_world=True)
    las = laspy.read(tmp_path / "scan.las")
    assert (str(las.header.version), las.header.point_format.id) == ("1.4", 6)
    np.testing.assert_allclose(las.xyz, scan.in_world(), atol=0.51e-4)
    np.testing.assert_array_equal(las.return_number, scan["return"] + 1)
    np.testing.assert_array_equal(las.number_of_returns, scan["returns"])
    np.testing.assert_array_equal(las.gps_time, scan["time"])
    np.testing.assert_array_equal(las.intensity, scan["intensity"].astype(int) * 257)
    for name in ("instance", "category", "ring"):
        np.testing.assert_array_equal(las[name], scan[name])
    np.testing.assert_allclose(las.header.mins, las.xyz.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(las.header.maxs, las.xyz.max(axis=0), atol=1e-4)
    assert las.header.number_of_points_by_return[:2].tolist() == [(scan["return"] == i).sum() for i in (0, 1)]


def test_kitti_bin_has_reflectance_from_0_to_1(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "scan.bin")
    rows = np.fromfile(tmp_path / "scan.bin", np.float32).reshape(-1, 4)
    np.testing.assert_array_equal(rows[:, :3], scan["position"].astype(np.float32))
    np.testing.assert_allclose(rows[:, 3], scan["intensity"] / 255, rtol=1e-6)


def test_csv_and_npz_restore_every_bit(scan: raycam.Scan, tmp_path: Path) -> None:
    scan.save(tmp_path / "scan.csv", fields=["time", "ring"])
    table = np.genfromtxt(tmp_path / "scan.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["x"], scan["position"][:, 0])
    np.testing.assert_array_equal(table["time"], scan["time"])
    scan.save(tmp_path / "scan.npz")
    with np.load(tmp_path / "scan.npz") as arrays:
        assert set(arrays) == set(scan)
        for name in scan:
            np.testing.assert_array_equal(arrays[name], scan[name])


def test_feather_has_the_columns_of_argoverse_2(
    scan: raycam.Scan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan.save(tmp_path / "315966070522300000.feather")
    table = feather.read_table(tmp_path / "315966070522300000.feather")
    types = {field.name: str(field.type) for field in table.schema}
    assert types == {
        **dict.fromkeys("xyz", "halffloat"),
        "intensity": "uint8",
        "laser_number": "uint8",
        "offset_ns": "int32",
        "instance": "int32",
        "category": "int32",
    }
    arrays = {name: table[name].to_numpy() for name in types}
    points = np.stack([arrays[axis] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(points, scan["position"].astype(np.float16))
    np.testing.assert_array_equal(arrays["laser_number"], scan["laser"])
    np.testing.assert_allclose(arrays["offset_ns"] * 1e-9, scan["time"], atol=0.6e-9)
    for name in ("intensity", "instance", "category"):
        np.testing.assert_array_equal(arrays[name], scan[name])
    scan.save(tmp_path / "some.feather", fields=["ring", "normal"])
    some = feather.read_table(tmp_path / "some.feather")
    np.testing.assert_array_equal(np.stack(some["normal"].to_pylist()), scan["normal"])
    assert set(some.column_names) == {*"xyz", "intensity", "laser_number", "offset_ns", "ring", "normal"}
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with raises(raycam.LidarError, code="missing_dependency", mentions=["raycam[feather]"]):
        scan.save(tmp_path / "other.feather")


def test_feather_refuses_coordinates_beyond_float16(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [2e5, 2e5, 2e5]}, color=[0.5] * 3)
    scan = raycam.scan(world, raycam.Lidar.of([[1, 0, 0]]))
    with raises(raycam.LidarError, code="cannot_write", mentions=["65504"]):
        scan.save(tmp_path / "a.feather")
    assert not (tmp_path / "a.feather").exists()


@pytest.mark.parametrize("extension", [".pcd", ".ply", ".las", ".csv", ".bin", ".feather"])
def test_lost_pulses_are_not_written(extension: str, yard: raycam.World, tmp_path: Path) -> None:
    lidar = raycam.Lidar("vlp16", noise=False).placed([0, 0, 1.8])
    with_lost, without = (raycam.scan(yard, lidar, keep_lost=keep) for keep in (True, False))
    assert with_lost.count > without.count
    with_lost.save(tmp_path / f"a{extension}")
    without.save(tmp_path / f"b{extension}")
    assert (tmp_path / f"a{extension}").read_bytes() == (tmp_path / f"b{extension}").read_bytes()


@pytest.mark.parametrize("extension", [".pcd", ".ply", ".las", ".csv", ".bin", ".npz", ".feather"])
def test_scan_without_points_is_a_valid_file(extension: str, tmp_path: Path) -> None:
    with pytest.warns(raycam.Notice):
        scan = raycam.scan(raycam.World(), raycam.Lidar("os1-16"))
    scan.save(tmp_path / f"empty{extension}")
    assert (tmp_path / f"empty{extension}").exists()
    if extension == ".las":
        assert len(laspy.read(tmp_path / "empty.las").points) == 0
    if extension == ".pcd":
        assert PointCloud.from_path(tmp_path / "empty.pcd").points == 0


@pytest.mark.parametrize(
    ("name", "fields", "code"),
    [
        ("a.xyz", None, "unknown_format"),
        ("a.pcd", ["rings"], "unknown_name"),
        ("a.pcd", "ring", "wrong_type"),
        ("a.bin", ["ring"], "cannot_write"),
    ],
)
def test_unknown_formats_and_fields_are_refused(
    scan: raycam.Scan, tmp_path: Path, name: str, fields: object, code: str
) -> None:
    with pytest.raises(raycam.LidarError) as caught:
        scan.save(tmp_path / name, fields=fields)  # type: ignore[arg-type]
    assert caught.value.code == code
    assert not (tmp_path / name).exists()
