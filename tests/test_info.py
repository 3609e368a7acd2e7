"""The report of `raycam info`."""

from __future__ import annotations

import raycam
from raycam.info import info, info_cameras


def test_it_counts_what_there_is() -> None:
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


def test_it_shows_the_camera_that_would_be_used() -> None:
    world = raycam.World()
    assert "objects    0" in info(world)
    world.add_object(sphere={})
    assert "this one frames everything" in info(world)


def test_zero_has_no_sign() -> None:
    camera = raycam.Camera.from_pose([0, 0, 0], 0, 0, 0, size=(64, 48), focal=50)
    assert "-0.000000" not in info_cameras({"front": camera})


def test_places_far_away_are_not_rounded_to_metres() -> None:
    far = [512345.678125, -5412345.25, 103.5]
    camera = raycam.Camera.from_pose(far, 0, 0, 0, size=(64, 48), focal=50)
    assert "C  512345.678125 -5412345.25 103.5" in info_cameras({"front": camera})
