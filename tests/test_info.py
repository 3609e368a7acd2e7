"""The report of `raycam info`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.info import info, info_cameras


def test_info_counts_the_contents_of_a_world() -> None:
    world = raycam.World(up="y")
    world.add_object(box={"size": 2}, name="crate", category="thing")
    world.add_object(instance_of="crate", location=[4, 0, 0])
    world.add_mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    world.add_light(type="sun", direction=[0, -1, 0], irradiance=[1, 2, 3])
    world.add_camera(raycam.Camera.look_at([0, 0, 9], [0, 0, 0], "y", size=(64, 48)), "front")
    world.set_video(fps=12, seconds=2, orbit={"target": [0, 0, 0]})
    text = info(world)
    for part in (
        "y up",
        "objects    3, of 2 meshes",
        "triangles  25, 1 of zero area (kept, never hit)",
        "13 stored",
        "bounds     -1 -1 -1 to 5 1 1",
        "'crate': 12 triangles at 0 0 0, thing",
        "sun: angular_diameter 0, direction 0 -1 0, irradiance 1 2 3",
        "camera 'front': 64 x 48, pixel_center integer",
        "C  0 0 9",
        "roll 0, pitch 0, yaw 0 degrees",
        "24 frames, 2 s at 12 fps",
        "notices    0",
    ):
        assert part in text, part


def test_info_shows_the_default_camera() -> None:
    world = raycam.World()
    assert "objects    0" in info(world)
    world.add_object(sphere={})
    assert "default camera" in info(world)


def test_info_prints_no_negative_zero() -> None:
    camera = raycam.Camera.from_pose([0, 0, 0], 0, 0, 0, size=(64, 48), focal=50)
    assert "-0.000000" not in info_cameras({"front": camera})


def test_info_prints_all_digits_of_distant_positions() -> None:
    far = [512345.678125, -5412345.25, 103.5]
    camera = raycam.Camera.from_pose(far, 0, 0, 0, size=(64, 48), focal=50)
    assert "C  512345.678125 -5412345.25 103.5" in info_cameras({"front": camera})


LAMP = """IESNA:LM-63-1995
TILT=NONE
1 1000 1 3 1 1 2 0.1 0.1 0.1
1 1 10
0 45 90
0
100 50 0
"""


@pytest.mark.parametrize("kind", ["file", "array", "ies", "area", "daylight"])
def test_info_prints_one_line_per_light(tmp_path: Path, kind: str) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    sky = np.full((4, 8, 3), 0.5, np.float32)
    (tmp_path / "lamp.ies").write_text(LAMP)
    (tmp_path / "sky.hdr").write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + bytes([128] * 4 * 32)
    )
    lights = {
        "file": ({"type": "environment", "image": str(tmp_path / "sky.hdr"), "yaw": 30}, "sky.hdr"),
        "array": ({"type": "environment", "image": sky}, "environment"),
        "ies": (
            {
                "type": "ies",
                "profile": str(tmp_path / "lamp.ies"),
                "position": [0, 0, 3],
                "direction": [0, 0, -1],
            },
            "lamp.ies",
        ),
        "area": (
            {"type": "disk", "position": [0, 0, 3], "direction": [0, 0, -1], "radius": 1, "radiance": 2},
            "radius 1",
        ),
        "daylight": ({"type": "daylight", "direction": [0, 0, -1]}, "turbidity"),
    }
    keys, part = lights[kind]
    world.add_light(**keys)
    lines = info(world).splitlines()
    first = lines.index("lights     1") + 1
    assert part in lines[first]
    assert lines[first + 1].startswith("cameras")
