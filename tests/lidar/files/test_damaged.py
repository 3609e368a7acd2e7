"""Damaged calibrations and tables: every file is read or refused with a code, within limits of memory."""

from __future__ import annotations

import json
import random
import tracemalloc
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from lidar.files.test_calibrations import TABLE, hesai_csv, ouster, velodyne_xml, velodyne_yaml
from support.damaged import damaged

MAX_BYTES = 400_000_000
"""Memory limit for a file of a few kilobytes."""


def rgl() -> bytes:
    matrices = np.tile(np.eye(3, 4, dtype="<f4"), (6, 1, 1))
    matrices[:, 2, 3] = np.arange(6)
    return matrices.tobytes()


def saved(name: str, folder: Path) -> bytes:
    directions = np.tile([[1.0, 0.0, 0.0]], (5, 1))
    if name.endswith("npy"):
        np.save(folder / name, directions)
    else:
        np.savez(folder / name, directions=directions, times=np.arange(5.0), rings=np.arange(5))
    return (folder / name).read_bytes()


def sample(name: str, folder: Path) -> bytes:
    texts = {
        "a.json": ouster(
            pixel_shift_by_row=[0] * 16, lidar_mode=None, data_format={"columns_per_frame": 512, "fps": 20}
        ),
        "a.yaml": velodyne_yaml(),
        "a.xml": velodyne_xml(),
        "hesai.csv": hesai_csv(),
        "table.csv": "Time/s,Azimuth/deg,Zenith/deg,ring\n0.0,10,80,1\n0.001,20,100,2\n",
        "table.txt": TABLE,
    }
    if name in texts:
        return texts[name].encode()
    return rgl() if name.endswith("mat3x4f") else saved(name, folder)


SAMPLES = ["a.json", "a.yaml", "a.xml", "hesai.csv", "table.csv", "table.txt", "a.npy", "a.npz", "a.mat3x4f"]


def read(path: Path) -> str | None:
    """Returns the code of the file's error; None for a file that is read completely."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", raycam.Notice)
            lidar = raycam.load_lidar(path)
            pattern = lidar.pattern()
    except raycam.LidarError as fault:
        return fault.code
    np.testing.assert_allclose(np.linalg.norm(pattern.directions, axis=1), 1.0, atol=2e-3)
    assert np.isfinite(pattern.times).all()
    return None


def check_damaged(name: str, folder: Path, count: int, seed: int) -> dict[str | None, int]:
    """Reads damaged copies of a sample; returns the number of files for each code."""
    codes: dict[str | None, int] = {}
    path, data = folder / f"damaged.{name.split('.')[1]}", sample(name, folder)
    tracemalloc.start()
    try:
        for content in damaged(data, count, seed):
            path.write_bytes(content)
            tracemalloc.reset_peak()
            code = read(path)
            assert tracemalloc.get_traced_memory()[1] < MAX_BYTES
            codes[code] = codes.get(code, 0) + 1
    finally:
        tracemalloc.stop()
    return codes


@pytest.mark.parametrize("name", SAMPLES)
def test_damaged_files_are_read_or_refused_with_a_code(name: str, tmp_path: Path) -> None:
    codes = check_damaged(name, tmp_path, 150, 1)
    assert len(codes) >= 2
    assert None in codes


@pytest.mark.proof
@pytest.mark.parametrize("name", SAMPLES)
def test_many_damaged_files_are_read_or_refused_with_a_code(name: str, tmp_path: Path) -> None:
    check_damaged(name, tmp_path, 20_000, 2)


UNITS = Path(__file__).parents[1] / "data" / "ouster_xyz.json"
VALUES = [
    None,
    True,
    -1,
    0,
    4_000_000_000,
    10**30,
    10**400,
    1e308,
    "",
    "512x20",
    "9999999999x10",
    [],
    [[]],
    {},
]
VALUES += [
    [None],
    [[1], [2]],
    ["a"] * 64,
    [1e300] * 64,
    [0.5] * 16,
    {"a": 1},
    [[1e308] * 4] * 4,
    [[0] * 4] * 4,
]
"""Values that replace a value of a unit's metadata."""


