"""Closest points, distances and visibility, compared with brute force and closed forms."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import raises
from support.surfaces import cube, torus

Floats = npt.NDArray[np.float64]


def brute_distance(points: Floats, triangles: Floats) -> Floats:
    """Distances to all triangles, by brute force.

    The distance to the plane counts if its foot point is inside the triangle, otherwise the distance to the
    three segments.
    """
    nearest = np.full(len(points), np.inf)
    for i, point in enumerate(points):
        corners = triangles - point
        squares = np.full(len(triangles), np.inf)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = (normal**2).sum(-1)
        inside = area > 0
        for a, b in ((0, 1), (1, 2), (2, 0)):
            start, along = corners[:, a], corners[:, b] - corners[:, a]
            length = (along**2).sum(-1)
            t = np.clip(-(start * along).sum(-1) / np.where(length > 0, length, 1), 0, 1)
            squares = np.minimum(squares, ((start + t[:, None] * along) ** 2).sum(-1))
            inside &= (normal * np.cross(corners[:, a], corners[:, b])).sum(-1) >= 0
        height = (normal * corners[:, 0]).sum(-1) ** 2 / np.where(area > 0, area, 1)
        nearest[i] = np.sqrt(np.where(inside, np.minimum(squares, height), squares).min())
    return nearest


def checked(world: raycam.World, points: Floats, rtol: float = 1e-12) -> dict[str, npt.NDArray[np.float64]]:
    """Closest points, after checking their fields with each other and with brute force."""
    found = world.closest_points(points)
    triangles = world.triangles()
    size = np.abs(triangles).max() + np.abs(points).max()
    np.testing.assert_allclose(
        found["distance"], brute_distance(points, triangles), rtol=rtol, atol=8e-16 * size
    )
    np.testing.assert_array_equal(world.distance(points), found["distance"])
    ids = {tuple(pair): i for i, pair in enumerate(world.triangle_ids().tolist())}
    rows = [ids[pair] for pair in zip(found["instance"].tolist(), found["triangle"].tolist(), strict=True)]
    corners = triangles[rows]
    weights = found["barycentric"]
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-15)
    np.testing.assert_allclose(
        (corners * weights[..., None]).sum(axis=1), found["position"], rtol=0, atol=1e-15 * size
    )
    between = np.linalg.norm(points - found["position"], axis=1)
    np.testing.assert_allclose(between, found["distance"], rtol=1e-9, atol=4e-16 * size)
    return found


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_distances_equal_brute_force(scale: float) -> None:
    random = np.random.default_rng(5)
    world = raycam.World()
    vertices, faces = torus(16, 10)
    world.add_mesh(vertices * scale, faces)
    matrix = np.array([[0.8, -0.6, 0, 3], [0.06, 0.08, 0.5, -2], [0, 0.1, -1.5, 1], [0, 0, 0, 1]])
    matrix[:3, 3] *= scale
    world.add_mesh(vertices * scale, faces, matrix=matrix)
    world.add_mesh(*cube(np.full(3, -0.2 * scale), np.full(3, 0.2 * scale), 3))
    points = random.normal(size=(300, 3)) * 2 * scale
    points[:50] = vertices[random.integers(len(vertices), size=50)] * scale
    points[50:80] *= 1e4
    checked(world, points)


@pytest.mark.parametrize("thickness", [1e-1, 1e-3, 1e-6])
def test_distances_to_flattened_objects_equal_brute_force(thickness: float) -> None:
    random = np.random.default_rng(6)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    for linear in (turn @ np.diag([1, thickness, 1]), np.diag([1, thickness, 1]) @ turn):
        world = raycam.World()
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([linear, [3, -2, 1]])
        world.add_mesh(*torus(16, 10), matrix=matrix)
        checked(world, random.normal([3, -2, 1], size=(150, 3)), rtol=1e-11)


def test_distances_to_distant_thin_and_flat_triangles_are_exact() -> None:
    random = np.random.default_rng(7)
    away = np.array([5e6, -3e6, 1e6])
    world = raycam.World()
    vertices, faces = torus(8, 6)
    world.add_mesh(vertices + away, faces)
    checked(world, away + random.normal(size=(100, 3)), rtol=1e-9)
    needles = raycam.World()
    corners = random.normal(size=(200, 3, 3))
    corners[:, 2] = corners[:, 0] + (corners[:, 1] - corners[:, 0]) * random.random((200, 1))
    corners[:80, 2] += random.normal(size=(80, 3)) * 1e-4
    corners[80:90] = corners[80:90, :1]
    needles.add_mesh(corners.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    checked(needles, random.normal(size=(100, 3)), rtol=1e-8)


@pytest.mark.parametrize("mirror", [1, -1])
def test_triangle_of_a_closest_point_on_an_edge_or_corner_faces_the_point(mirror: int) -> None:
    """The expected triangle has the largest cosine among the triangles that contain the closest point."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.05]]) * [1, mirror, 1]
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])[:, ::mirror]
    world = raycam.World()
    pose = np.diag([1.0, mirror, 1, 1])
    world.add_mesh(vertices * [1, mirror, 1], faces[:, ::mirror], matrix=pose)
    points = np.random.default_rng(8).uniform(-1, 2, size=(2000, 3))
    found = world.closest_points(points)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    away = (points - found["position"]) / found["distance"][:, None]
    cosines = away @ normals.T
    on = np.abs(((found["position"][:, None] - corners[:, 0]) * normals).sum(axis=2)) < 1e-12
    edges = np.roll(corners, -1, axis=1) - corners
    offsets = found["position"][:, None, None] - corners
    sides = (np.cross(edges, offsets) * normals[:, None]).sum(axis=3)
    on &= (sides > -1e-12).all(axis=2)
    assert (on.sum(axis=1) > 1).sum() > 500
    best = np.where(on, cosines, -2).max(axis=1)
    chosen = cosines[np.arange(len(points)), found["triangle"]]
    np.testing.assert_allclose(chosen, best, atol=2e-9)
    np.testing.assert_allclose(found["normal"], normals[found["triangle"]], atol=1e-12)


