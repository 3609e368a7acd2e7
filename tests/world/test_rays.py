"""Exact ray queries, compared with rational arithmetic.

The tests cover vertices, edges, starts near surfaces and ranges of t.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import raises

Floats = npt.NDArray[np.float64]


def icosphere(subdivisions: int) -> tuple[Floats, npt.NDArray[np.int64]]:
    """A unit sphere of triangles."""
    golden = (1 + 5**0.5) / 2
    corners = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    vertices = [np.array(p) for k in range(3) for p in (np.roll(c, k) for c in corners)]
    points = np.array(vertices, dtype=float)
    length = np.linalg.norm(points[:, None] - points, axis=2)
    near = np.abs(length - 2) < 1e-9
    faces = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[c, a]
    ]
    triangles = np.array(faces)
    inward = (
        np.einsum(
            "ij,ij->i", np.cross(*np.diff(points[triangles], axis=1).swapaxes(0, 1)), points[triangles[:, 0]]
        )
        < 0
    )
    triangles[inward] = triangles[inward][:, ::-1]
    for _ in range(subdivisions):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        unique, number = np.unique(edges, axis=0, return_inverse=True)
        middle = number.reshape(-1, 3) + len(points)
        points = np.concatenate([points, points[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.concatenate(
            [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return points / np.linalg.norm(points, axis=1, keepdims=True), triangles


def ball(subdivisions: int = 4, matrix: npt.ArrayLike | None = None) -> raycam.World:
    """A world with one sphere."""
    vertices, triangles = icosphere(subdivisions)
    world = raycam.World()
    world.add_mesh(vertices, triangles) if matrix is None else world.add_mesh(
        vertices, triangles, matrix=matrix
    )
    return world


def closest_by_fractions(
    corners: Floats, origin: Floats, direction: Floats, objects: npt.NDArray[np.integer[Any]] | None = None
) -> tuple[Fraction, int] | None:
    """The smallest (t, triangle) with t >= 0, by rational arithmetic.

    Triangles include their edges. Of several objects at equal t, the last one counts.
    """

    def exact(values: Floats) -> list[Fraction]:
        return [Fraction(float(x)) for x in values]

    def cross(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))

    d, o = exact(direction), exact(origin)
    best: tuple[Fraction, int, int] | None = None
    for number, triangle in enumerate(corners):
        a, b, c = ([x - y for x, y in zip(exact(p), o, strict=True)] for p in triangle)
        sides = [dot(d, cross(a, b)), dot(d, cross(b, c)), dot(d, cross(c, a))]
        if any(s > 0 for s in sides) == any(s < 0 for s in sides):
            continue
        t = dot(a, cross(b, c)) / sum(sides, Fraction(0))
        hit = (t, 0 if objects is None else -int(objects[number]), number)
        if t >= 0 and (best is None or hit < best):
            best = hit
    return best and (best[0], best[2])


def agree(world: raycam.World, origins: Floats, directions: Floats) -> int:
    """Asserts that hits equal rational arithmetic; returns the number of hits."""
    hits = world.cast_rays(origins, directions)
    corners = world.triangles()
    count = 0
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        expected = closest_by_fractions(corners, origin, direction)
        if expected is None:
            assert hits["instance"][i] == -1
            assert hits["t"][i] == np.inf
            continue
        t, triangle = expected
        count += 1
        assert hits["triangle"][i] == triangle, (i, t, hits["t"][i])
        assert abs(Fraction(hits["t"][i]) - t) <= abs(t) * Fraction(np.finfo(float).eps)
    return count


def test_rays_through_every_vertex_and_edge_hit() -> None:
    vertices, triangles = icosphere(4)
    world = ball(4)
    middles = (vertices[triangles] + vertices[np.roll(triangles, 1, axis=1)]).reshape(-1, 3) / 2
    for aims in (vertices, middles):
        for eye in ([0.0, 0.0, 0.0], [0.1, 0.2, -0.3], [3.0, 4.0, 5.0], [1e6, 2e6, -3e6]):
            hits = world.cast_rays(eye, aims - np.array(eye))
            if np.linalg.norm(eye) < 1:
                assert (hits["instance"] == 0).all()
                assert np.allclose(hits["t"], 1.0, rtol=1e-12, atol=0)


def test_hits_equal_exact_rational_arithmetic() -> None:
    random = np.random.default_rng(5)
    vertices, triangles = icosphere(1)
    world = ball(1)
    aims = np.concatenate(
        [vertices, vertices[triangles].mean(axis=1), vertices[triangles[:, :2]].mean(axis=1)]
    )
    origins = np.concatenate(
        [
            np.round(random.uniform(-2, 2, (len(aims) // 2, 3)), 1),
            random.normal(size=(len(aims) - len(aims) // 2, 3)),
        ]
    )
    assert agree(world, origins, aims - origins) > len(aims) // 2


TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
SQUEEZED = {
    "a plate": TURN @ np.diag([1, 1e-3, 1]),
    "a needle": TURN @ np.diag([1e-4, 1e-4, 1]),
    "a mirrored shear": TURN @ np.diag([1, -1e-3, 1]) @ TURN.T,
    "hardly there": np.diag([1, 1, 1e-7]) @ TURN,
}


@pytest.mark.parametrize("name", SQUEEZED)
def test_hits_of_flattened_objects_equal_exact_rational_arithmetic(name: str) -> None:
    random = np.random.default_rng(2)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([SQUEEZED[name], [0.3, 0.2, 5]])
    world = ball(1, matrix)
    aims = random.normal(size=(150, 3)) * 0.5 @ matrix[:3, :3].T + matrix[:3, 3]
    origins = random.normal(size=(150, 3)) * 2 + matrix[:3, 3]
    assert agree(world, origins, aims - origins) > 50
    # Hits are also exact if the world contains other objects, whose boxes are not enlarged.
    world.add_object(sphere={"radius": 0.5}, location=[0, 0, 7])
    assert (world.cast_rays([0, 0, 9], [0, 0, -1])["instance"] == 1).all()


def test_hits_of_grids_and_coplanar_triangles_equal_exact_rational_arithmetic() -> None:
    world = raycam.World()
    for location in ([0, 0, 0], [1, 0, 0], [0.5, 0.5, 1], [0.1, 0.3, 1]):
        world.add_object(box={"size": [1, 1, 1]}, location=location)
    corners = world.triangles()
    ids = world.triangle_ids()
    grid = np.array([[x, y, 3.0] for x in np.arange(-1, 2.1, 0.25) for y in np.arange(-1, 2.1, 0.25)])
    down = np.tile([0.0, 0.0, -1.0], (len(grid), 1))
    slanted = np.tile([0.25, -0.5, -1.0], (len(grid), 1))
    for directions in (down, slanted):
        hits = world.cast_rays(grid, directions)
        for i, (origin, direction) in enumerate(zip(grid, directions, strict=True)):
            expected = closest_by_fractions(corners, origin, direction, ids[:, 0])
            if expected is None:
                assert hits["instance"][i] == -1
            else:
                assert [hits["instance"][i], hits["triangle"][i]] == ids[expected[1]].tolist()


@pytest.mark.parametrize("distance", [1e-8, 1e-10, 1e-12])
def test_rays_that_start_beyond_a_surface_do_not_hit_it(distance: float) -> None:
    world = ball(4)
    random = np.random.default_rng(11)
    directions = random.normal(size=(2000, 3))
    inside = world.cast_rays([0, 0, 0], directions)
    outwards = -inside["normal"]
    assert not world.occluded(inside["position"] + distance * outwards, outwards).any()
    before = world.cast_rays(inside["position"] - distance * outwards, outwards)
    assert (before["triangle"] == inside["triangle"]).mean() > 0.999
    assert np.allclose(before["t"], distance, rtol=1e-3 * (1e-10 / distance) + 1e-6, atol=1e-15)


def test_surface_point_is_visible_up_to_rounding() -> None:
    world = ball(4)
    random = np.random.default_rng(3)
    eye = np.array([3.0, 2.0, 1.0])
    targets = random.normal(size=(2000, 3)) * 0.3
    hits = world.cast_rays(eye, targets - eye)
    seen = hits["position"][np.isfinite(hits["t"])]
    assert not world.occluded(eye, seen - eye, 1 - 1e-9).any()
    assert world.occluded(eye, seen - eye, 1 + 1e-9).all()


def test_t_min_and_t_max_are_inclusive_limits() -> None:
    world = raycam.World()
    for z in (1.0, 2.0, 3.0):
        world.add_object(plane={"size": [2, 2]}, location=[0, 0, z])
    origin, up = [0.1, 0.2, 0.0], [0.0, 0.0, 1.0]

    def first(t_min: float, t_max: float = np.inf) -> float:
        return float(world.cast_rays(origin, up, t_min=t_min, t_max=t_max)["t"])

    assert [first(0), first(1), first(np.nextafter(1, 2)), first(2.5), first(3), first(3.1)] == [
        1,
        1,
        2,
        3,
        3,
        np.inf,
    ]
    assert first(0, 1) == 1
    assert first(0, np.nextafter(1, 0)) == np.inf
    ends = np.array([1, np.nextafter(1, 0), 1 - 1e-6, 1 - 2e-5])
    assert world.occluded([origin] * 4, up, ends).tolist() == [True, False, False, False]
    assert world.count_intersections([origin] * 4, up, t_max=ends).tolist() == [1, 0, 0, 0]
    above = [0.1, 0.2, 10.0]
    whole = world.cast_rays(above, up, t_min=-np.inf)
    assert whole["t"] == -9
    np.testing.assert_allclose(whole["position"], [0.1, 0.2, 1.0], rtol=1e-15)
    assert world.cast_rays(above, up, t_min=-7.5, t_max=-7)["t"] == -7
    assert world.occluded(above, up, -7.5, t_min=-8).tolist() is True
    assert world.occluded(above, up, -8.5, t_min=-8.9).tolist() is False
    limits = world.occluded([origin] * 3, up, [0.5, 1.0, 9.0], t_min=[0.0, 0.0, 3.5])
    assert limits.tolist() == [False, True, False]
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["t_min"]):
        world.cast_rays(origin, up, t_min=np.nan)
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["exact"]):
        world.cast_rays(origin, up, t_min=1, exact=False)


def test_hits_are_the_same_in_any_order_and_batch() -> None:
    matrix = np.array([[0.3, -0.9, 0.1, 5], [1.1, 0.2, 0.4, -3], [0.2, 0.1, -0.8, 1], [0, 0, 0, 1]])
    world = ball(3, matrix)
    random = np.random.default_rng(2)
    vertices = world.triangles().reshape(-1, 3)
    origins = random.normal(size=(4000, 3)) * 3 + [5, -3, 1]
    directions = vertices[random.integers(len(vertices), size=4000)] - origins
    hits = world.cast_rays(origins, directions)
    order = random.permutation(4000)
    other = world.cast_rays(origins[order], directions[order], threads=1)
    for name, values in hits.items():
        assert np.array_equal(values[order], other[name], equal_nan=values.dtype.kind == "f"), name
    for i in range(50):
        alone = world.cast_rays(origins[i], directions[i])
        assert all(np.array_equal(alone[name], hits[name][i], equal_nan=True) for name in hits)
    assert np.array_equal(world.occluded(origins, directions), hits["instance"] >= 0)


def test_cast_rays_returns_the_requested_fields() -> None:
    world = raycam.World()
    world.add_object(
        plane={"size": [2, 2]}, matrix=np.diag([1, 1, -1, 1]), color=[0.2, 0.4, 0.6], category="floor"
    )
    fields = ["distance", "front", "uv", "material", "category", "albedo", "shading_normal", "instance"]
    hits = world.cast_rays(
        [[0.5, 0.25, 3], [0.5, 0.25, -3], [9, 9, 9]], [[0, 0, -2], [0, 0, 2], [0, 0, -2.0]], fields=fields
    )
    assert list(hits) == fields
    assert {name: values.dtype.name for name, values in hits.items()} == {
        "distance": "float64",
        "front": "bool",
        "uv": "float64",
        "material": "int32",
        "category": "int32",
        "albedo": "float32",
        "shading_normal": "float64",
        "instance": "int32",
    }
    assert hits["distance"].tolist() == [3, 3, np.inf]
    # The outside of a plane stays its outside after mirroring, and is now below the plane.
    assert hits["front"].tolist() == [False, True, False]
    assert hits["shading_normal"].tolist() == [[0, 0, 1], [0, 0, -1], [0, 0, 0]]
    assert hits["material"].tolist() == [0, 0, -1]
    assert hits["category"][0] == hits["category"][1] != hits["category"][2] == -1
    np.testing.assert_allclose(hits["albedo"], [[0.2, 0.4, 0.6]] * 2 + [[0, 0, 0]], rtol=1e-6)
    assert np.isnan(hits["uv"][2]).all()
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'instanze'", "'instance'"]):
        world.cast_rays([0, 0, 1], [0, 0, -1], fields=["t", "instanze"])


def test_skip_ignores_the_triangle_at_the_start_of_a_ray() -> None:
    world = ball(3)
    random = np.random.default_rng(1)
    outer = random.normal(size=(500, 3)) * 5
    first = world.cast_rays(outer, random.normal(size=(500, 3)) * 0.2 - outer)
    onward = random.normal(size=(500, 3))
    skipped = world.cast_rays(first["position"], onward, skip=(first["instance"], first["triangle"]))
    assert not ((skipped["triangle"] == first["triangle"]) & (skipped["instance"] == first["instance"]))[
        first["instance"] >= 0
    ].any()
    inwards = (onward * first["normal"]).sum(axis=1) < -0.1
    assert (skipped["instance"][inwards] == 0).all()
    assert (world.cast_rays(outer, -outer, skip=(0, -1))["instance"] == -1).all()
    assert (world.cast_rays(outer, -outer, skip=(-1, 3))["instance"] == 0).all()
    np.testing.assert_array_equal(
        world.occluded(first["position"], onward, skip=(first["instance"], first["triangle"]))[inwards], True
    )
    with raises(raycam.SettingsError, code="wrong_shape"):
        world.cast_rays(outer, -outer, skip=3)  # type: ignore[arg-type]
    with raises(raycam.SettingsError, code="wrong_type", mentions=["skip[1]"]):
        world.cast_rays(outer, -outer, skip=(0, 0.5))


def test_rays_can_be_limited_to_objects_sides_and_surfaces() -> None:
    world = raycam.World()
    for z, name, material in ((3, "glass", {"type": "glass"}), (2, "lid", {}), (1, "floor", {})):
        world.add_object(plane={"size": [4, 4]}, location=[0, 0, z], name=name, **material)
    random = np.random.default_rng(3)
    origins = random.uniform(-1, 1, (3, 70, 3)) + np.array([0, 0, 6.0])
    directions = random.uniform(-0.1, 0.1, (3, 70, 3)) - [0, 0, 1.0]

    def seen(**options: object) -> npt.NDArray[np.int32]:
        found = world.cast_rays(origins, directions, **options)["instance"]  # type: ignore[arg-type]
        np.testing.assert_array_equal(found >= 0, world.occluded(origins, directions, **options))  # type: ignore[arg-type]
        return found

    assert (seen() == 0).all()
    assert (seen(surface="solid") == 1).all()
    assert (seen(exclude="glass") == 1).all()
    assert (seen(objects=["floor", 0], exclude=[0]) == 2).all()
    assert (seen(facing="front") == 0).all()
    assert (seen(facing="back") == -1).all()
    assert (seen(objects=[]) == -1).all()
    # The results are the same after so many rays that all objects are merged into one tree.
    world.cast_rays(np.repeat(origins.reshape(-1, 3), 20, axis=0), [0, 0, -1.0])
    assert (seen(exclude="glass") == 1).all()
    assert (seen(skip=(0, -1), objects=[0, 2]) == 2).all()
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'front'"]):
        world.cast_rays(origins, directions, facing="fromt")  # type: ignore[arg-type]
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["exact=False"]):
        world.cast_rays(origins, directions, objects=[0], exact=False)


def test_ray_arrays_of_every_layout_are_accepted() -> None:
    world = ball(2)
    random = np.random.default_rng(8)
    eyes, ways = random.normal(size=(4, 1, 3)) * 3, random.normal(size=(5, 3))
    spread = world.cast_rays(eyes, ways)
    assert spread["t"].shape == (4, 5)
    full = world.cast_rays(np.broadcast_to(eyes, (4, 5, 3)).copy(), np.broadcast_to(ways, (4, 5, 3)).copy())
    np.testing.assert_array_equal(spread["t"], full["t"])
    strided = np.zeros((10, 6), dtype=">f8")
    strided[::2, ::2] = ways
    np.testing.assert_array_equal(world.cast_rays(eyes, strided[::2, ::2])["t"], full["t"])

    class Produced:
        """A tensor of another library that supports only DLPack."""

        def __init__(self, array: Floats, device: tuple[int, int] = (1, 0)) -> None:
            self.array, self.place = array, device

        def __dlpack__(self, **options: object) -> object:
            return self.array.__dlpack__()

        def __dlpack_device__(self) -> tuple[int, int]:
            return self.place

    np.testing.assert_array_equal(world.cast_rays(Produced(eyes), Produced(ways))["t"], full["t"])
    with raises(raycam.SettingsError, code="wrong_type", mentions=["origins", "2"]):
        world.cast_rays(Produced(eyes, (2, 0)), ways)

    class Tensor:
        """The used attributes of a torch tensor."""

        def __init__(self, device: str, requires_grad: bool) -> None:
            self.device, self.requires_grad = device, requires_grad

        def __array__(self, *_: object, **__: object) -> Floats:
            return ways

    assert world.cast_rays(eyes, Tensor("cpu", False))["t"].shape == (4, 5)  # type: ignore[arg-type]
    with raises(
        raycam.SettingsError, code="wrong_type", mentions=["directions", "cuda:0", "directions.cpu()"]
    ):
        world.cast_rays(eyes, Tensor("cuda:0", False))  # type: ignore[arg-type]
    with raises(raycam.SettingsError, code="wrong_type", mentions=["directions.detach()"]):
        world.cast_rays(eyes, Tensor("cpu", True))  # type: ignore[arg-type]
    for wrong in ([[1, 2]], "abc", [[1, 2, "x"]], [[1j, 0, 0]]):
        with raises(raycam.SettingsError, mentions=["origins"]):
            world.cast_rays(wrong, ways)  # type: ignore[arg-type]
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["[2, 3]", "[5"]):
        world.cast_rays(np.zeros((2, 3)), ways)
    answers = world.cast_rays(eyes, ways)
    assert all(values.flags.writeable and values.flags.c_contiguous for values in answers.values())


def test_torch_tensors_are_exchanged_without_a_copy() -> None:
    torch = pytest.importorskip("torch")
    world = raycam.World()
    world.add_object(box={"size": 2})
    origins = torch.tensor([[0.0, 0, 5], [9, 9, 5]], dtype=torch.float64)
    directions = torch.tensor([[0.0, 0, -1]], dtype=torch.float64).expand(2, 3)
    hits = world.cast_rays(origins, directions)
    assert hits["t"].tolist() == [4.0, np.inf]
    back = torch.from_numpy(hits["position"])
    back[0] += 1
    assert hits["position"][0].tolist() == [1.0, 1.0, 2.0]
    assert torch.from_dlpack(hits["instance"]).tolist() == [0, -1]
    assert world.inside(torch.zeros(3, dtype=torch.float32)).item()
    with raises(raycam.SettingsError, code="wrong_type", mentions=["origins.detach()"]):
        world.cast_rays(origins.clone().requires_grad_(), directions)


@pytest.mark.parametrize("threads", [0, -2, 1.5, "all", True, 10**9])
def test_invalid_thread_counts_are_refused(threads: Any) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    camera = raycam.Camera.look_at([0, 3, 3], [0, 0, 0], fov=40, size=(4, 4))
    calls = (
        lambda: world.cast_rays([0, 0, 5], [0, 0, -1], threads=threads),
        lambda: world.count_intersections([0, 0, 5], [0, 0, -1], threads=threads),
        lambda: world.inside([0, 0, 0], threads=threads),
        lambda: world.closest_points([0, 0, 0], threads=threads),
        lambda: world.visible([0, 0, 0], [1, 1, 1], threads=threads),
        lambda: world.prepare(threads=threads),
        lambda: raycam.keypoints(world, camera, [[0, 0, 0]], threads=threads),
        lambda: raycam.render(world, camera, channels="depth", threads=threads),
    )
    for call in calls:
        with raises(raycam.SettingsError, mentions=["threads"]):
            call()


@pytest.mark.parametrize("power", [-119, -100, 100, 123])
def test_coordinates_beyond_float32_are_refused(power: int) -> None:
    world = raycam.World()
    world.add_object(box={"size": 2}, matrix=np.diag([2.0**power] * 3 + [1]))
    size = float(np.abs(world.triangles()).max())
    grid = np.array([[x, y, -3] for x in (-1, 0, 0.5, 1) for y in (-1, 0, 0.5, 1)]) * size
    assert world.cast_rays(grid, [0, 0, size])["t"].tolist() == [2.0] * 16
    inside = (grid[:, :2] < size).all(axis=1)
    assert world.count_intersections(grid, [0, 0, size]).tolist() == (2 * inside).tolist()
    huge = raycam.World()
    huge.add_mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) * 1e39, [[0, 1, 2]])
    with raises(raycam.WorldError, code="invalid_mesh", mentions=["0"]):
        huge.cast_rays([0, 0, 1], [0, 0, -1])


def test_unknown_ray_limits_raise_with_the_valid_names() -> None:
    world = raycam.World()
    world.add_object("box")
    ray = ([0.0, 0, 5], [0.0, 0, -1])
    for call in (world.cast_rays, world.occluded, world.intersections, world.count_intersections):
        with raises(raycam.SettingsError, code="unknown_key", mentions=["t_min"]):
            call(*ray, tmin=1.0)  # type: ignore[call-arg]
    for call in (world.intersections, world.count_intersections):
        with raises(raycam.SettingsError, code="unknown_key"):
            call(*ray, exact=False)  # type: ignore[call-arg]