def replaced_metadata(count: int, seed: int) -> Iterator[str]:
    """Yields metadata of real units in which values are replaced or removed."""
    draw = random.Random(seed)
    units = [json.dumps(unit["metadata"]) for unit in json.loads(UNITS.read_text(encoding="utf-8"))]
    for _ in range(count):
        document = json.loads(draw.choice(units))
        for _ in range(draw.choice([1, 1, 2])):
            node = document
            key = draw.choice(list(node))
            while isinstance(node[key], dict) and node[key]:
                node, key = node[key], draw.choice(list(node[key]))
            value = json.loads(json.dumps(draw.choice(VALUES)))
            if isinstance(node[key], list) and node[key] and draw.random() < 0.4:
                node[key][draw.randrange(len(node[key]))] = value
            else:
                node[key] = value
        yield json.dumps(document)


@pytest.mark.parametrize("count", [300, pytest.param(20_000, marks=pytest.mark.proof)])
def test_metadata_with_other_values_are_read_or_refused_with_a_code(count: int, tmp_path: Path) -> None:
    path, codes = tmp_path / "unit.json", set()
    for text in replaced_metadata(count, 3):
        path.write_text(text, encoding="utf-8")
        codes.add(read(path))
    assert {None, "wrong_type", "out_of_range", "unknown_name"} <= codes


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("a.yaml", velodyne_yaml().replace("num_lasers: 16", "num_lasers: 4000000000"), "wrong_shape"),
        (
            "a.yaml",
            "lasers:\n" + "- {laser_id: 0, vert_correction: 0, rot_correction: 0}\n" * 100_000,
            "duplicate_name",
        ),
        ("a.yaml", velodyne_yaml(vert_offset_correction="1e200"), "out_of_range"),
        ("a.xml", velodyne_xml().replace("<id_>3</id_>", "<id_>4000000000</id_>"), "duplicate_name"),
        ("a.xml", "<a>" * 300_000 + "</a>" * 300_000, "missing_value"),
        ("a.json", ouster(data_format={"columns_per_frame": 4_000_000_000}, lidar_mode=None), "unknown_name"),
        ("a.json", ouster(beam_azimuth_angles=[10**400] * 16), "out_of_range"),
        ("a.json", ouster(beam_azimuth_angles=[[1.0], 2.0]), "wrong_type"),
        ("a.json", ouster(lidar_to_sensor_transform=[0] * 16), "not_a_rotation"),
        ("a.json", ouster(pixel_shift_by_row=[1e300] * 16), "out_of_range"),
        ("a.csv", hesai_csv(row="4000000000,1,0"), "duplicate_name"),
        ("a.csv", "time,azimuth,elevation,ring\n0,0,0,1e18\n", "out_of_range"),
        ("a.csv", "time,azimuth,elevation,ring\n0,0,0,0.5\n", "out_of_range"),
    ],
)
def test_huge_numbers_of_lasers_and_values_are_refused(
    name: str, text: str, code: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    tracemalloc.start()
    try:
        assert read(tmp_path / name) == code
        assert tracemalloc.get_traced_memory()[1] < MAX_BYTES
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    "arrays",
    [
        {"rings": np.array([1e300] * 5)},
        {"rings": np.array([2**63] * 5, np.uint64)},
        {"rings": np.array([np.nan] * 5)},
        {"times": np.array([0, 1, 2, 3, np.inf])},
        {"times": np.array([0, 1, 2, 3, 1e308])},
        {"origins": np.full((5, 3), 1e308)},
        {"origins": np.full((5, 3), np.nan)},
        {"directions": np.full((5, 3), 1e308)},
        {"directions": np.zeros((5, 3))},
        {"directions": np.full((5, 3), 1e-320)},
    ],
)
def test_arrays_with_extreme_values_are_read_or_refused_with_a_code(
    arrays: dict[str, np.ndarray], tmp_path: Path
) -> None:
    np.savez(tmp_path / "a.npz", **{"directions": np.tile([[1.0, 0.0, 0.0]], (5, 1)), **arrays})
    read(tmp_path / "a.npz")