def test_distance_ties_limits_and_misses_are_deterministic() -> None:
    world = raycam.World()
    world.add_mesh(*cube((-1, -1, -1), (1, 1, 1)), name="a")
    world.add_mesh(*cube((-1, -1, -1), (1, 1, 1)), name="b")
    random = np.random.default_rng(0)
    corner = world.closest_points([2.0, 2, 2])
    assert (corner["distance"], corner["position"].tolist(), corner["instance"]) == (3**0.5, [1, 1, 1], 0)
    points = random.choice([-2.0, -1, 0, 1, 2], size=(200, 3))
    found = world.closest_points(points)
    assert (found["instance"] == 0).all()
    order = random.permutation(200)
    again = world.closest_points(points[order], threads=1)
    for name, values in found.items():
        np.testing.assert_array_equal(values[order], again[name], name)
    alone = [world.closest_points(point) for point in points[:40]]
    assert all(one["triangle"] == many for one, many in zip(alone, found["triangle"], strict=False))
    assert (world.closest_points(points, objects="b")["instance"] == 1).all()
    assert world.distance([3, 0, 0], max_distance=2) == 2
    assert world.distance([3, 0, 0], max_distance=np.nextafter(2, 0)) == np.inf
    assert world.distance([[3, 0, 0]] * 2, max_distance=[1, 5]).tolist() == [np.inf, 2]
    miss = world.closest_points([[np.nan, 0, 0], [9, 0, 0]], max_distance=1)
    assert np.isinf(miss["distance"]).all()
    assert np.isnan(miss["position"]).all()
    assert (miss["instance"] == -1).all()
    assert (miss["triangle"] == -1).all()
    assert not miss["barycentric"].any()
    assert not miss["normal"].any()
    assert raycam.World().distance([0, 0, 0]) == np.inf
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["max_distance"]):
        world.distance([0, 0, 0], max_distance=-1)


