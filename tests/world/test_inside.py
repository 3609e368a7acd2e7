"""Inside tests, winding numbers and topology, compared with definitions and solid angles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import raises
from support.surfaces import Surface, cube, joined, torus

Floats = npt.NDArray[np.float64]


def world_of(*surfaces: Surface, **placement: object) -> raycam.World:
    world = raycam.World()
    for vertices, faces in surfaces:
        world.add_mesh(vertices, faces, **placement)
    return world


def solid_angles(triangles: Floats, points: Floats) -> Floats:
    """Winding numbers by the sum of solid angles (Van Oosterom and Strackee 1983)."""
    a, b, c = (triangles[:, i] - points[:, None] for i in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    top = (a * np.cross(b, c)).sum(-1)
    below = la * lb * lc + (a * b).sum(-1) * lc + (a * c).sum(-1) * lb + (b * c).sum(-1) * la
    angles: Floats = 2 * np.arctan2(top, below).sum(axis=1) / (4 * np.pi)
    return angles


def test_inside_of_a_box_is_half_open() -> None:
    low, high = np.array([0.1, -0.3, 0.7]), np.array([1.1, 0.2, 1.9])
    world = world_of(cube(low, high, 3))
    steps = [0.0, 1 / 3, 0.5, 1.0]
    grid = np.array([[x, y, z] for x in (-0.1, *steps, 1.1) for y in steps for z in steps])
    points = np.where(grid == 1.0, high, np.where(grid == 0.0, low, low + grid * (high - low)))
    expected = ((low <= points) & (points < high)).all(axis=1)
    np.testing.assert_array_equal(world.inside(points), expected)
    eighths = np.array([[x, y, z] for x in (0, 0.5, 1) for y in (0, 0.5, 1) for z in (0, 0.5, 1)])
    cells = world_of(*(cube(corner, np.array(corner) + 0.5) for corner in eighths[(eighths < 1).all(axis=1)]))
    owners = sum(cells.inside(eighths, objects=[number]).astype(int) for number in range(8))
    # Adjacent bodies fill space without gaps.
    np.testing.assert_array_equal(owners, (eighths < 1).all(axis=1))


def test_inside_handles_unions_hollow_and_inside_out_bodies() -> None:
    random = np.random.default_rng(1)
    points = random.uniform(-1, 3, (3000, 3))
    points[:1000] = np.round(points[:1000], 1)

    def within(low: float, high: float) -> npt.NDArray[np.bool_]:
        return ((low <= points) & (points < high)).all(axis=1)

    big, small = cube((0, 0, 0), (2, 2, 2), 2), cube((0.5, 0.5, 0.5), (2.5, 2.5, 2.5))
    one = world_of(joined(big, small))
    np.testing.assert_array_equal(one.inside(points), within(0, 2) | within(0.5, 2.5))
    winding = one.winding_number(points)
    np.testing.assert_array_equal(winding, within(0, 2).astype(float) + within(0.5, 2.5))
    hollow = cube((0.5, 0.5, 0.5), (1.5, 1.5, 1.5))
    shell = world_of(joined(big, (hollow[0], hollow[1][:, ::-1])))
    np.testing.assert_array_equal(shell.inside(points), within(0, 2) & ~within(0.5, 1.5))
    inside_out = world_of((big[0], big[1][:, ::-1]))
    np.testing.assert_array_equal(inside_out.inside(points), within(0, 2))
    np.testing.assert_array_equal(inside_out.winding_number(points), -within(0, 2).astype(float))
    faces = big[1].copy()
    faces[::3] = faces[::3, ::-1]
    mixed = world_of((big[0], faces))
    assert not mixed.topology(0).oriented
    np.testing.assert_array_equal(mixed.inside(points), within(0, 2))
    two = world_of(big, small)
    np.testing.assert_array_equal(two.inside(points), within(0, 2) | within(0.5, 2.5))
    np.testing.assert_array_equal(two.inside(points, objects=[1]), within(0.5, 2.5))


@pytest.mark.parametrize("offset", [0.0, 220e3])
def test_inside_of_distant_cubes_and_transformed_tori_is_exact(offset: float) -> None:
    random = np.random.default_rng(3)
    world = world_of(cube((offset, 0, 0), (offset + 1, 1, 1)))
    points = random.uniform(-0.1, 1.1, (2000, 3)) + np.array([offset, 0, 0])
    expected = ((points >= [offset, 0, 0]) & (points < [offset + 1, 1, 1])).all(axis=1)
    np.testing.assert_array_equal(world.inside(points), expected)
    matrix = np.array([[-0.8, 0.6, 0, offset], [0.6, 0.8, 0.5, 0], [0, 0.1, 1.5, 1], [0, 0, 0, 1]])
    ring = world_of(torus(), matrix=matrix)
    around = random.normal(size=(500, 3)) + matrix[:3, 3]
    by_angles = -solid_angles(ring.triangles(), around)
    # Mirroring does not exchange a mesh's inside and outside.
    np.testing.assert_array_equal(ring.winding_number(around), np.round(by_angles))
    np.testing.assert_array_equal(ring.inside(around), np.abs(by_angles) > 0.5)


def test_winding_numbers_of_open_meshes_equal_solid_angles() -> None:
    random = np.random.default_rng(9)
    vertices, faces = torus(24, 16)
    for share in (0.02, 0.3, 0.9):
        kept = faces[random.random(len(faces)) > share]
        turned = random.random(len(kept)) < 0.1
        kept[turned] = kept[turned][:, ::-1]
        world = world_of((vertices, kept))
        points = random.normal(size=(200, 3))
        expected = solid_angles(world.triangles(), points)
        np.testing.assert_allclose(world.winding_number(points), expected, atol=1e-11)
    box = cube()
    lid = (box[0][box[1]][:, :, 2] == 1).all(axis=1)
    open_box = world_of((box[0], box[1][~lid]))
    points = random.uniform(0, 1, (500, 3)) * [1, 1, 0.49]
    assert open_box.inside(points).all()
    assert not open_box.inside(points + np.array([0, 0, 1.0])).any()
    assert (open_box.winding_number([[np.nan, 0, 0], [np.inf, 0, 0]]) == 0).all()
    # In the cone's direction, a boundary edge is in front of the point.
    for point in open_box.triangles()[0] - np.array([[0.36, 0.48, 0.8]]):
        np.testing.assert_allclose(
            open_box.winding_number(point), solid_angles(open_box.triangles(), point[None])[0], atol=1e-9
        )


def test_topology_reports_closed_components_and_boundary_edges() -> None:
    world = raycam.World()
    box = cube((0, 0, 0), (2, 3, 4), 2)
    world.add_mesh(*box, name="box", scale=2)
    world.add_mesh(*joined(box, cube((5, 5, 5), (6, 6, 6))), name="two")
    world.add_mesh(box[0], box[1][1:], name="open")
    world.add_mesh(*torus(twist=True), name="klein")
    found = world.topology("box")
    assert (found.closed, found.oriented, found.components, found.boundary_edges.shape) == (
        True,
        True,
        1,
        (0, 2),
    )
    assert found.volume == pytest.approx(24 * 8)
    assert world.topology(1).components == 2
    opened = world.topology("open")
    assert (opened.closed, opened.boundary_edges.shape, opened.boundary_edges.dtype) == (
        False,
        (3, 2),
        np.int32,
    )
    gap = box[0][box[1][0]]
    assert {tuple(p) for p in box[0][opened.boundary_edges].reshape(-1, 3)} == {tuple(p) for p in gap}
    klein = world.topology("klein")
    assert klein.closed
    assert not klein.oriented
    with raises(raycam.WorldError, code="unknown_name", mentions=["'klein'"]):
        world.topology("Kleyn")


def test_inside_of_an_empty_world_and_nan_points_is_false() -> None:
    assert not raycam.World().inside([0, 0, 0])
    world = world_of(cube())
    assert world.inside([[np.nan, 0.5, 0.5], [0.5, 0.5, 0.5]]).tolist() == [False, True]
    assert world.inside(np.zeros((2, 0, 3))).shape == (2, 0)
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["[..", "3]", "[2]"]):
        world.inside([0.5, 0.5])


def test_hidden_objects_are_ignored_by_point_queries() -> None:
    vertices, faces = cube()
    world = raycam.World()
    world.add_mesh(vertices, faces, name="closed")
    world.add_mesh(vertices + 5, faces[1:], name="open")
    points = [[0.5, 0.5, 0.5], [5.5, 5.5, 5.5]]
    assert world.inside(points).tolist() == [True, True]
    for name in ("closed", "open"):
        world.set_object(name, visible=False)
    assert world.inside(points).tolist() == [False, False]
    assert world.winding_number(points).tolist() == [0, 0]
    assert np.isinf(world.distance(points)).all()
    assert world.count_intersections(points, [0, 0, 1.0]).tolist() == [0, 0]
    assert world.visible(points, [0, 0, 9.0]).all()
