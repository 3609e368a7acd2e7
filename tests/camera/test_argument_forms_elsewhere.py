"""Paths and names in place of worlds and cameras, in every function that accepts them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import Fault, fault, raises

CAR = """
[[object]]
name = "wall"
box = { size = 2 }
location = [6, 0, 0]
[[light]]
type = "sky"
radiance = 1
[[rig]]
name = "stereo"
camera = [
    { name = "left", size = [32, 24], focal = 30, location = [0, 0.1, 0] },
    { name = "right", size = [32, 24], focal = 30, location = [0, -0.1, 0] },
]
"""


@pytest.fixture
def car(tmp_path: Path) -> Path:
    path = tmp_path / "car.toml"
    path.write_text(CAR)
    return path


def test_annotations_accept_paths_and_camera_names(car: Path) -> None:
    world = raycam.load(car)
    left, right = (world.camera(f"stereo/{name}") for name in ("left", "right"))
    expected = raycam.disparity(world, left, right)["disparity"]
    for pair in (("stereo",), ("stereo/left", "stereo/right"), (left, "stereo/right")):
        np.testing.assert_array_equal(raycam.disparity(car, *pair)["disparity"], expected)
    found = raycam.keypoints(str(car), "stereo/left", [[5, 0, 0]])
    np.testing.assert_array_equal(found.pixels, raycam.keypoints(world, left, [[5, 0, 0]]).pixels)
    assert raycam.keypoints(car, None, [[5, 0, 0]]).visible.all()
    np.testing.assert_allclose(raycam.box3d(car, "wall").center, raycam.box3d(world, 0).center)
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'wall'"]):
        raycam.box3d(car, "wal")


def test_data_sets_and_videos_accept_paths_and_camera_names(car: Path, tmp_path: Path) -> None:
    assert raycam.dataset.write(car, tmp_path / "set", "coco", samples=1).frames == 2
    recipe = tmp_path / "r.toml"
    recipe.write_text(
        '[[object]]\nsphere = { radius = { uniform = [1, 2] } }\n[[light]]\ntype="sky"\nradiance=1\n'
    )
    written = raycam.dataset.write(str(recipe), tmp_path / "many", "coco", count=2, samples=1)
    assert written.frames == 2
    plan = raycam.video.VideoPlan(car, "stereo/left")
    assert repr(plan) == "VideoPlan: 96 frames of 32 x 24, 24 a second, 4 s"
    raycam.video.write_video(car, tmp_path / "film", camera="stereo/left", frames=(0, 1), samples=1)
    assert (tmp_path / "film" / "frame_0000.png").exists()


def test_repr_of_a_recipe_lists_its_parts(tmp_path: Path) -> None:
    recipe = raycam.Recipe({"object": [{"box": {}}, {"sphere": {}}], "camera": {}}, seed=7)
    assert repr(recipe) == "Recipe of a dict, seed 7: 2 [[object]], 0 [[light]], 1 [[camera]]"


def test_impossible_view_raises_with_the_closest_attempt() -> None:
    see = {"object": "ball", "distance": [4, 5], "coverage": [0.5, 0.6]}
    recipe = {
        "object": [{"name": "ball", "sphere": {"radius": 0.5}}],
        "camera": [{"size": [32, 24], "fov": 40, "see": see}],
    }
    with pytest.raises(raycam.WorldError) as raised:
        raycam.sample(recipe)
    said = str(raised.value)
    share = float(said.partition("best try: coverage ")[2].split(",")[0])
    # A ball of radius 0.5 at 4 m, in an image 40 degrees high with the aspect ratio 4/3.
    nearest = np.pi * 0.25 / 16 / (np.tan(np.radians(20)) ** 2 * 4 * 4 / 3)
    assert share == pytest.approx(nearest, rel=0.25)
    assert "size 1 x 1 x 1 m" in said


@pytest.mark.parametrize(
    ("light", "said"),
    [
        ({"type": "sun", "power": 3}, fault("unknown_key", "irradiance")),
        ({"type": "point", "irradiance": 3}, fault("unknown_key", "power", "intensity")),
        ({"type": "area", "intensity": 3}, fault("unknown_key", "radiance")),
        ({"type": "environment", "strength": 3}, fault("unknown_key", "scale")),
        ({"type": "spot", "energy": 3}, fault("unknown_key", "power")),
    ],
)
def test_wrong_light_strengths_raise_with_the_expected_key(light: dict[str, object], said: Fault) -> None:
    with raises(raycam.WorldError, **said):
        raycam.World().add_light(light)
