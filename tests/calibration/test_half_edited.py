"""Half-edited files: an empty value, decimal comma, renamed key or truncated row.

A lens is never lost without an error.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from support.raises import has_notice, notice_codes, raises, warns

SETTINGS = """%YAML:1.0
Camera.type: "PinHole"
Camera.fx: 458.654
Camera.fy: 457.296
Camera.cx: 367.215
Camera.cy: 248.375
Camera.k1: -0.283
Camera.k2: 0.073
Camera.p1: 0.00019
Camera.p2: 1.7e-05
Camera.width: 752
Camera.height: 480
"""
NERF = {
    "fl_x": 458.654,
    "fl_y": 457.296,
    "cx": 367.25,
    "cy": 248.5,
    "w": 752,
    "h": 480,
    "k1": 0.004,
    "frames": [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}],
}


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize("key", ["k1", "k2", "p2"])
def test_coefficient_without_a_number_raises(tmp_path: Path, key: str) -> None:
    lines = [f"Camera.{key}:" if f".{key}:" in line else line for line in SETTINGS.splitlines()]
    with raises(FormatError, code="syntax", mentions=["settings.yaml:", f"Camera.{key}"]):
        raycam.load_cameras(written(tmp_path, "settings.yaml", "\n".join(lines)))
    camera = raycam.load_cameras(written(tmp_path, "whole.yaml", SETTINGS))["Camera"]
    assert camera.distortion is not None


def test_distortion_key_without_numbers_raises(tmp_path: Path) -> None:
    text = "image_width: 752\nimage_height: 480\ncamera_matrix: [[458, 0, 367], [0, 457, 248], [0, 0, 1]]\n"
    with raises(FormatError, code="syntax", mentions=["c.yaml:4", "dist_coeff"]):
        raycam.load_cameras(written(tmp_path, "c.yaml", f"{text}dist_coeff:\n"))


@pytest.mark.parametrize("number", ["458.654", "367.25", "0.004"])
def test_decimal_comma_raises_with_its_line(tmp_path: Path, number: str) -> None:
    text = json.dumps(NERF).replace(number, number.replace(".", ","))
    with raises(FormatError, code="syntax", mentions=["transforms.json:1"]):
        raycam.load_cameras(written(tmp_path, "transforms.json", text))


def test_json_null_counts_as_a_missing_value(tmp_path: Path) -> None:
    text = json.dumps(NERF | {"k1": None})
    (camera,) = raycam.load_cameras(written(tmp_path, "transforms.json", text)).values()
    assert camera.distortion is None


def test_unknown_keys_of_opensfm_give_a_notice(tmp_path: Path) -> None:
    model = {
        "projection_type": "perspective",
        "width": 640,
        "height": 480,
        "focal": 0.8,
        "k1_old": -0.05,
        "k2": 0.01,
    }
    shot = {"camera": "a", "rotation": [0, 0, 0], "translation": [0, 0, 0]}
    text = json.dumps([{"cameras": {"a": model | {"k2_prior": 0.0}}, "shots": {"1.jpg": shot}}])
    with warns(raycam.Notice, code="ignored_key", mentions=["k1_old"]):
        cameras = raycam.load_cameras(written(tmp_path, "reconstruction.json", text))
    assert notice_codes(cameras.notices) == ["ignored_key"]
    assert not has_notice(cameras.notices, "ignored_key", "k2_prior")


def test_truncated_row_of_euroc_raises_with_its_line(tmp_path: Path) -> None:
    rows = [f"{1403636579763555584 + i},0,0,{i},1,0,0,0,0.5,0.5,0.5,0,0,0,0,0,0" for i in range(3)]
    lens = raycam.Camera([[458, 0, 367], [0, 457, 248], [0, 0, 1]], np.eye(3), np.zeros(3), (752, 480))
    with raises(FormatError, code="syntax", mentions=["data.csv:3", "11", "17"]):
        raycam.load_cameras(
            written(tmp_path, "data.csv", "\n".join(rows).removesuffix(",0,0,0,0,0,0")), intrinsics=lens
        )
