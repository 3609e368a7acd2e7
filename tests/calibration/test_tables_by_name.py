"""Tables of values by camera name, and values that K repeats."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from support.raises import has_notice, raises

K = [[500.0, 0, 320], [0, 510, 240], [0, 0, 1]]
EYE = np.eye(3).tolist()
PAIR = {"K": {"left": K, "right": K}, "size": [640, 480], "R": EYE, "T": [-0.1, 0, 0]}
LENS = [0.1, 0.01, 0, 0, 0]


def load(folder: Path, content: dict[str, Any], name: str = "a.json") -> raycam.Cameras:
    path = folder / name
    path.write_text(json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(path)


@pytest.mark.parametrize(
    "table", [{"D": {"left": LENS}}, {"size": {"left": [640, 480]}}, {"name": {"left": "a"}}]
)
def test_camera_without_an_entry_in_a_table_gives_a_notice(tmp_path: Path, table: dict[str, Any]) -> None:
    assert not load(tmp_path, PAIR).notices
    cameras = load(tmp_path, PAIR | table)
    assert has_notice(cameras.notices, "missing_value", "right", *table)


def test_entry_for_an_unknown_camera_gives_a_notice_or_an_error(tmp_path: Path) -> None:
    serial = {"left": 1, "right": 2, "top": 3}
    cameras = load(tmp_path, PAIR | {"D": {"left": LENS, "right": LENS}, "serial": serial})
    assert has_notice(cameras.notices, "ignored_key", "serial.top")
    np.testing.assert_allclose(cameras["right"].distortion, LENS)
    with raises(FormatError, code="syntax", mentions=["D.rigth", "right"]):
        load(tmp_path, PAIR | {"D": {"left": LENS, "rigth": LENS}})


@pytest.mark.parametrize("name", ["base", "robot_base", "vehicle"])
def test_pose_of_a_body_next_to_a_pair_without_poses_is_refused(tmp_path: Path, name: str) -> None:
    camera = {"K": K, "size": [640, 480]}
    body = {name: {"R": EYE, "T": [-0.1, 0, 0]}}
    with raises(FormatError, code="syntax", mentions=[name]):
        load(tmp_path, {"left": camera, "right": camera} | body)
    placed = {"left": camera, "right": camera, "R": EYE, "T": [-0.2, 0, 0]}
    cameras = load(tmp_path, placed | body)
    np.testing.assert_allclose(cameras["right"].C, [0.2, 0, 0])
    assert has_notice(cameras.notices, "ignored_key", name)


@pytest.mark.parametrize(
    "other",
    [
        {"principal_point": [300, 240]},
        {"optical_center": [320, 241]},
        {"principal_point": {"x": 321, "y": 240}},
        {"focal_length": 505},
        {"focal_length": [500, 500]},
    ],
)
def test_value_in_pixels_that_contradicts_k_is_refused(tmp_path: Path, other: dict[str, Any]) -> None:
    with raises(FormatError, code="syntax", mentions=["K (line 1)", *other]):
        load(tmp_path, {"K": K, "size": [640, 480]} | other)


@pytest.mark.parametrize(
    ("other", "is_ignored"),
    [
        ({"principal_point": [320, 240], "focal_length": [500, 510]}, False),
        ({"principal_point": [320.001, 240]}, False),
        ({"focal_length": 4.2}, True),
        ({"principal_point": [0.5, 0.5]}, True),
        ({"principal_point": [0, 0]}, True),
    ],
)
def test_values_that_repeat_k_are_silent_and_other_units_are_reported(
    tmp_path: Path, other: dict[str, Any], is_ignored: bool
) -> None:
    cameras = load(tmp_path, {"K": K, "size": [640, 480]} | other)
    np.testing.assert_array_equal(cameras["a"].K, K)
    assert has_notice(cameras.notices, "ignored_key", next(iter(other))) == is_ignored


def test_poses_in_a_second_file_report_cameras_and_keys_that_are_not_used(tmp_path: Path) -> None:
    camera = {"K": K, "size": [640, 480]}
    poses = {"left": {"R": EYE, "T": [0, 0, 1]}, "board": [7, 5]}
    (tmp_path / "extrinsics.json").write_text(json.dumps(poses))
    cameras = load(tmp_path, {"left": camera, "right": camera}, "intrinsics.json")
    np.testing.assert_allclose(cameras["left"].C, [0, 0, -1])
    assert has_notice(cameras.notices, "assumed_convention", "right", "extrinsics.json")
    assert has_notice(cameras.notices, "ignored_key", "board", "extrinsics.json")
    poses["right"] = {"R": EYE}
    (tmp_path / "extrinsics.json").write_text(json.dumps(poses))
    with raises(FormatError, code="syntax", mentions=["right"]):
        load(tmp_path, {"left": camera, "right": camera}, "intrinsics.json")
