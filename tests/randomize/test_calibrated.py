"""Cameras of recipes with size, K and lens of a calibration file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.randomize import Recipe
from support.raises import Fault, fault, raises, warns

THINGS = [
    {"name": "table", "box": {"size": [4, 4, 0.1]}, "location": [0, 0, -0.05]},
    {"name": "toy", "category": "toy", "box": {"size": 0.3}, "on": "table", "count": 2},
]
SEE = {"object": "toy", "distance": [0.8, 1.5], "elevation": [30, 60]}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "calib.yaml").write_text(
        "image_width: 320\nimage_height: 240\n"
        "K: [[150.5, 0, 158.7], [0, 150.1, 121.2], [0, 0, 1]]\nD: [-0.012, 0.004, -0.002, 0.0003]\n"
    )
    return tmp_path


def recipe(folder: Path, **camera: Any) -> Recipe:
    return Recipe({"object": THINGS, "camera": [{"calibration": "calib.yaml", **camera}]}, folder=folder)


def test_calibrated_camera_keeps_its_lens_and_shows_the_object(folder: Path) -> None:
    made = recipe(folder, lens="fisheye", see=SEE)
    for number in range(3):
        world = made.world(number)
        camera = world.camera("camera")
        assert (camera.size, camera.model) == ((320, 240), "fisheye")
        np.testing.assert_array_equal(camera.K, [[150.5, 0, 158.7], [0, 150.1, 121.2], [0, 0, 1]])
        np.testing.assert_array_equal(camera.distortion, [-0.012, 0.004, -0.002, 0.0003])
        frame = raycam.render(world, camera, channels="category", samples=1)
        assert (frame["category"] >= 0).any()
    assert list(made.files) == ["calib.yaml"]


def test_pose_is_taken_from_the_recipe_or_the_file(folder: Path) -> None:
    posed = recipe(folder, lens="opencv", location=[0, -2, 1], target=[0, 0, 0]).world(0).camera("camera")
    wanted = raycam.Camera.look_at([0, -2, 1], [0, 0, 0], size=(320, 240), fov=40)
    np.testing.assert_allclose(posed.R, wanted.R, atol=1e-12)
    np.testing.assert_allclose(posed.C, [0, -2, 1])
    assert posed.model == "opencv"
    left = raycam.data.camera()
    raycam.save_cameras(folder / "two.yaml", {"left": left, "right": left.replace(C=[1, 1, 1])}, "kalibr")
    read = raycam.load_cameras(folder / "two.yaml")
    two = Recipe(
        {"object": THINGS, "camera": [{"name": name, "calibration": "two.yaml"} for name in read]},
        folder=folder,
    )
    for name, camera in two.world(0).cameras.items():
        np.testing.assert_allclose(camera.P, read[name].P)


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ({"see": SEE}, fault("syntax", "'camera'")),
        ({"lens": "fisheye", "fov": 40}, fault("duplicate_name", "'camera'")),
        ({"lens": "fisheye", "calibration": "none.yaml"}, fault("file_not_found", "none.yaml")),
        ({"calibration": "../calib.yaml"}, fault("outside_root", "'camera'")),
    ],
)
def test_invalid_calibrated_cameras_are_refused(folder: Path, camera: dict[str, Any], said: Fault) -> None:
    with raises(raycam.WorldError, **said):
        recipe(folder, **camera).world(0)


def test_camera_without_a_pose_gives_a_notice(folder: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": 2}, name="all around")
    camera = raycam.load_cameras(folder / "calib.yaml", model="fisheye")["calib"]
    raycam.save_cameras(folder / "alone.yaml", {"eye": camera.resized((32, 24))}, "opencv")
    with warns(raycam.Notice, code="unposed_camera", mentions=["view_from"]):
        raycam.render(world, folder / "alone.yaml", samples=1, channels="depth")
    with warns(raycam.Notice, code="unposed_camera"):
        raycam.dataset.write(world, folder / "set", "coco", cameras=[camera.resized((32, 24))], samples=1)
    apart = raycam.World()
    apart.add_object(box={"size": 1}, location=[0, 0, 3], name="in camera coordinates")
    apart.add_light("sky", radiance=1)
    raycam.render(apart, folder / "alone.yaml", samples=1, channels="depth")


def test_unknown_camera_name_raises_with_the_available_names(folder: Path) -> None:
    cameras = raycam.load_cameras(folder / "calib.yaml", model="fisheye")
    with raises(KeyError, mentions=["'left'"]):
        cameras["left"]
    assert cameras.get("left") is None


def test_cameras_argument_conflicts_with_cameras_of_the_recipe(folder: Path) -> None:
    cameras = raycam.load_cameras(folder / "calib.yaml", model="fisheye")
    made = recipe(folder, lens="fisheye", see=SEE)
    with raises(raycam.SettingsError, code="conflicting_values"):
        raycam.dataset.write(made, folder / "set", "coco", count=1, cameras=cameras)
