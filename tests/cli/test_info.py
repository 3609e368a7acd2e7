"""`raycam info` for each kind of file."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from raycam.cli import main

K = [[500, 0, 320], [0, 510, 240], [0, 0, 1]]
CAMERA = {"K": K, "img_size": [640, 480]}
ANIPOSE = """[cam_0]
name = "front"
size = [640, 480]
matrix = [[500.0, 0.0, 320.0], [0.0, 510.0, 240.0], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0, 0.0]
rotation = [0.0, 0.0, 0.0]
translation = [0.0, 0.0, 0.0]
"""


@pytest.mark.parametrize("name", ["a.json", "a.json.gz", "a.npz", "a.npy", "a.csv", "a.toml", "anipose.toml"])
def test_info_shows_the_cameras_of_calibrations_with_any_ending(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path = tmp_path / name
    table = "fx,fy,cx,cy,width,height\n500,510,320,240,640,480\n"
    if name == "a.npz":
        np.savez(path, K=np.array(K, float), img_size=[640, 480])
    elif name == "a.npy":
        path = tmp_path / "K.npy"
        np.save(path, np.array(K, float))
    elif name == "a.csv":
        path.write_text(table)
    elif name == "anipose.toml":
        path.write_text(ANIPOSE)
    elif name == "a.toml":
        keys, values = (line.split(",") for line in table.split())
        path.write_text("".join(f"{key} = {value}\n" for key, value in zip(keys, values, strict=True)))
    else:
        data = json.dumps(CAMERA).encode()
        path.write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
    assert main(["info", str(path), "--size", "640x480"]) == 0
    text = capsys.readouterr().out
    for part in ("cameras    1", "640 x 480", "500.000000", "510.000000"):
        assert part in text


def test_info_of_an_invalid_world_file_shows_the_error_of_the_world(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "room.toml"
    path.write_text("[[object]]\nbox = { size = 1 }\nwrong = 2\n")
    assert main(["info", str(path)]) == 1
    assert "wrong" in capsys.readouterr().err
