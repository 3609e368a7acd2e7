"""XML calibrations without OpenCV's root element."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import has_notice, raises

K = np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
FOCALS = "<fx>500</fx><fy>510</fy><cx>320</cx><cy>240</cy>"
SIZE = "<width>640</width><height>480</height>"
MATRIX = '<K type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>500 0 320 0 510 240 0 0 1</data></K>'


def load(folder: Path, text: str) -> raycam.Cameras:
    path = folder / "a.xml"
    path.write_text(f"<?xml version='1.0'?>\n{text}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(path)


@pytest.mark.parametrize(
    "text",
    [
        f"<camera>{FOCALS}{SIZE}</camera>",
        f"<calibration>{MATRIX}{SIZE}</calibration>",
        f"<calibration><K>500 0 320 0 510 240 0 0 1</K>{SIZE}</calibration>",
        f"<calibration><K>[500, 0, 320; 0, 510, 240; 0, 0, 1]</K>{SIZE}</calibration>",
        '<camera fx="500" fy="510" cx="320" cy="240" width="640" height="480"/>',
        f'<setup><camera name="a"><intrinsics fx="500" fy="510" cx="320" cy="240"/>{SIZE}</camera></setup>',
    ],
)
def test_camera_is_read_from_elements_or_attributes(tmp_path: Path, text: str) -> None:
    cameras = load(tmp_path, text)
    np.testing.assert_array_equal(cameras["a"].K, K)
    assert cameras["a"].size == (640, 480)
    assert cameras.notices == ()


def test_elements_with_one_name_are_separate_cameras(tmp_path: Path) -> None:
    identity = "<R>1 0 0 0 1 0 0 0 1</R>"
    cameras = load(
        tmp_path,
        f'<rig><camera name="l">{FOCALS}{SIZE}{identity}<T>0 0 0</T></camera>'
        f'<camera name="r">{FOCALS}{SIZE}{identity}<T>-1 0 0</T></camera></rig>',
    )
    assert list(cameras) == ["l", "r"]
    np.testing.assert_array_equal(cameras["r"].C, [1, 0, 0])


def test_unit_in_an_attribute_is_reported(tmp_path: Path) -> None:
    text = f'<camera>{FOCALS}{SIZE}<R>1 0 0 0 1 0 0 0 1</R><T units="mm">1 2 3</T></camera>'
    assert has_notice(load(tmp_path, text).notices, "placed_cameras", "T.units", "mm")


def test_unknown_attribute_is_reported(tmp_path: Path) -> None:
    focals = FOCALS.replace("<fx>", '<fx quality="3">')
    text = f"<camera>{focals}{SIZE}</camera>"
    assert has_notice(load(tmp_path, text).notices, "ignored_key", "fx.quality")


def test_focal_length_in_millimetres_is_refused_with_the_conversion(tmp_path: Path) -> None:
    """The form of Tsai's cameras in PETS 2009."""
    text = (
        '<Camera name="x"><Geometry width="768" height="576" dx="0.00485"/>'
        '<Intrinsic focal="5.55" kappa1="0.005" cx="324" cy="282"/></Camera>'
    )
    with raises(raycam.FormatError, mentions=["focal", "5.55", "millimetres"]):
        load(tmp_path, text)


def test_repeated_element_in_opencv_storage_is_refused(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["defined twice"]):
        load(tmp_path, f"<opencv_storage>{MATRIX}{MATRIX}</opencv_storage>")
