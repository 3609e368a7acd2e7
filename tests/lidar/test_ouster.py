"""Ouster's geometry, compared with `XYZLut` of ouster-sdk 1.0.1 for twelve units.

data/ouster_xyz.json contains the units' calibrations (from the metadata files in ouster-sdk's tests) and, for
16 or more pixels each, a range in millimetres and the point that `XYZLut` computes from it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam

UNITS = json.loads((Path(__file__).parent / "data" / "ouster_xyz.json").read_text(encoding="utf-8"))


def load(unit: dict[str, Any], folder: Path) -> raycam.Lidar:
    path = folder / "unit.json"
    path.write_text(json.dumps(unit["metadata"]), encoding="utf-8")
    return raycam.load_lidar(path)


@pytest.mark.parametrize("unit", UNITS, ids=[unit["name"] for unit in UNITS])
def test_points_of_ranges_equal_those_of_ouster_sdk(unit: dict[str, Any], tmp_path: Path) -> None:
    lidar = load(unit, tmp_path)
    pattern = lidar.pattern()
    rows, columns = pattern.shape
    assert (columns, rows) == (unit["width"], len(unit["shift"]))
    at = np.array(unit["columns"]) * rows + np.array(unit["rows"])
    distance = np.array(unit["ranges"]) / 1000
    along = (distance - pattern.range_offset[at]) / pattern.range_scale[at]
    points = pattern.origins[at] + along[:, None] * pattern.directions[at]
    np.testing.assert_allclose(points, unit["xyz"], rtol=0, atol=1e-9)
    assert lidar.pixel_shifts(columns) == unit["shift"]


def test_scan_contains_the_ranges_that_ouster_sdk_turns_into_its_points(
    tmp_path: Path, yard: raycam.World
) -> None:
    """The reported distance includes the distance between the axis and the beam's origin."""
    lidar = load(UNITS[0], tmp_path).replace(noise=False, min_range=0).placed([0, 0, 1.8])
    scan = raycam.scan(yard, lidar)
    pattern, at = scan.pattern, scan["pulse"]
    start = pattern.origins[at] + (0 - pattern.range_offset[at])[:, None] * pattern.directions[at]
    np.testing.assert_allclose(
        start + scan["distance"][:, None] * pattern.directions[at], scan["position"], atol=1e-12
    )
    measured = np.linalg.norm(scan["position"] - pattern.origins[at], axis=1)
    np.testing.assert_allclose(scan["distance"] - measured, 0.012163 + 0 * measured, atol=0.004)
    assert (scan["distance"] > measured).all()


def test_lasers_of_a_column_fire_together() -> None:
    lidar = raycam.Lidar("os1-128", mode="1024x20")
    times = lidar.pattern().times.reshape(1024, 128)
    np.testing.assert_allclose(times, (np.arange(1024) / 1024 / 20)[:, None] + np.zeros(128), atol=1e-12)


def test_mode_and_rate_select_each_other() -> None:
    assert raycam.Lidar("os1-64", rate=20).settings["mode"] == "1024x20"
    assert raycam.Lidar("os1-64", mode="512x20").rate == 20
    assert raycam.Lidar("os1-64").replace(mode="512x20").rate == 20
    assert raycam.Lidar("os1-64", mode="2048x10").replace(seed=1).settings["mode"] == "2048x10"
    assert raycam.Lidar("os1-64", mode="512x10", rate=3, force_rate=True).rate == 3
    with pytest.raises(raycam.LidarError) as caught:
        raycam.Lidar("os1-64", mode="2048x10", rate=20)
    assert caught.value.code == "conflicting_values"


def test_destaggered_image_shows_a_vertical_edge_in_one_column(yard: raycam.World) -> None:
    """Without shifted rows, a vertical edge appears in different image columns.

    The four columns of lasers meet the edge at different times.
    """
    lidar = raycam.Lidar("os1-64", noise=False, min_range=0).placed([0, 0, 1.8])
    scan = raycam.scan(yard, lidar)
    edges = {}
    for staggered in (True, False):
        image = scan.image("instance", staggered=staggered)
        # The rows above the horizon.
        edges[staggered] = [int(np.flatnonzero(row == 1)[0]) for row in image[:28]]
    assert np.ptp(edges[True]) > 10
    assert np.ptp(edges[False]) <= 2
