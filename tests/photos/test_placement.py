"""Meshes in other units, mirrored or elsewhere: the notice contains the factor that fits."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
import trimesh
from raycam.photos.placement import TURNS, count_cameras, find_best_scale, placement_notices
from support.box_table import ring, table
from support.raises import check_mentions, has_notice


def moved_table(matrix: np.ndarray) -> raycam.World:
    """The table's triangles, moved by a matrix 4 x 4."""
    world, things = raycam.World(), table()
    things.remove_object("table")
    corners = things.triangles().reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    world.add_mesh(corners, np.arange(len(corners)).reshape(-1, 3))
    return world


def cameras() -> dict[str, raycam.Camera]:
    return {str(i): camera for i, camera in enumerate(ring(6))}


@pytest.mark.parametrize("scale", [1000.0, 100.0, 0.001, 1 / 0.0254, -1.0, 437.0, 0.0031])
def test_notice_contains_the_factor_that_undoes_a_scale(scale: float) -> None:
    up = 5 if scale < 0 else 0  # around the origin, a mirrored mesh looks inside out
    matrix = np.diag([scale, scale, scale, 1])
    matrix[2, 3] = scale * up
    high = {
        name: camera.at_pose(camera.R, camera.location + np.array([0, 0, up]))
        for name, camera in cameras().items()
    }
    [notice] = placement_notices(moved_table(matrix), high)
    assert notice.code == "misplaced_mesh"
    best, count = find_best_scale(moved_table(matrix), list(high.values()), inside=False)
    assert count == 6
    check_mentions(str(notice), [f"{best:g}", count])
    # The factor fits every camera; for a model without units it need not be the exact factor.
    assert abs(np.log2(abs(best * scale))) < 2.5
    assert np.sign(best) == np.sign(scale)


@pytest.mark.parametrize(("name", "turn"), TURNS.items())
def test_notice_contains_the_rotation_that_restores_the_axes(name: str, turn: np.ndarray) -> None:
    matrix, high = np.eye(4), np.array([0, 0, 5.0])
    matrix[:3, :3], matrix[:3, 3] = turn.T, turn.T @ high
    above = {name: camera.at_pose(camera.R, camera.location + high) for name, camera in cameras().items()}
    [notice] = placement_notices(moved_table(matrix), above)
    assert notice.code == "misplaced_mesh"
    check_mentions(str(notice), [name, "visible to 6 cameras"])
    matrix[:3, :3], matrix[:3, 3] = np.eye(3), high
    assert placement_notices(moved_table(matrix), above) == []


def test_misplaced_mesh_gives_a_notice_with_both_positions() -> None:
    move = np.eye(4)
    move[:3, 3] = [500, 0, -300]
    [notice] = placement_notices(moved_table(move), cameras())
    assert notice.code == "misplaced_mesh"
    assert "500" in str(notice)


def test_well_placed_and_inside_out_meshes_give_no_notice() -> None:
    assert placement_notices(table(), cameras()) == []
    world = raycam.World()
    corners = table().triangles()[:, ::-1]
    world.add_mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    assert placement_notices(world, cameras()) == []


@pytest.mark.parametrize("side", [1, -1])
def test_closed_inside_out_or_mirrored_mesh_between_cameras_gives_no_notice(side: int) -> None:
    # At 1000 times its size, such a mesh would show its fronts to the cameras, which would then be inside it.
    ball = trimesh.creation.icosphere(subdivisions=2)
    world = raycam.World()
    world.add_mesh(ball.vertices * [1, 1, side], ball.faces[:, ::-side])
    assert count_cameras(world, list(cameras().values())) == (6, 0)
    assert placement_notices(world, cameras()) == []


def test_room_seen_from_inside_gives_no_notice() -> None:
    room = raycam.World()
    room.add_object(box={"size": [6, 5, 3]})
    around = {
        str(a): raycam.Camera.look_at([1, 0, 0], [1 + np.cos(a), np.sin(a), 0], size=(64, 48), fov=60)
        for a in range(6)
    }
    assert placement_notices(room, around) == []


def test_mesh_visible_to_half_of_the_cameras_gives_no_notice() -> None:
    away = raycam.Camera.look_at([9, 9, 9], [99, 99, 99], size=(64, 48), fov=40)
    some = dict(list(cameras().items())[:2])
    assert placement_notices(table(), {**some, "a": away, "b": away}) == []
    assert placement_notices(table(), {**some, "a": away, "b": away, "c": away}) != []


def test_notice_recommends_no_scale_that_fits_few_cameras() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    world = raycam.World()
    world.add_mesh(ball.vertices * 0.5 + [8, 0.3, 0], ball.faces)
    best, count = find_best_scale(world, list(cameras().values()), inside=False)
    assert count_cameras(world, list(cameras().values()))[1] < count == 2
    [notice] = placement_notices(world, cameras())
    assert notice.code == "misplaced_mesh"
    assert not has_notice([notice], "misplaced_mesh", f"{best:g}")
