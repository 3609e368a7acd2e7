"""Meshes in other units, mirrored or elsewhere: the notice contains the factor that fits."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
import trimesh
from raycam.photos.camera_grid import CameraGrid
from raycam.photos.placement import OTHER_FACTORS, TURNS, UNIT_FACTORS, find_best_scale, placement_notices
from support.box_table import ring, table
from support.raises import check_mentions, has_notice


def mesh_of(triangles: np.ndarray) -> raycam.World:
    """A world with the triangles [n, 3, 3]."""
    world = raycam.World()
    world.add_mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    return world


def moved_table(matrix: np.ndarray) -> raycam.World:
    """The table's triangles, moved by a matrix 4 x 4."""
    things = table()
    things.remove_object("table")
    return mesh_of(things.triangles() @ matrix[:3, :3].T + matrix[:3, 3])


def scale_of(world: raycam.World, given: dict[str, raycam.Camera]) -> tuple[float, int]:
    """The unit factor that fits best, or else the best other factor, with the number of cameras."""
    assert world.bounds is not None
    grid = CameraGrid(list(given.values()))
    found = [find_best_scale(world, world.bounds, grid, factors) for factors in (UNIT_FACTORS, OTHER_FACTORS)]
    return max(found, key=lambda pair: pair[1])


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
    best, count = scale_of(moved_table(matrix), high)
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
    view = CameraGrid(list(cameras().values())).view(world)
    assert view.shows.all()
    assert not view.fronts.any()
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
    best, count = scale_of(world, cameras())
    assert CameraGrid(list(cameras().values())).view(world).fronts.sum() < count == 2
    [notice] = placement_notices(world, cameras())
    assert notice.code == "misplaced_mesh"
    assert not has_notice([notice], "misplaced_mesh", f"{best:g}")


UNITS = [1000.0, 100.0, 10.0, 1 / 0.0254, 1 / 0.3048, 0.3048, 0.0254, 0.1, 0.01, 0.001]
"""Sizes of a mesh in another unit, relative to its size in metres."""


def ring_around(target: np.ndarray) -> dict[str, raycam.Camera]:
    """Cameras at a distance of about 1.6 m from a target."""
    turns = np.arange(12) * 2.4
    ways = np.stack([np.cos(turns), np.sin(turns), np.linspace(-0.3, 0.5, 12)], axis=1)
    return {
        str(i): raycam.Camera.look_at(target + 1.6 * way / np.linalg.norm(way), target, size=(96, 64), fov=45)
        for i, way in enumerate(ways)
    }


def open_vase() -> np.ndarray:
    """Triangles of a thick vase of 1 m without a lid, whose lining faces inwards."""
    profile = [
        [0.0, -0.5],
        [0.35, -0.45],
        [0.4, 0.1],
        [0.3, 0.5],
        [0.27, 0.5],
        [0.37, 0.1],
        [0.3, -0.4],
        [0, -0.42],
    ]
    vase = trimesh.creation.revolve(profile, sections=24)
    return np.array(vase.vertices[vase.faces])


@pytest.mark.parametrize("size", UNITS)
def test_object_in_another_unit_gets_its_factor(size: float) -> None:
    target = np.array([3.0, 1.0, 0.7])
    around = ring_around(target)
    assert placement_notices(mesh_of(open_vase() + target), around) == []
    [notice] = placement_notices(mesh_of(size * (open_vase() + target)), around)
    assert notice.code == "misplaced_mesh"
    check_mentions(str(notice), [f"scale the mesh by {1 / size:g} ", "12 cameras"])


@pytest.mark.parametrize("size", [1000.0, 100.0, 1 / 0.0254])
def test_large_object_around_the_cameras_gets_its_factor(size: float) -> None:
    # The cameras inside the vase show its lining, as in a scan of a room.
    around = ring_around(np.zeros(3))
    assert CameraGrid(list(around.values())).view(mesh_of(size * open_vase())).fronts.mean() > 0.5
    [notice] = placement_notices(mesh_of(size * open_vase()), around)
    assert notice.code == "misplaced_mesh"
    check_mentions(str(notice), [f"scale the mesh by {1 / size:g} "])