def test_signed_distances_equal_closed_forms() -> None:
    random = np.random.default_rng(2)
    half = np.array([1.0, 2.0, 0.5])
    points = random.uniform(-3, 3, (2000, 3))
    outside = np.abs(points) - half
    expected = np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0)
    box = raycam.World()
    box.add_mesh(*cube(-half, half, 4))
    for sign in ("auto", "winding", "pseudonormal"):
        np.testing.assert_allclose(box.signed_distance(points, sign=sign), expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(box.signed_distance(points, sign="none"), np.abs(expected), rtol=0, atol=1e-14)
    mirrored = raycam.World()
    mirrored.add_mesh(*cube(-half, half), matrix=np.diag([-1, 1, 1, 1]))
    np.testing.assert_allclose(
        mirrored.signed_distance(points, sign="pseudonormal"), expected, rtol=0, atol=1e-14
    )
    sheet = raycam.World()
    sheet.add_mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_allclose(
        sheet.signed_distance(points, sign="pseudonormal"), points[:, 2], rtol=0, atol=1e-15
    )
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'winding'"]):
        box.signed_distance(points, sign="windings")


def test_signed_distance_near_a_sharp_corner_has_the_right_sign() -> None:
    # At a thin spike, the nearest point is the tip, where the triangles face in opposite directions.
    spike = np.array([[0, 0, 10], [1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]], float)
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [3, 2, 1]]
    world = raycam.World()
    world.add_mesh(spike, faces)
    random = np.random.default_rng(3)
    near_tip = spike[0] + random.normal(size=(500, 3)) * 0.3
    for sign in ("auto", "pseudonormal"):
        got = world.signed_distance(near_tip, sign=sign)
        np.testing.assert_array_equal(got < 0, world.inside(near_tip))


def test_mutually_visible_surface_points_are_visible() -> None:
    vertices, faces = torus(40, 24)
    world = raycam.World()
    world.add_mesh(vertices, faces)
    random = np.random.default_rng(4)
    eye = np.array([0.0, 0.0, 4.0])
    hits = world.cast_rays(eye, random.normal(size=(4000, 3)) * [1, 1, 0.1] - eye)
    seen = hits["position"][hits["instance"] == 0]
    assert len(seen) > 1000
    assert world.visible(eye, seen).all()
    assert world.visible(seen, eye).all()
    assert world.visible(eye.astype(np.float32), seen.astype(np.float32)).all()
    behind = seen * [1, 1, -1]
    np.testing.assert_array_equal(world.visible(eye, behind), ~world.occluded(eye, behind - eye, 1 - 1e-9))
    assert 0.5 < 1 - world.visible(eye, behind).mean() < 1
    points = random.normal(size=(30, 3))
    matrix = world.visible(points[:, None], points)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert matrix.diagonal().all()
    one = [[bool(world.visible(a, b)) for b in points[:5]] for a in points[:5]]
    np.testing.assert_array_equal(matrix[:5, :5], one)
    assert not world.visible([np.nan, 0, 0], eye)
    wide = world.visible(points[:1], behind[:1], margin=100.0)
    assert wide.all(), "everything is within the margin"
    with raises(raycam.SettingsError, code="out_of_range"):
        world.visible(eye, eye, margin=-1)


def test_visibility_matrix_does_not_depend_on_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    from raycam.world import point_queries

    world = raycam.World()
    world.add_mesh(*cube())
    points = np.random.default_rng(1).normal(size=(50, 3)) * 2
    whole = world.visible(points[:, None], points)
    monkeypatch.setattr(point_queries, "PAIRS_PER_BLOCK", 333)
    np.testing.assert_array_equal(world.visible(points[:, None], points), whole)
