"""Crossings, compared with rational arithmetic.

Every surface is counted once, also at vertices and edges.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.crossings import crossings
from support.raises import raises
from support.surfaces import Surface, cube, torus

Floats = npt.NDArray[np.float64]

STEPS = np.array([step for step in product((-1, 0, 1), repeat=3) if any(step)], dtype=float)
"""The 26 directions to the neighbours of a cell."""
TURNED = np.array([[0.8, -0.6, 0, 3], [0.6, 0.8, 0.5, -2], [0, 0.1, 1.5, 1], [0, 0, 0, 1]])
MIRRORED = np.array([[-1, 0, 0, 3], [0, 2, 0, -2], [0.3, 0, 1, 1], [0, 0, 0, 1]])


def world_of(*surfaces: Surface, matrix: npt.ArrayLike | None = None) -> raycam.World:
    world = raycam.World()
    for vertices, faces in surfaces:
        world.add_mesh(vertices, faces, **({} if matrix is None else {"matrix": matrix}))
    return world


def aims(world: raycam.World) -> Floats:
    """Vertices, edge middles and centres of all triangles."""
    corners = world.triangles()
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    return np.concatenate([corners.reshape(-1, 3), middles.reshape(-1, 3), corners.mean(axis=1)])


SURFACES = {
    "cube": world_of(cube()),
    "fine cube of a tenth": world_of(cube((0, 0, 0), (0.1, 0.1, 0.1), 4)),
    "cube far away": world_of(cube((1e6, 2e6, 3e6), (1e6 + 1, 2e6 + 1, 3e6 + 1), 2)),
    "torus": world_of(torus()),
    "Klein bottle": world_of(torus(twist=True)),
    "turned torus": world_of(torus(), matrix=TURNED),
    "mirrored cube": world_of(cube(), matrix=MIRRORED),
    "two that touch": world_of(cube(), cube((1, 0, 0), (2, 1, 1))),
}


@pytest.mark.parametrize("name", SURFACES)
def test_lines_cross_closed_meshes_an_even_number_of_times(name: str) -> None:
    world = SURFACES[name]
    targets = aims(world)
    random = np.random.default_rng(4)
    eyes = targets[random.integers(len(targets), size=(6, len(targets)))].copy()
    eyes[3:] += random.normal(size=(3, len(targets), 3))
    directions = targets - eyes
    counts = world.count_intersections(eyes, directions, t_min=-np.inf)
    assert (counts % 2 == 0).all()
    assert counts.max() >= 2
    # The same holds for rays that start on the surface and point forwards or backwards.
    along = STEPS[:, None] * np.ptp(world.bounds, axis=0).max()
    ahead = world.count_intersections(targets, along)
    behind = world.count_intersections(targets, -along)
    assert (ahead % 2 == behind % 2).all()
    # Rays in every direction agree on whether the point is inside or outside.
    assert (ahead % 2 == ahead[0] % 2).all()


@pytest.mark.parametrize("name", SURFACES)
def test_crossings_equal_exact_rational_arithmetic(name: str) -> None:
    world = SURFACES[name]
    targets = aims(world)
    random = np.random.default_rng(8)
    chosen = targets[random.integers(len(targets), size=(40, 2))]
    origins = np.concatenate([chosen[:, 0], chosen[:20, 0] + random.normal(size=(20, 3))])
    directions = np.concatenate([chosen[:20, 1] - origins[:20], STEPS[:20], chosen[:20, 1] - origins[40:]])
    found = world.intersections(origins, directions, fields=["t", "triangle", "instance", "front"])
    triangles, ids = world.triangles(), world.triangle_ids()
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        part = slice(*found["offsets"][i : i + 2])
        expected = crossings(triangles, origin, direction)
        got = list(zip(found["instance"][part].tolist(), found["triangle"][part].tolist(), strict=True))
        assert sorted(got) == sorted(tuple(ids[k].tolist()) for _, k, _ in expected), (name, i)
        exact = {tuple(ids[k].tolist()): (t, side) for t, k, side in expected}
        mirrored = name == "mirrored cube"
        for t, front, key in zip(found["t"][part], found["front"][part], got, strict=True):
            assert abs(Fraction(float(t)) - exact[key][0]) <= abs(exact[key][0]) * Fraction(2.0**-52)
            assert bool(front) == ((exact[key][1] < 0) != mirrored)
        assert (np.diff(found["t"][part]) >= 0).all()


def test_intersections_counts_and_first_hits_agree() -> None:
    world = world_of(torus(), cube((-2, -2, -0.3), (2, 2, 0.3), 3), cube())
    random = np.random.default_rng(2)
    origins = random.normal(size=(4, 300, 3)) * 2
    directions = random.normal(size=(4, 300, 3))
    found = world.intersections(
        origins, directions, fields=["t", "instance", "triangle", "front", "position"]
    )
    counts = world.count_intersections(origins, directions)
    assert counts.shape == (4, 300)
    np.testing.assert_array_equal(np.diff(found["offsets"]), counts.ravel())
    np.testing.assert_array_equal(np.repeat(np.arange(1200), counts.ravel()), found["ray"])
    signed = np.bincount(found["ray"], np.where(found["front"], -1, 1), minlength=1200)
    np.testing.assert_array_equal(world.count_intersections(origins, directions, signed=True).ravel(), signed)
    first = world.cast_rays(origins, directions)
    some = counts.ravel() > 0
    start = found["offsets"][:-1][some]
    for name in ("t", "instance", "triangle"):
        np.testing.assert_array_equal(found[name][start], first[name].ravel()[some])
    np.testing.assert_array_equal(np.isfinite(first["t"].ravel()), some)
    cut = world.intersections(origins, directions, max_hits=2, fields=["t"])
    np.testing.assert_array_equal(np.diff(cut["offsets"]), np.minimum(counts.ravel(), 2))
    keep = np.arange(len(found["t"])) - found["offsets"][found["ray"]] < 2
    np.testing.assert_array_equal(cut["t"], found["t"][keep])
    one = world.count_intersections(origins, directions, threads=1)
    np.testing.assert_array_equal(one, counts)


def test_crossings_in_adjacent_ranges_add_up() -> None:
    world = world_of(*(cube((-r, -r, -r), (r, r, r)) for r in (1, 1.5, 2, 2.5)))
    random = np.random.default_rng(6)
    origins, directions = random.normal(size=(2, 500, 3))
    cuts = [-np.inf, -1.0, 0.25, 1.5, np.inf]
    whole = world.count_intersections(origins, directions, t_min=-np.inf)
    parts = sum(
        world.count_intersections(
            origins, directions, t_min=a, t_max=np.nextafter(b, -np.inf) if b < np.inf else b
        )
        for a, b in pairwise(cuts)
    )
    np.testing.assert_array_equal(parts, whole)
    assert whole.max() == 8
    t = world.intersections([0, 0, 0], [0, 0.2, 1], fields=["t"])["t"]
    np.testing.assert_array_equal(t, [1, 1.5, 2, 2.5])
    assert world.count_intersections([0, 0, 0], [0, 0.2, 1], t_min=1.5, t_max=2) == 2
    assert world.count_intersections([0, 0, 0], [0, 0.2, 1], t_min=np.nextafter(1.5, 2), t_max=2) == 1


def test_nearly_coincident_walls_are_all_crossed() -> None:
    world = world_of(cube((0, 0, 0), (5, 5, 5)), cube((5 + 2e-6, 0, 0), (10, 5, 5)))
    hits = world.intersections([-1, 2.5, 2.5], [1.0, 0, 0], fields=["t"])
    np.testing.assert_allclose(hits["t"], [1, 6, 6 + 2e-6, 11], rtol=1e-15)


def test_open_duplicated_and_edge_on_surfaces_are_counted_consistently() -> None:
    sheet = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])
    world = world_of(sheet, sheet)
    x = np.linspace(0, 1, 5)
    grid = np.array([[a, b, 1.0] for a in x for b in x])
    counts = world.count_intersections(grid, [0, 0, -1.0])
    # A border belongs to one side only; a ray crosses both of the duplicate faces.
    expected = [2 if a < 1 and b < 1 else 0 for a in x for b in x]
    np.testing.assert_array_equal(counts, expected)
    assert world.count_intersections([-1, 0.3, 0], [1.0, 0, 0]) == 0, "in the plane"
    assert not world.occluded([-1, 0.3, 0], [1.0, 0, 0])
    assert (world.cast_rays(grid, [0, 0, -1.0])["instance"] == 1).all(), "closed triangles have their borders"


def test_crossings_can_be_filtered_by_object_and_side() -> None:
    world = raycam.World()
    for number, name in enumerate(["a", "b", "c"]):
        world.add_mesh(*cube((0, 0, 2 * number), (1, 1, 2 * number + 1)), name=name)
    ray = ([0.3, 0.4, -1], [0, 0, 1.0])
    assert world.count_intersections(*ray) == 6
    assert world.count_intersections(*ray, objects=["a", "c"]) == 4
    assert world.count_intersections(*ray, objects=["a", 1], exclude=[2]) == 4
    assert world.count_intersections(*ray, facing="front") == 3
    assert world.intersections(*ray, exclude="b", facing="back", fields="t")["t"].tolist() == [2, 6]
    with raises(raycam.WorldError, code="unknown_name", mentions=["'bb'", "'b'"]):
        world.count_intersections(*ray, objects="bb")
    with raises(raycam.WorldError, code="index_out_of_range", mentions=["3"]):
        world.count_intersections(*ray, objects=[3])


def test_invalid_rays_cross_nothing() -> None:
    world = world_of(cube())
    nan, inf = np.nan, np.inf
    origins = [[nan, 0.5, 0.5], [inf, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    directions = [[1, 0, 0], [1, 0, 0], [0, 0, 0], [nan, 0, 0]]
    assert world.count_intersections(origins, directions).tolist() == [0, 0, 0, 0]
    assert world.intersections(origins, directions)["offsets"].tolist() == [0, 0, 0, 0, 0]
    assert world.count_intersections(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    assert raycam.World().count_intersections([0, 0, 0], [0, 0, 1]) == 0
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["t_max"]):
        world.count_intersections([0, 0, 0], [0, 0, 1], t_max=nan)
    with raises(raycam.SettingsError, code="out_of_range", mentions=["max_hits"]):
        world.intersections([0, 0, 0], [0, 0, 1], max_hits=-1)
