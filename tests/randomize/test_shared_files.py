"""The worlds of a recipe share loaded files and search trees.

Sharing does not change the worlds.
"""

from __future__ import annotations

import pickle
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import Recipe


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", raycam.Notice)
        yield


def description(folder: Path) -> dict[str, Any]:
    """A recipe with a GLB, a texture and an environment in `folder`."""
    shutil.copy(raycam.data.path("spot.glb"), folder)
    shutil.copy(raycam.data.path("sky.hdr"), folder)
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(folder / "wood.png")
    return {
        "seed": 5,
        "object": [
            {"name": "table", "box": {"size": [12, 12, 0.1]}, "texture": "wood.png"},
            {"name": "still", "mesh": "spot.glb", "location": {"uniform": [[0, 0, 2], [1, 1, 3]]}},
            {"name": "cow", "mesh": "spot.glb", "on": "table", "color": {"uniform": [[0, 0, 0], [1, 1, 1]]}},
        ],
        "light": [{"type": "environment", "image": "sky.hdr"}],
        "camera": [{"size": [32, 24], "fov": 40, "see": {"object": "cow", "distance": [4, 6]}}],
    }


def test_second_world_shares_the_search_trees_of_the_first_world(tmp_path: Path) -> None:
    recipe = Recipe(description(tmp_path), folder=tmp_path)
    first, second = recipe.world(0), recipe.world(1)
    raycam.render(first, channels=["depth"])
    raycam.render(second, channels=["depth"])
    # The two cows are shared, but not the table, which is a primitive.
    assert first._core.objects_shared_with(second._core) == 2
    alone = Recipe(description(tmp_path), folder=tmp_path).world(1)
    raycam.render(alone, channels=["depth"])
    assert first._core.objects_shared_with(alone._core) == 0


def test_sharing_files_does_not_change_the_worlds(tmp_path: Path) -> None:
    recipe = Recipe(description(tmp_path), folder=tmp_path)
    recipe.world(0)
    for number in (1, 2):
        world, alone = recipe.world(number), Recipe(description(tmp_path), folder=tmp_path).world(number)
        assert world.to_bytes() == alone.to_bytes()
        assert [str(notice) for notice in world.notices] == [str(notice) for notice in alone.notices]
        for one, other in zip(world.objects, alone.objects, strict=True):
            assert one.name == other.name
        color = raycam.render(world, samples=2)["color"]
        np.testing.assert_array_equal(color, raycam.render(alone, samples=2)["color"])


def test_files_are_read_once(tmp_path: Path) -> None:
    recipe = Recipe(description(tmp_path), folder=tmp_path)
    expected = recipe.world(1).to_bytes()
    for name in ("spot.glb", "wood.png", "sky.hdr"):
        (tmp_path / name).unlink()
    assert recipe.world(1).to_bytes() == expected


def test_pickled_recipe_reads_the_files_again(tmp_path: Path) -> None:
    recipe = Recipe(description(tmp_path), folder=tmp_path)
    expected = recipe.world(1).to_bytes()
    again = pickle.loads(pickle.dumps(recipe))
    assert again.world(1).to_bytes() == expected
    assert "_shared" not in pickle.loads(pickle.dumps(recipe)).__dict__


def test_changing_one_world_leaves_the_others_unchanged(tmp_path: Path) -> None:
    recipe = Recipe(description(tmp_path), folder=tmp_path)
    expected = recipe.world(1).to_bytes()
    world = recipe.world(0)
    world.set_object("still", color="red")
    world.remove_object("cow")
    assert recipe.world(1).to_bytes() == expected
