"""Randomised worlds.

Contact is checked with trimesh, visibility with the ids in rendered images.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from raycam import _core
from raycam.randomize import Recipe, sample
from raycam.randomize.draws import RandomStream
from support.raises import Fault, fault, raises

RECIPE: dict[str, Any] = {
    "seed": 3,
    "object": [
        {
            "name": "floor",
            "plane": {"size": [6, 6]},
            "color": {"uniform": [[0.2, 0.2, 0.2], [0.9, 0.9, 0.9]]},
        },
        {"name": "table", "box": {"size": [1.2, 0.9, 0.7]}, "location": [0, 0, 0.35]},
        {"name": "lamp", "cylinder": {"radius": 0.1, "height": 0.6}, "location": [0.2, 0.1, 1.0]},
        {
            "one_of": [
                {
                    "name": "can",
                    "cylinder": {"radius": 0.07, "height": 0.25, "segments": 24},
                    "category": "can",
                },
                {
                    "name": "brick",
                    "box": {"size": {"uniform": [[0.1, 0.1, 0.05], [0.3, 0.2, 0.1]]}},
                    "roll": 90,
                },
            ],
            "count": {"integer": [8, 12]},
            "on": "table",
            "gap": 0.002,
            "color": {"uniform": [[0, 0, 0], [1, 1, 1]]},
        },
        {"name": "crate", "box": {"size": [0.4, 0.3, 0.3]}, "category": "crate", "count": 3, "on": "floor"},
    ],
    "light": [
        {"type": "sun", "direction": {"uniform": [[-1, -1, -1], [1, 1, -0.6]]}, "irradiance": [3, 3, 3]}
    ],
    "camera": [
        {
            "name": "eye",
            "count": 2,
            "size": [120, 90],
            "fov": 45,
            "see": {"object": "crate", "distance": [1.2, 3.0], "coverage": [0.02, 0.2], "visible": 0.7},
        }
    ],
}


@pytest.fixture(scope="module")
def recipe() -> Recipe:
    return Recipe(RECIPE)


def solids(world: raycam.World) -> dict[str, trimesh.Trimesh]:
    corners, ids = world.triangles(), world.triangle_ids()[:, 0]
    return {
        item.name: trimesh.Trimesh(*merged(corners[ids == item.id]), process=False) for item in world.objects
    }


def merged(corners: np.ndarray[Any, Any]) -> tuple[Any, Any]:
    points, index = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    return points, index.reshape(-1, 3)


def inside(one: trimesh.Trimesh, two: trimesh.Trimesh) -> bool:
    """True if any of many points on the surface of the first mesh is inside the second."""
    points = np.concatenate([one.vertices, trimesh.sample.sample_surface(one, 1000, seed=1)[0]])
    return bool(two.contains(points).any())


@pytest.mark.parametrize("number", [0, 5])
def test_placed_objects_rest_and_do_not_touch(recipe: Recipe, number: int) -> None:
    world = recipe.world(number)
    found = solids(world)
    placed = [name for name in found if "-" in name]
    assert 11 <= len(placed) <= 15
    for name in placed:
        surface = 0.0 if name.startswith("crate") else 0.7
        assert found[name].vertices[:, 2].min() == pytest.approx(surface, abs=1e-9)
        half = [3.0, 3.0] if surface == 0.0 else [0.6, 0.45]
        assert (np.abs(found[name].vertices[:, :2]) <= half).all()
        assert found[name].is_volume
    for i, one in enumerate(placed):
        for two in [*placed[i + 1 :], "lamp"]:
            a, b = found[one], found[two]
            if (a.bounds[0] - 0.05 > b.bounds[1]).any() or (b.bounds[0] - 0.05 > a.bounds[1]).any():
                continue
            assert not inside(a, b)
            assert not inside(b, a)
    crates = [name for name in placed if name.startswith("crate")]
    assert not any(inside(found[name], found["table"]) for name in crates)
    # A test of the check itself: an object is inside an enlarged copy of itself.
    larger = found[placed[0]].copy()
    larger.apply_translation([0.01, 0.01, 0.01])
    assert inside(found[placed[0]], larger)


def test_cameras_show_the_object_named_by_see(recipe: Recipe) -> None:
    world = recipe.world(1)
    assert list(world.cameras) == ["eye-1", "eye-2"]
    crates = [item.id for item in world.objects if item.category == "crate"]
    for camera in world.cameras.values():
        ids = raycam.render(world, camera, integrator="flat", samples=1, channels="instance")["instance"]
        good = []
        for item in raycam.label(world, camera, objects=crates):
            distance = float(np.linalg.norm(item.box3d.center - camera.C))
            share = np.count_nonzero(ids == item.object) / ids.size
            good.append(1.2 <= distance <= 3.0 and 0.02 <= share <= 0.2 and item.visible_fraction >= 0.7)
        assert any(good)


def test_world_does_not_depend_on_other_worlds(recipe: Recipe) -> None:
    again = Recipe(RECIPE).world(2).to_bytes()
    recipe.world(7)
    assert recipe.world(2).to_bytes() == again == sample(RECIPE, 2).to_bytes()
    assert recipe.world(3).to_bytes() != again
    assert sample(RECIPE, 2, seed=4).to_bytes() != again


def test_random_numbers_have_fixed_values() -> None:
    draw = RandomStream(7, "world", 3)
    assert draw.bits() == 6412036258656213758
    assert draw.substream("x").uniform01() == 0.5879778100305366
    values = np.array([draw.substream(i).uniform01() for i in range(4000)])
    assert values.mean() == pytest.approx(0.5, abs=0.02)
    counts = np.histogram(values, 10, (0, 1))[0]
    # The limit of chi squared for 9 degrees of freedom and a probability of 0.1 %.
    assert ((counts - 400) ** 2 / 400).sum() < 27.9


def test_drawn_values_are_in_their_ranges() -> None:
    draw = RandomStream(1)
    for i in range(200):
        found = draw.substream(i).value(
            {
                "a": {"uniform": [2, 3]},
                "b": {"uniform": [[0, 10], [1, 20]]},
                "c": {"integer": [1, 3]},
                "d": {"log_uniform": [0.01, 100]},
                "e": {"choice": ["x", {"uniform": [5, 6]}]},
            }
        )
        assert 2 <= found["a"] < 3
        assert 0 <= found["b"][0] < 1
        assert 10 <= found["b"][1] < 20
        assert found["c"] in (1, 2, 3)
        assert 0.01 <= found["d"] <= 100
        assert found["e"] == "x" or 5 <= found["e"] < 6


def test_recipe_with_y_up_and_a_base_world_places_objects(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(
        'up = "y"\n[[object]]\nname = "shelf"\nbox = { size = [1, 0.1, 0.5] }\nlocation = [0, 1, 0]\n'
    )
    (tmp_path / "r.toml").write_text(
        'world = "room.toml"\n[[object]]\nname = "cup"\ncylinder = { radius = 0.04, height = 0.1 }\npitch = -90\n'
        'count = 4\non = "shelf"\n'
        '[[camera]]\nsize = [64, 48]\nfov = 50\nsee = { object = "cup-2", visible = 0.3, distance = [0.5, 1] }\n'
    )
    world = sample(tmp_path / "r.toml", 0)
    found = solids(world)
    assert len(found) == 5
    assert all(found[f"cup-{i}"].vertices[:, 1].min() == pytest.approx(1.05, abs=1e-9) for i in range(1, 5))
    camera = world.cameras["camera"]
    assert camera.R[1] @ [0, 1, 0] < 0  # the image is upright
    assert camera.C[1] > 1.0


def test_world_without_room_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = raycam.Recipe(
        {
            "object": [
                {"name": "shelf", "box": {"size": [1, 1, 0.1]}},
                {
                    "name": "jar",
                    "box": {"size": 0.2},
                    "count": {"choice": [1, 4000]},
                    "on": "shelf",
                    "gap": 0.0,
                },
            ]
        }
    )
    monkeypatch.setattr("raycam.randomize.placement.MAX_TRIES", 64)
    worlds = [recipe.world(number) for number in range(6)]
    assert all(len(world.objects) == 2 for world in worlds)
    assert recipe.world(3).to_bytes() == worlds[3].to_bytes()
    assert len({world.to_bytes() for world in worlds}) == 6


def test_see_may_name_an_object_that_only_some_worlds_contain() -> None:
    recipe = raycam.Recipe(
        {
            "object": [{"name": {"choice": ["can", "ball"]}, "box": {"size": 1}}],
            "camera": [{"size": [32, 24], "fov": 40, "see": {"object": "can", "distance": [3, 4]}}],
        }
    )
    assert [recipe.world(number).objects[0].name for number in range(4)] == ["can"] * 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objects": []}, fault("unknown_key", "object")),
        ({"object": [{"box": {"size": 1}, "gap": 1}]}, fault("missing_value")),
        (
            {"object": [{"box": {"size": 1}, "on": "tabel"}, {"name": "table", "box": {"size": 1}}]},
            fault("unknown_name", "table"),
        ),
        (
            {"object": [{"box": {"size": 9}, "on": ""}, {"plane": {"size": 1}}]},
            fault("invalid_world", "10"),
        ),
        (
            {"object": [{"box": {"size": {"uniform": [2, 1]}}}]},
            fault("invalid_value", "object[0].box.size"),
        ),
        ({"object": [{"one_of": []}]}, fault("missing_value", "[0]")),
        (
            {"object": [{"box": {"size": 1}}], "camera": [{"size": [9, 9], "fov": 9, "see": {"objet": 1}}]},
            fault("unknown_key", "objet"),
        ),
        ({"world": "../x.toml"}, fault("outside_root", "'../x.toml'")),
    ],
)
def test_invalid_recipes_are_refused(change: dict[str, Any], message: Fault) -> None:
    with raises(raycam.WorldError, **message):
        sample(change)


@pytest.mark.parametrize("on", [{}, {"on": "table"}])
def test_recipe_error_contains_the_file_and_the_object(tmp_path: Path, on: dict[str, Any]) -> None:
    path = tmp_path / "table.recipe.toml"
    rows = ['[[object]]\nname = "table"\nbox = { size = 5 }\n', '[[object]]\nname = "ring"\n']
    rows += [f"{key} = {json.dumps(value)}\n" for key, value in on.items()]
    path.write_text("".join([*rows, "torus = { major = 0.1 }\n"]))
    with raises(raycam.WorldError, code="unknown_key") as caught:
        raycam.sample(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ")
    assert said.count(str(path)) == 1
    assert "ring" in said if on else "object[1]" in said


@pytest.mark.parametrize("place", ["../secret.off", "absolute"])
@pytest.mark.parametrize("placed", [{}, {"on": "table"}])
def test_recipe_opens_no_files_outside_of_its_folder(
    tmp_path: Path, place: str, placed: dict[str, Any]
) -> None:
    """Recipes may come from untrusted sources, so they may open fewer files than scripts."""
    secret, inside = tmp_path / "secret.off", tmp_path / "recipe"
    secret.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    inside.mkdir()
    (inside / "base.off").write_bytes(secret.read_bytes())
    name = str(secret) if place == "absolute" else place
    table = {"name": "table", "box": {"size": 5}}
    recipes: list[dict[str, Any]] = [
        {"object": [table, {"mesh": name, **placed}]},
        {"object": [{"box": {"size": 1}, "texture": name}]},
        {"object": [table], "light": [{"type": "environment", "image": name}]},
    ]
    if not placed:
        recipes.append({"world": "base.off", "object": [{"mesh": name}]})
    for description in recipes:
        recipe = raycam.Recipe(description, folder=inside)
        assert name not in recipe.files
        with raises(raycam.FormatError, code="outside_root"):
            recipe.world(0)


def test_files_of_a_recipe_include_all_textures(tmp_path: Path) -> None:
    for name in ("bumps.png", "rough.png"):
        (tmp_path / name).write_bytes(_core.encode_png(np.zeros((1, 1, 3), dtype=np.uint8)))
    textures = {"normal": {"image": "bumps.png"}, "roughness": {"choice": ["rough.png", "bumps.png"]}}
    recipe = raycam.Recipe({"object": [{"box": {"size": 1}, "textures": textures}]}, folder=tmp_path)
    assert sorted(recipe.files) == ["bumps.png", "rough.png"]


@pytest.mark.parametrize(
    "text",
    [
        '[[object]]\nbox = { size = 1 }\n[[camera]]\nsee = { object = "box" }\n',
        "[[object]]\nbox = { size = { uniform = [1, 2] } }\n",
        "[[object]]\nbox = { size = 1 }\ncount = 3\n",
        '[[object]]\nbox = { size = 1 }\ncolor = {choice = ["red", "blue"]}\n',
    ],
)
def test_loading_a_recipe_as_a_world_raises_with_the_remedy(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.toml").write_text(text)
    with raises(raycam.WorldError, mentions=["raycam.sample(", "--sample"]):
        raycam.load(tmp_path / "a.toml")


def test_error_of_a_plain_world_does_not_mention_recipes(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[[object]]\nbox = { size = 1 }\ncolour = 3\n")
    with pytest.raises(raycam.WorldError) as caught:
        raycam.load(tmp_path / "a.toml")
    assert "recipe" not in str(caught.value)
