"""Code for trimesh, run with `raycam.compat.trimesh` and, if installed, with trimesh."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from raycam.compat import trimesh as compat
from support.raises import raises
from support.surfaces import cube, joined

trimesh = pytest.importorskip("trimesh")


@pytest.fixture(params=["raycam", "trimesh"])
def engine(request: pytest.FixtureRequest) -> Iterator[str]:
    """The ray engine that a test uses."""
    if request.param == "trimesh":
        pytest.importorskip("embreex")
        yield request.param
        return
    compat.install(nearest=True)
    yield request.param
    compat.uninstall()


def ball() -> Any:
    return trimesh.creation.icosphere(subdivisions=2)


def test_calls_copied_from_public_projects_return_the_results_of_trimesh(engine: str) -> None:
    mesh = ball()
    n = 50
    random = np.random.default_rng(1)
    o = random.normal(size=(n, 3)) * 0.2 - [0, 0, 3]
    d = np.tile([0.0, 0.0, 2.0], (n, 1))
    locations, index_ray, index_tri = mesh.ray.intersects_location(o, d, multiple_hits=False)
    assert (locations.dtype, index_ray.dtype, index_tri.dtype) == (np.float64, np.int64, np.int64)
    out = np.zeros((n, 3))
    out[index_ray] = locations
    assert index_ray.tolist() == list(range(n))
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1, atol=0.03)
    assert (out[:, 2] < 0).all()
    hits, index_ray, _ = mesh.ray.intersects_location(o, d)
    assert len(hits) == 2 * n
    assert index_ray.tolist() == [*range(n), *range(n)], "all first hits, then all second ones"
    assert (hits[:n, 2] < hits[n:, 2]).all()
    np.testing.assert_allclose(hits[index_ray == 3][:, :2], [o[3, :2]] * 2, atol=1e-6)
    tri, ray, where = mesh.ray.intersects_id(
        ray_origins=o, ray_directions=d, multiple_hits=False, max_hits=1, return_locations=True
    )
    np.testing.assert_array_equal(tri, index_tri)
    np.testing.assert_allclose(where, locations)
    tri, ray = mesh.ray.intersects_id(o, d, max_hits=1)
    assert len(tri[ray == 0]) == 1
    where, ray, tri = mesh.ray.intersects_location([[0, 0, 5]], [[0, 0, -1]])
    assert where.shape[1] == 3
    assert mesh.ray.intersects_any(o, d).tolist() == [True] * n
    np.testing.assert_array_equal(mesh.ray.intersects_first(o, d), index_tri)
    assert mesh.contains([[0, 0, 0], [0, 0, 2], [0.5, 0.5, 0.5]]).tolist() == [True, False, True]
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    caster = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh, scale_to_box=True)
    assert isinstance(caster, RayMeshIntersector)
    assert caster.contains_points([[0.1, 0, 0]]).tolist() == [True]


def test_misses_return_empty_arrays_and_invalid_arguments_raise(engine: str) -> None:
    mesh = ball()
    away = [[0, 0, 5.0]], [[0, 0, 1.0]]
    assert [part.shape for part in mesh.ray.intersects_location(*away)] == [(0, 3), (0,), (0,)]
    assert [part.shape for part in mesh.ray.intersects_id(*away)] == [(0,), (0,)]
    assert mesh.ray.intersects_first(*away).tolist() == [-1]
    assert mesh.ray.intersects_any([[0, 0, -5.0]] * 2, [[0, 0, 0.0], [np.nan] * 3]).tolist() == [False, False]
    with raises(ValueError, mentions=["origin"]):
        mesh.ray.intersects_location([[0, 0, 0.0]], [[0, 0, 1.0]] * 2)
    with pytest.raises(TypeError):
        mesh.ray.intersects_location(*away, max_d=3)


def test_ray_queries_follow_changed_copied_and_pickled_meshes(engine: str) -> None:
    mesh = ball()
    ray = [[0.1, 0.05, -5]], [[0, 0, 1]]
    first = mesh.ray.intersects_location(*ray, multiple_hits=False)[0]
    mesh.apply_translation([0, 0, 1])
    np.testing.assert_allclose(
        mesh.ray.intersects_location(*ray, multiple_hits=False)[0], first + np.array([0, 0, 1]), atol=1e-5
    )
    for other in (mesh.copy(), copy.deepcopy(mesh), pickle.loads(pickle.dumps(mesh))):
        assert other.ray.intersects_any(*ray).tolist() == [True]
    assert pickle.loads(pickle.dumps(mesh.ray)).intersects_any(*ray).tolist() == [True]


def test_proximity_queries_equal_closed_forms(engine: str) -> None:
    if engine == "trimesh":
        pytest.importorskip("rtree")
    mesh = trimesh.creation.box(extents=[2, 2, 2])
    points = np.array([[3, 0.5, 0.25], [0, 0.1, 0.5], [2, 2, 2]])
    closest, distance, triangle = mesh.nearest.on_surface(points)
    np.testing.assert_allclose(closest, [[1, 0.5, 0.25], [0, 0.1, 1], [1, 1, 1]], atol=1e-12)
    np.testing.assert_allclose(distance, [2, 0.5, 3**0.5])
    assert (triangle.shape, triangle.dtype.kind) == ((3,), "i")
    np.testing.assert_allclose(mesh.nearest.signed_distance(points), [-2, 0.5, -(3**0.5)])
    inner = np.array([[0.2, 0.1, -0.9]])
    np.testing.assert_allclose(trimesh.proximity.longest_ray(mesh, inner, [[0, 0, 1]]), [1.9], rtol=1e-5)
    thickness = trimesh.proximity.thickness(mesh, [[0.1, 0.3, 1.0]], method="ray")
    np.testing.assert_allclose(thickness, [2.0], rtol=1e-3)


def test_edge_cases_that_trimesh_gets_wrong_are_correct() -> None:
    compat.install()
    try:
        mesh = trimesh.creation.icosphere(subdivisions=4)
        eye = np.array([0.3, 0.2, 5.0])
        ids = mesh.ray.intersects_id(np.tile(eye, (len(mesh.vertices), 1)), mesh.vertices - eye)[1]
        assert (np.bincount(ids, minlength=len(mesh.vertices)) % 2 == 0).all()
        walls = joined(cube((0, 0, 0), (5, 5, 5)), cube((5 + 2e-6, 0, 0), (10, 5, 5)))
        two = trimesh.Trimesh(*walls, process=False)
        assert len(two.ray.intersects_id([[-1, 2.2, 2.7]], [[1, 0, 0]])[0]) == 4
        overlap = trimesh.Trimesh(*joined(cube(), cube((0.5, 0.5, 0.5), (1.5, 1.5, 1.5))), process=False)
        assert overlap.contains(
            [[0.7, 0.7, 0.7], [0.2, 0.2, 0.2], [1.2, 1.2, 1.2], [1.2, 0.2, 0.2]]
        ).tolist() == [
            True,
            True,
            True,
            False,
        ]
    finally:
        compat.uninstall()
    assert trimesh.ray.ray_pyembree is not compat


def test_ray_caster_accepts_any_mesh_with_vertices_and_faces() -> None:
    vertices, faces = cube()
    mesh = SimpleNamespace(vertices=vertices, faces=faces)
    caster = compat.RayMeshIntersector(mesh)
    assert caster.contains_points([[0.5, 0.5, 0.5]]).tolist() == [True]
    mesh.vertices = vertices + 9
    assert caster.contains_points([[0.5, 0.5, 0.5]]).tolist() == [False]
    mesh.faces = np.zeros((0, 3), int)
    assert caster.intersects_first([[0, 0, 0]], [[0, 0, 1]]).tolist() == [-1]


def test_unsupported_names_of_trimesh_raise_with_an_alternative() -> None:
    for name in ("load", "creation", "Trimesh"):
        with raises(AttributeError, mentions=[name, "raycam.load(path)"]):
            getattr(compat, name)
    assert not hasattr(compat, "__path__")


@pytest.mark.parametrize("shape", ["tetrahedron", "box", "icosahedron"])
def test_closest_triangle_faces_the_query_point(shape: str) -> None:
    """Outside of a convex body, the point is on the front side of its closest triangle."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    mesh = {
        "tetrahedron": lambda: trimesh.Trimesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]),
        "box": trimesh.creation.box,
        "icosahedron": trimesh.creation.icosahedron,
    }[shape]()
    points = np.random.default_rng(5).uniform(-3, 3, (500, 3))
    points = points[~mesh.contains(points)] if shape != "tetrahedron" else points
    if shape == "tetrahedron":
        points = points[(points < 0).any(axis=1) | (points.sum(axis=1) > 1)]
    position, distance, triangle = compat.closest_point(mesh, points)
    sides = np.einsum("ni,ni->n", mesh.face_normals[triangle], points - position)
    assert (sides > 0).all()
    np.testing.assert_allclose(np.linalg.norm(points - position, axis=1), distance, atol=1e-12)
    # No other triangle that contains the closest point faces it more.
    for number in range(0, len(points), 25):
        near = trimesh.triangles.closest_point(
            mesh.triangles, np.tile(position[number], (len(mesh.faces), 1))
        )
        meets = np.linalg.norm(near - position[number], axis=1) < 1e-9
        best = (mesh.face_normals[meets] @ (points[number] - position[number])).max()
        assert sides[number] == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("nudge", [-1e-9, 0.0, 1e-9, -1e-3, 1e-3])
@pytest.mark.parametrize("size", [1.0, 50.0])
def test_closest_triangles_at_almost_equal_distance_equal_trimesh(nudge: float, size: float) -> None:
    corners = size * np.array([(0, 0, 0), (0, 1, 0), (-1, 0, 0), (0, 0, -1)], float)
    rng = np.random.default_rng(3)
    for faces in ([[0, 1, 2], [0, 1, 3]], [[0, 2, 1], [0, 1, 3]], [[0, 1, 2], [0, 3, 1]]):
        mesh = trimesh.Trimesh(corners, faces, process=False)
        # Points at equal distance from both faces, and points that are slightly displaced from there.
        across, along = rng.uniform(0.2, 0.6, (2, 20)) * size
        points = np.column_stack([-across + nudge, along, -across])
        expected = trimesh.proximity.closest_point(mesh, points)
        found = compat.closest_point(mesh, points)
        np.testing.assert_array_equal(found[2], expected[2])
        np.testing.assert_allclose(found[0], expected[0], atol=1e-9)
        np.testing.assert_allclose(found[1], expected[1], atol=1e-9)
