"""Backgrounds that recipes choose at random from a folder.

The choice depends on the seed; worlds, data sets and their manifests contain it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.dataset import write
from support.raises import Fault, fault, raises

SIZE = [24, 16]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    home = tmp_path / "recipe"
    for i, name in enumerate(["a.png", "b.PNG", "c/d.png", "e.png"]):
        path = home / "photos" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGB", (48, 32), (60 * i, 200 - 40 * i, 7)).save(path)
    (home / "photos" / "notes.txt").write_text("no picture")
    return home


def recipe(folder: Path, seed: int = 4, **more: Any) -> raycam.Recipe:
    description: dict[str, Any] = {
        "object": [
            {"sphere": {"radius": 0.4}, "category": "ball", "color": {"uniform": [[0, 0, 0], [1, 1, 1]]}}
        ],
        "light": [{"type": "sun", "direction": [0, 1, -1], "irradiance": 2}],
        "camera": [{"count": 2, "name": "cam", "size": SIZE, "fov": 40, "see": {"distance": [3, 4]}}],
        "background": "photos",
    }
    return raycam.Recipe(description | more, folder=folder, seed=seed)


def drawn(recipe: raycam.Recipe, count: int = 12) -> list[str]:
    found = []
    for number in range(count):
        for camera in recipe.world(number).cameras.values():
            assert camera.background is not None
            found.append(Path(camera.background.file).name)
    return found


def test_backgrounds_depend_on_seed_and_world(folder: Path) -> None:
    first = drawn(recipe(folder))
    assert first == drawn(recipe(folder))
    assert first[:4] == drawn(recipe(folder), 2)
    assert first != drawn(recipe(folder, seed=5))
    assert set(first) == {"a.png", "b.PNG", "d.png", "e.png"}
    world = recipe(folder).world(3)
    name, camera = next(iter(world.cameras.items()))
    seen = raycam.render(world, camera, samples=1).to_srgb8()[0, 0]
    assert camera.background is not None
    np.testing.assert_array_equal(seen, np.asarray(Image.open(camera.background.file))[0, 0])
    assert recipe(folder).background_name(3, name) in {"a.png", "b.PNG", "c/d.png", "e.png"}


@pytest.mark.parametrize("given", [False, True])
def test_data_sets_contain_and_list_the_backgrounds(folder: Path, tmp_path: Path, given: bool) -> None:
    cameras = [raycam.Camera.look_at([0, -3, 0], [0, 0, 0], fov=50, size=SIZE)] if given else None
    for name, workers in (("one", None), ("two", 2)):
        write(recipe(folder), tmp_path / name, cameras=cameras, count=4, samples=1, workers=workers)
    rows = json.loads((tmp_path / "one" / "backgrounds.json").read_bytes())
    images = json.loads((tmp_path / "one" / "annotations" / "instances.json").read_bytes())["images"]
    assert len(rows) == len(images) == (4 if given else 8)
    for row, image in zip(rows, images, strict=True):
        assert row["background"] == image["background"]
        path = Path("images") / image["file_name"]
        corner = np.asarray(Image.open(tmp_path / "one" / path))[0, 0]
        expected = np.asarray(Image.open(folder / "photos" / row["background"]))[0, 0]
        np.testing.assert_array_equal(corner, expected)
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()
    assert len({row["background"] for row in rows}) > 1


def test_changed_background_folder_is_refused_on_resume(folder: Path, tmp_path: Path) -> None:
    write(recipe(folder), tmp_path / "set", count=1, samples=1)
    Image.new("RGB", (9, 9)).save(folder / "photos" / "more.png")
    with pytest.raises(raycam.JobError):
        write(recipe(folder), tmp_path / "set", count=1, samples=1)


def test_camera_with_a_background_keeps_it(folder: Path) -> None:
    cameras = [
        {"size": [48, 32], "fov": 40, "location": [0, -4, 0], "background": {"choice": ["photos/e.png"]}}
    ]
    world = recipe(folder, camera=cameras).world(0)
    behind = world.default_camera().background
    assert behind is not None
    assert Path(behind.file) == folder / "photos" / "e.png"


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("../out", fault("outside_root", "'../out'")),
        ("none", fault("unknown_name", "'none'")),
        ("empty", fault("missing_value", "'empty'")),
        ({"folder": "photos", "fit": "fill"}, fault("unknown_name", "'fill'")),
        ({"directory": "photos"}, fault("unknown_key", "'directory'")),
        (3, fault("wrong_type")),
    ],
)
def test_invalid_backgrounds_are_refused(folder: Path, value: Any, words: Fault) -> None:
    (folder / "empty").mkdir()
    (folder.parent / "out").mkdir()
    with raises(raycam.WorldError, **words):
        recipe(folder, background=value).world(0)
