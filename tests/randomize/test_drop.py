"""Objects of recipes that are dropped."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
import raycam
from raycam import Recipe, WorldError
from support.raises import check_mentions

TRAY = [
    {"name": "tray/bottom", "box": {"size": [0.4, 0.3, 0.01]}},
    {"name": "tray/left", "box": {"size": [0.01, 0.3, 0.1]}, "location": [-0.2, 0, 0.05]},
    {"name": "tray/right", "box": {"size": [0.01, 0.3, 0.1]}, "location": [0.2, 0, 0.05]},
    {"name": "tray/front", "box": {"size": [0.41, 0.01, 0.1]}, "location": [0, -0.15, 0.05]},
    {"name": "tray/back", "box": {"size": [0.41, 0.01, 0.1]}, "location": [0, 0.15, 0.05]},
]


def recipe(*rows: dict[str, Any]) -> Recipe:
    return Recipe({"seed": 3, "object": [*TRAY, *rows], "light": [{"type": "sky", "radiance": 1.0}]})


PARTS = {
    "name": "part",
    "category": "part",
    "count": {"integer": [2, 4]},
    "one_of": [{"box": {"size": [0.05, 0.04, 0.03]}}, {"cylinder": {"radius": 0.02, "height": 0.05}}],
    "drop": {"into": "tray"},
}


def test_dropped_objects_rest_in_the_tray() -> None:
    worlds = recipe(PARTS)
    counts = set()
    for number in range(3):
        parts = worlds.world(number).objects[5:]
        counts.add(len(parts))
        for part in parts:
            x, y, z = part.matrix[:3, 3]
            assert abs(x) < 0.195
            assert abs(y) < 0.145
            assert 0.005 < z < 0.1
    assert counts <= {2, 3, 4}


def test_worlds_with_dropped_objects_depend_only_on_seed_and_number() -> None:
    assert recipe(PARTS).world(1).to_bytes() == recipe(PARTS).world(1).to_bytes()
    assert recipe(PARTS).world(1).to_bytes() != recipe(PARTS).world(2).to_bytes()


def test_scaled_objects_of_one_shape_share_a_mesh_and_keep_their_scales() -> None:
    row = {
        "name": "ball",
        "category": "ball",
        "sphere": {"radius": 0.02, "level": 2},
        "drop": {"into": "tray"},
    }
    world = recipe({**row, "count": 2, "scale": 1.5}).world(0)
    assert world.objects[5].mesh == world.objects[6].mesh
    for ball in world.objects[5:]:
        np.testing.assert_allclose(np.linalg.svd(ball.matrix[:3, :3])[1], 1.5)
        assert 0.034 < ball.matrix[2, 3] < 0.037


def test_placed_and_dropped_objects_do_not_move_each_other() -> None:
    placed = {"name": "post", "box": {"size": [0.05, 0.05, 0.05]}, "on": "tray/bottom"}
    alone = recipe(placed).world(0).objects[5].matrix
    world = recipe(placed, PARTS).world(0)
    np.testing.assert_array_equal(world.objects[5].matrix, alone)


def test_objects_fall_before_the_objects_that_drop_on_them() -> None:
    tower = {"name": "slab", "box": {"size": [0.3, 0.2, 0.02]}, "drop": {"into": "tray"}}
    top = {"name": "cube", "box": {"size": [0.03, 0.03, 0.03]}, "drop": {"on": "slab"}}
    world = recipe(tower, top).world(0)
    slab, cube = world.objects[5:]
    assert slab.visible
    assert cube.visible
    # The slab and the cube may lean against the tray's walls.
    on_slab = np.linalg.inv(slab.matrix) @ cube.matrix
    corners = (
        np.array(list(itertools.product([-0.015, 0.015], repeat=3))) @ on_slab[:3, :3].T + on_slab[:3, 3]
    )
    assert abs(corners[:, 2].min() - 0.01) < 1e-3
    assert (abs(on_slab[:2, 3]) < [0.15, 0.1]).all()


@pytest.mark.parametrize(
    ("row", "code", "fact"),
    [
        ({"drop": {}}, "missing_value", "into"),
        ({"drop": {"into": "tray", "on": "tray"}}, "missing_value", "into"),
        ({"drop": "tray"}, "wrong_type", "'tray'"),
        ({"drop": {"into": 3}}, "wrong_type", "3"),
        ({"drop": {"into": "trai"}}, "unknown_name", "'trai'"),
        ({"drop": {"in": "tray"}}, "unknown_key", "'in'"),
        ({"drop": {"into": "tray", "seconds": 0}}, "out_of_range", "seconds"),
        ({"drop": {"into": "tray"}, "on": "tray"}, "conflicting_values", "drop"),
        ({"drop": {"into": "tray"}, "location": [0, 0, 0]}, "conflicting_values", "drop"),
        ({"drop": {"into": "tray"}, "physics": {"mass": 1}}, "unknown_key", "'mass'"),
        ({"drop": {"into": "tray"}, "physics": 3}, "wrong_type", "3"),
    ],
)
def test_wrong_keys_are_refused(row: dict[str, Any], code: str, fact: str) -> None:
    worlds = recipe({"name": "part", "box": {"size": 0.03}, **row})
    with pytest.raises(raycam.Error) as refused:
        worlds.world(0)
    assert refused.value.code == code
    assert fact in str(refused.value)


def test_objects_without_room_are_drawn_again_and_then_refused() -> None:
    worlds = recipe({"name": "crate", "box": {"size": 1.0}, "drop": {"into": "tray", "seconds": 0.2}})
    with pytest.raises(WorldError) as refused:
        worlds.world(0)
    assert refused.value.code == "not_settled"
    check_mentions(str(refused.value), [10, "world 0"])
