"""Calibrations of individual devices, and invalid files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import raycam
from scipy.spatial.transform import Rotation
from support.raises import raises, warns

OUSTER = {
    "prod_line": "OS-1-16",
    "lidar_mode": "512x20",
    "beam_altitude_angles": np.linspace(15, -15, 16).tolist(),
    "beam_azimuth_angles": [1.5, -1.5] * 8,
    "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
}


def velodyne_yaml(lasers: int = 16, **replaced: str) -> str:
    rows = []
    for i in range(lasers):
        keys = {"laser_id": str(i), "rot_correction": "0.0", "vert_correction": f"{(i - 8) * 0.03:.4f}"}
        keys |= {"dist_correction": "0.1", "vert_offset_correction": "0.0", "horiz_offset_correction": "0.0"}
        if i == 3:
            keys |= replaced
        rows.append("- {" + ", ".join(f"{key}: {value}" for key, value in keys.items()) + "}")
    return "lasers:\n" + "\n".join(rows) + f"\nnum_lasers: {lasers}\ndistance_resolution: 0.002\n"


def velodyne_xml(lasers: int = 16, elevation: str = "-3.5") -> str:
    items = "".join(
        f"<item><px><id_>{i}</id_><rotCorrection_>{i * 0.1}</rotCorrection_>"
        f"<vertCorrection_>{elevation if i == 3 else i - 8.0}</vertCorrection_><distCorrection_>12.5</distCorrection_>"
        f"<vertOffsetCorrection_>20</vertOffsetCorrection_><horizOffsetCorrection_>2.6</horizOffsetCorrection_></px></item>"
        for i in range(lasers)
    )
    return f"<boost_serialization><DB><distLSB_>0.2</distLSB_><points_>{items}</points_></DB></boost_serialization>"


def hesai_csv(lasers: int = 32, row: str = "3,-2.5,0.75") -> str:
    rows = [row if i == 3 else f"{i},{16 - i},0.5" for i in range(1, lasers + 1)]
    return "Channel,Elevation,Azimuth\n" + "\n".join(rows) + "\n"


TABLE = "Time/s,Azimuth/deg,Zenith/deg\n0.0,10,80\n0.001,20,100\n"


def test_ouster_product_line_with_an_unknown_number_of_rows_uses_settings_of_the_same_line(
    tmp_path: Path,
) -> None:
    (tmp_path / "unit.json").write_text(ouster(prod_line="OS-0-16"), encoding="utf-8")
    lidar = raycam.load_lidar(tmp_path / "unit.json")
    assert "OS0-16" in lidar.title
    assert lidar.pattern().shape == (16, 512)
    assert lidar.settings["max_range"] == raycam.Lidar("os0-128").settings["max_range"]
    assert lidar.settings["max_range"] != raycam.Lidar("os1-16").settings["max_range"]


@pytest.mark.parametrize("line", ["OS-9-16", "OS-DOME-16", 3])
def test_ouster_of_an_unknown_product_line_gives_a_notice_unless_a_device_is_given(
    line: object, tmp_path: Path
) -> None:
    (tmp_path / "unit.json").write_text(ouster(prod_line=line), encoding="utf-8")
    with warns(raycam.Notice, code="assumed_device", mentions=["prod_line", repr(line), "OS1"]):
        raycam.load_lidar(tmp_path / "unit.json")
    raycam.load_lidar(tmp_path / "unit.json", "os1-16")


def test_ouster_mode_is_read_from_the_data_format_if_missing(tmp_path: Path) -> None:
    text = ouster(lidar_mode=None, data_format={"columns_per_frame": 2048, "fps": 10})
    (tmp_path / "unit.json").write_text(text, encoding="utf-8")
    assert raycam.load_lidar(tmp_path / "unit.json").pattern().shape == (16, 2048)


def test_velodyne_yaml_and_xml_are_read(tmp_path: Path) -> None:
    (tmp_path / "unit.yaml").write_text(velodyne_yaml(vert_correction="0.1234"), encoding="utf-8")
    pattern = raycam.load_lidar(tmp_path / "unit.yaml").pattern()
    assert math.asin(pattern.directions[3, 2]) == pytest.approx(0.1234)
    np.testing.assert_allclose(pattern.range_offset[:16], -0.1)
    (tmp_path / "db.xml").write_text(velodyne_xml(), encoding="utf-8")
    lidar = raycam.load_lidar(tmp_path / "db.xml")
    pattern = lidar.pattern()
    assert math.degrees(math.asin(pattern.directions[3, 2])) == pytest.approx(-3.5)
    np.testing.assert_allclose(pattern.range_offset[:16], -0.125)
    assert lidar.settings["step"] == 0.002
    assert not lidar.is_generic


def test_block_style_yaml_equals_flow_style(tmp_path: Path) -> None:
    flow = velodyne_yaml()
    block = flow.replace("- {", "- ").replace(", ", "\n  ").replace("}", "")
    for name, text in (("flow.yaml", flow), ("block.yml", block)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    a, b = (raycam.load_lidar(tmp_path / name).pattern() for name in ("flow.yaml", "block.yml"))
    np.testing.assert_array_equal(a.directions, b.directions)


def test_hesai_correction_is_read(tmp_path: Path) -> None:
    (tmp_path / "unit.csv").write_text(hesai_csv(), encoding="utf-8")
    lidar = raycam.load_lidar(tmp_path / "unit.csv")
    assert (lidar.name, lidar.is_generic) == ("pandar-xt32", False)
    assert math.degrees(math.asin(lidar.pattern().directions[2, 2])) == pytest.approx(-2.5)


def test_beam_directions_are_read_from_csv_npy_and_npz(tmp_path: Path) -> None:
    (tmp_path / "mid.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "up.csv").write_text(
        "time,azimuth,elevation,ring\n0,10,10,2\n0.001,20,-10,5\n", encoding="utf-8"
    )
    first, second = (raycam.load_lidar(tmp_path / name).pattern() for name in ("mid.csv", "up.csv"))
    expected = [
        [math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)]
        for a, e in np.radians([[10, 10], [20, -10]])
    ]
    for pattern in (first, second):
        np.testing.assert_allclose(pattern.directions, expected, atol=1e-12)
        np.testing.assert_allclose(pattern.times, [0, 0.001])
    assert second.rings.tolist() == [2, 5]
    np.save(tmp_path / "ways.npy", expected)
    np.savez(tmp_path / "ways.npz", directions=expected, times=[0, 0.001], rings=np.array([2, 5]))
    for name in ("ways.npy", "ways.npz"):
        np.testing.assert_allclose(
            raycam.load_lidar(tmp_path / name).pattern().directions, expected, atol=1e-12
        )


def test_calibration_table_keeps_the_other_settings_of_the_device(tmp_path: Path) -> None:
    (tmp_path / "mid.csv").write_text(TABLE, encoding="utf-8")
    lidar = raycam.load_lidar(tmp_path / "mid.csv", "livox-mid40")
    assert lidar.max_range == 260
    assert len(lidar.pattern()) == 2
    assert not lidar.is_generic


def ouster(**replaced: object) -> str:
    return json.dumps({key: value for key, value in (OUSTER | replaced).items() if value is not None})


@pytest.mark.parametrize(
    ("name", "text", "code", "facts"),
    [
        ("a.json", "{", "syntax", []),
        ("a.json", "[1]", "syntax", []),
        ("a.json", "[" * 100_000, "syntax", []),
        (
            "a.json",
            ouster(beam_altitude_angles=[95.0] * 16),
            "out_of_range",
            ["beam_altitude_angles[0]", "95"],
        ),
        (
            "a.json",
            ouster(beam_altitude_angles=[math.nan] * 16),
            "out_of_range",
            ["beam_altitude_angles[0]", "nan"],
        ),
        ("a.json", ouster(beam_altitude_angles=["x"] * 16), "wrong_type", ["beam_altitude_angles[0]", "x"]),
        ("a.json", ouster(beam_altitude_angles=[1.0] * 15), "wrong_shape", ["15", "16"]),
        ("a.json", ouster(beam_altitude_angles=[0] * 16), "missing_value", ["beam_altitude_angles"]),
        ("a.json", ouster(beam_azimuth_angles=None), "missing_value", ["beam_azimuth_angles"]),
        ("a.json", ouster(lidar_mode="77x1"), "unknown_name", ["lidar_mode", "77x1"]),
        ("a.json", ouster(lidar_to_sensor_transform=[1, 2]), "wrong_shape", ["lidar_to_sensor_transform"]),
        (
            "a.json",
            ouster(beam_altitude_angles=[1.0] * 5, beam_azimuth_angles=[1.0] * 5),
            "wrong_device",
            ["5 lasers"],
        ),
        (
            "a.yaml",
            velodyne_yaml(vert_correction="nan"),
            "out_of_range",
            ["line 5", "vert_correction", "nan"],
        ),
        ("a.yaml", velodyne_yaml(vert_correction="1.6"), "out_of_range", ["laser 3", "1.6", "90"]),
        ("a.yaml", velodyne_yaml(laser_id="2"), "duplicate_name", ["laser 2"]),
        ("a.yaml", velodyne_yaml(7), "wrong_device", ["7 lasers"]),
        ("a.yaml", "lasers: [", "wrong_type", ["line 1", "lasers"]),
        ("a.yaml", "- a", "syntax", ["line 1"]),
        ("a.yaml", "", "missing_value", []),
        ("a.xml", velodyne_xml(elevation="91"), "out_of_range", ["laser 3"]),
        ("a.xml", velodyne_xml(elevation="high"), "wrong_type", ["laser 3", "high"]),
        ("a.xml", "<a>", "syntax", []),
        ("a.xml", '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "syntax", ["entities"]),
        ("a.csv", hesai_csv(row="3,91,0"), "out_of_range", ["line 4", "elevation", "91"]),
        ("a.csv", hesai_csv(row="3,nan,0"), "out_of_range", ["line 4", "nan"]),
        ("a.csv", hesai_csv(row="2,1,0"), "duplicate_name", ["line 4", "channel 2"]),
        ("a.csv", hesai_csv(row="3,1"), "wrong_shape", ["line 4"]),
        ("a.csv", hesai_csv(row="40,1,0"), "duplicate_name", ["1 to 32"]),
        ("a.csv", hesai_csv(row="1e300,1,0"), "duplicate_name", ["1 to 32"]),
        ("a.csv", hesai_csv(31), "wrong_device", ["31 lasers"]),
        ("a.csv", TABLE.replace("20,100", "20,nan"), "out_of_range", ["line 3", "zenith"]),
        ("a.csv", TABLE.replace("20,100", "20,181"), "out_of_range", ["line 3", "zenith", "181"]),
        ("a.csv", TABLE.replace("0.001", "-0.001"), "unordered_times", ["line 3", "-0.001"]),
        ("a.csv", TABLE.replace("0.001,20,100", "0.001,20"), "missing_value", ["line 3"]),
        ("a.csv", "a,b\n1,2\n", "wrong_shape", ["line 1"]),
        ("a.csv", TABLE.splitlines()[0], "missing_value", []),
        ("a.csv", "", "missing_value", []),
        ("a.npy", "not numpy", "syntax", []),
        ("a.npz", "not numpy", "syntax", []),
        ("a.foo", "", "unknown_format", [".json"]),
    ],
)
def test_impossible_calibrations_are_refused(
    name: str, text: str, code: str, facts: list[str], tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(raycam.LidarError) as caught:
        raycam.load_lidar(tmp_path / name)
    assert caught.value.code == code
    for fact in [name, *facts]:
        assert fact in str(caught.value)


def test_calibration_of_another_device_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(ouster(), encoding="utf-8")
    for device in ("vlp16", "os1-64"):
        with pytest.raises(raycam.LidarError) as caught:
            raycam.load_lidar(tmp_path / "a.json", device)
        assert caught.value.code == "wrong_device"
        assert device in str(caught.value)


def test_arrays_with_nan_or_objects_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "nan.npy", [[1.0, 0, math.nan]])
    np.save(tmp_path / "flat.npy", [1.0, 2.0])
    np.save(tmp_path / "object.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.savez(tmp_path / "other.npz", ways=[[1.0, 0, 0]])
    for name, code in (
        ("nan.npy", "out_of_range"),
        ("flat.npy", "wrong_shape"),
        ("object.npy", "syntax"),
        ("other.npz", "wrong_shape"),
    ):
        with pytest.raises(raycam.LidarError) as caught:
            raycam.load_lidar(tmp_path / name)
        assert caught.value.code == code
        assert name in str(caught.value)


def test_declared_sizes_are_checked_before_allocation(tmp_path: Path) -> None:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (9000000000000, 3), }"
    header = header.ljust(117) + b"\n"
    (tmp_path / "big.npy").write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(raycam.LidarError) as caught:
        raycam.load_lidar(tmp_path / "big.npy")
    assert caught.value.code in ("syntax", "budget_exceeded")
    np.savez_compressed(tmp_path / "bomb.npz", directions=np.zeros((12_000_000, 3)))
    with pytest.raises(raycam.LidarError) as caught:
        raycam.load_lidar(tmp_path / "bomb.npz")
    assert caught.value.code == "budget_exceeded"


def test_missing_file_raises_a_file_not_found_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        raycam.load_lidar(tmp_path / "none.json")


def test_matrices_of_rgl_are_rays_along_their_z_axes(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    turns = Rotation.random(50, random_state=3)
    matrices = np.zeros((50, 3, 4), np.float32)
    matrices[:, :, :3], matrices[:, :, 3] = turns.as_matrix(), random.normal(size=(50, 3))
    (tmp_path / "rays.mat3x4f").write_bytes(matrices.tobytes())
    lidar = raycam.load_lidar(tmp_path / "rays.mat3x4f", noise=False)
    pattern = lidar.pattern()
    np.testing.assert_allclose(pattern.directions, turns.apply([0, 0, 1]), atol=1e-6)
    np.testing.assert_array_equal(pattern.origins, matrices[:, :, 3])
    for data, code in (
        (b"", "wrong_shape"),
        (matrices.tobytes()[:-4], "wrong_shape"),
        (bytes(48), "out_of_range"),
    ):
        (tmp_path / "bad.mat3x4f").write_bytes(data)
        with raises(raycam.LidarError, code=code, mentions=["bad.mat3x4f"]):
            raycam.load_lidar(tmp_path / "bad.mat3x4f")
    matrices[3, 1, 2] = np.nan
    (tmp_path / "bad.mat3x4f").write_bytes(matrices.tobytes())
    with raises(raycam.LidarError, code="out_of_range", mentions=["directions[3]"]):
        raycam.load_lidar(tmp_path / "bad.mat3x4f")