def room_and_cameras(offset: list[float]) -> tuple[np.ndarray, dict[str, raycam.Camera]]:
    """Triangles of a room with a table in it, and cameras that look in all directions from all over the room."""
    room = raycam.World()
    room.add_object(box={"size": [6, 5, 3]}, location=[0, 0, 1.5])
    walls = room.triangles()[:, ::-1]
    random, found = np.random.default_rng(3), {}
    for i in range(20):
        place = random.uniform([-2.3, -2, 1], [2.3, 2, 1.8])
        turn = random.uniform(0, 2 * np.pi)
        way = [np.cos(turn), np.sin(turn), random.uniform(-0.4, 0.1)]
        found[str(i)] = raycam.Camera.look_at(place + offset, place + offset + way, size=(96, 64), fov=65)
    return np.concatenate([walls, 0.3 * open_vase() + [1, 0.5, 0.4]]) + offset, found


@pytest.mark.parametrize("size", UNITS)
def test_room_in_another_unit_gets_its_factor(size: float) -> None:
    walls, inside = room_and_cameras([10, 4, 0])
    assert placement_notices(mesh_of(walls), inside) == []
    [notice] = placement_notices(mesh_of(size * walls), inside)
    assert notice.code == "misplaced_mesh"
    check_mentions(str(notice), [f"scale the mesh by {1 / size:g} "])


@pytest.mark.parametrize("size", [1000.0, 100.0, 0.1, 0.01, 0.001, 0.0254])
def test_room_around_the_origin_in_another_unit_gets_its_factor(size: float) -> None:
    walls, inside = room_and_cameras([0, 0, -1.4] if size > 1 else [0, 0, 0])
    [notice] = placement_notices(mesh_of(size * walls), inside)
    check_mentions(str(notice), [f"scale the mesh by {1 / size:g} "])


@pytest.mark.parametrize("shift", [0.0, 40.0])
@pytest.mark.parametrize(
    "places",
    [
        [[0.5 * np.cos(a), 0.5 * np.sin(a), 1.5] for a in np.arange(6) * np.pi / 3],
        [[0.05 * step, 0, 1.5] for step in range(30)],
        [[-0.1, 0, 1.5], [0, 0, 1.5], [0.1, 0, 1.5]],
        [[0.02 * i, 0, 1.5 + 0.02 * j] for i in range(3) for j in range(3)],
    ],
    ids=["vehicle", "short drive", "three in a row", "array"],
)
def test_cameras_close_together_in_a_street_give_no_notice(places: list[list[float]], shift: float) -> None:
    street = np.array(
        [[x, y, z] for z in (0, 20) for x, y in ((-90, -60), (90, -60), (90, 60), (-90, 60))], float
    )
    turns = np.arange(len(places)) * (np.pi / 3 if len(places) == 6 else 0)
    cameras = {
        str(number): raycam.Camera.look_at(
            (at := np.add(place, [shift, shift / 2, 0])),
            np.add(at, [np.cos(a), np.sin(a), -0.05]),
            size=(96, 64),
            fov=65,
        )
        for number, (place, a) in enumerate(zip(places, turns, strict=True))
    }
    sides = np.array([[4, 0, 1], [4, 1, 5], [5, 1, 2], [5, 2, 6], [6, 2, 3], [6, 3, 7], [7, 3, 0], [7, 0, 4]])
    ground = np.array([[0, 1, 2], [0, 2, 3]])
    world = raycam.World()
    world.add_mesh(np.add(street, [shift, shift / 2, 0]), np.concatenate([sides, ground]))
    assert placement_notices(world, cameras) == []


def test_panorama_and_cameras_across_a_room_give_no_notice() -> None:
    walls, inside = room_and_cameras([0, 0, 0])
    same = {name: camera.at_pose(camera.R, [0.5, 0.2, 1.5]) for name, camera in inside.items()}
    assert placement_notices(mesh_of(walls), same) == []
    turns = np.arange(16) / 16 * 2 * np.pi
    across = {
        str(a): raycam.Camera.look_at(
            [2.4 * np.cos(a), 2 * np.sin(a), 1.5], [0, 0, 1.3], size=(96, 64), fov=65
        )
        for a in turns
    }
    assert placement_notices(mesh_of(walls), across) == []
