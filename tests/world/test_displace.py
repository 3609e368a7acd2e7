"""Displaced meshes: closed forms, ray marching, watertightness and budgets."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
import trimesh
from support.raises import raises

Floats = npt.NDArray[np.floating[Any]]
SIDE = 128


def random_heights(seed: int, cycles: int = 6) -> Floats:
    """A periodic image of smooth random heights between -1 and 1."""
    at = (np.arange(SIDE) + 0.5) / SIDE
    random = np.random.default_rng(seed)
    heights = np.zeros((SIDE, SIDE))
    for _ in range(8):
        a, b = random.integers(-cycles, cycles + 1, 2)
        heights += np.sin(2 * np.pi * (a * at[None, :] + b * at[:, None]) + random.uniform(0, 6.28)) / 8
    return heights.astype(np.float32)


def welded(world: raycam.World, number: int = 0) -> trimesh.Trimesh:
    """The object's triangles in the world; vertices with exactly equal coordinates are one."""
    corners = world.triangles(number).reshape(-1, 3)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return trimesh.Trimesh(points, index.reshape(-1, 3), process=False, validate=False)


def displaced(heights: Any, **keys: Any) -> raycam.World:
    world = raycam.World()
    world.add_object(textures={"height": heights}, **{"displace": True, **keys})
    return world


CLOSED: dict[str, dict[str, Any]] = {
    "sphere": {"sphere": {"radius": 1, "level": 4}},
    "box": {"box": [1, 2, 0.5]},
    "torus": {"torus": {"radius": 1, "tube": 0.4}},
    "cylinder": {"cylinder": {"radius": 0.5, "height": 1}},
    "cone": {"cone": {"radius": 0.5, "height": 1}},
}


@pytest.mark.parametrize("matrix", [np.eye(4), np.diag([-2.0, 1, 0.5, 1])])
@pytest.mark.parametrize("shape", CLOSED)
def test_displaced_closed_shapes_stay_closed(shape: str, matrix: Floats) -> None:
    """Shapes stay closed although vertices, uvs and normals differ at seams and edges."""
    world = displaced(random_heights(2), **CLOSED[shape], height_scale=0.03, matrix=matrix)
    mesh = welded(world)
    assert len(mesh.faces) > 10_000
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume * np.linalg.det(matrix) > 0
    assert mesh.euler_number == (0 if shape == "torus" else 2)


def test_sphere_displaced_by_a_constant_is_a_larger_sphere() -> None:
    world = displaced(np.full((64, 64), 0.25), sphere={"radius": 1, "level": 5}, displace={"zero": 0.05})
    corners = world.triangles(0)
    radius = np.linalg.norm(corners, axis=-1)
    assert radius == pytest.approx(1.2, abs=3e-4)  # between their ends, chords are inside of the sphere
    assert radius.max() == pytest.approx(1.2, abs=1e-6)
    camera = raycam.Camera.look_at([3, 1, 2], [0, 0, 0], size=(64, 64), fov=50)
    frame = raycam.render(world, camera, channels=["position", "shading_normal"])
    hit = np.isfinite(frame["position"]).all(-1)
    outwards = frame["position"][hit] / np.linalg.norm(frame["position"][hit], axis=-1, keepdims=True)
    assert frame["shading_normal"][hit] == pytest.approx(outwards, abs=0.01)


@pytest.mark.parametrize("scale", [1.0, [2, 0.5, 3], [-1, 1, 1]])
def test_box_displaced_by_a_constant_is_a_larger_box(scale: Any) -> None:
    """The faces move by metres of the world, and its edges and corners stay sharp."""
    world = displaced(np.full((8, 8), 0.1), box=[1, 2, 3], scale=scale, height_scale=2)
    corners = world.triangles(0).reshape(-1, 3)
    expected = np.abs([1, 2, 3] * np.broadcast_to(scale, 3)) / 2 + 0.2
    assert corners.max(0) == pytest.approx(expected, abs=1e-5)
    assert corners.min(0) == pytest.approx(-expected, abs=1e-5)
    on_face = np.abs(np.abs(corners) - expected) < 1e-5
    assert on_face.any(-1).all()
    assert abs(welded(world).volume) == pytest.approx(8 * expected.prod(), rel=1e-6)
    camera = raycam.Camera.look_at(8 * expected, [0, 0, 0], size=(32, 32), fov=40)
    frame = raycam.render(world, camera, channels=["normal", "shading_normal", "depth"])
    hit = np.isfinite(frame["depth"])
    assert frame["shading_normal"][hit] == pytest.approx(frame["normal"][hit], abs=1e-5)


def march(heights: Floats, origin: Floats, directions: Floats) -> Floats:
    """Distances to the bilinear height field over a plane of 2 x 2 m.

    They are found by small steps and bisection.
    """

    def above(distances: Floats) -> Floats:
        at = origin + directions * distances[:, None]
        column = np.clip((at[:, 0] + 1) / 2 * SIDE - 0.5, 0, SIDE - 1)
        row = np.clip((1 - at[:, 1]) / 2 * SIDE - 0.5, 0, SIDE - 1)
        x, y = np.minimum(column.astype(int), SIDE - 2), np.minimum(row.astype(int), SIDE - 2)
        u, v = column - x, row - y
        top = heights[y, x] * (1 - u) + heights[y, x + 1] * u
        low = heights[y + 1, x] * (1 - u) + heights[y + 1, x + 1] * u
        return at[:, 2] - (top * (1 - v) + low * v)

    near = np.ones(len(directions))
    steps = np.linspace(1, 6, 4000)
    found = np.full(len(directions), np.inf)
    for start, end in itertools.pairwise(steps):
        crossed = ~np.isfinite(found) & (above(near * 0 + end) < 0)
        if crossed.any():
            low, high = np.full(crossed.sum(), start), np.full(crossed.sum(), end)
            for _ in range(40):
                middle = (low + high) / 2
                at = np.zeros(len(directions))
                at[crossed] = middle
                inside = above(at)[crossed] < 0
                low, high = np.where(inside, low, middle), np.where(inside, middle, high)
            found[crossed] = high
    return found


def test_ground_truth_of_a_displaced_plane_equals_ray_marching() -> None:
    heights = 0.08 * random_heights(5, cycles=4)
    texture = raycam.Texture(heights / 2, wrap="clamp")
    world = displaced(texture, plane=2, height_scale=2)
    camera = raycam.Camera.look_at([0.3, -2, 1.5], [0.1, 0, 0], size=(48, 32), fov=12)
    channels = ["distance", "position", "normal", "shading_normal", "instance", "triangle", "barycentric"]
    frame = raycam.render(world, camera, channels=channels)
    hit = frame["instance"].ravel() == 0
    assert hit.all()
    directions = (frame["position"] - camera.C).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    expected = march(heights.astype(np.float64), np.asarray(camera.C), directions)
    error = np.abs(frame["distance"].ravel() - expected)
    assert np.quantile(error, 0.9) < 1e-3
    assert np.median(error) < 2e-4
    flat = -camera.C[2] / directions[:, 2]
    assert np.abs(flat - expected).max() > 0.05
    # The normals, computed from differences of the exact surface.
    position = frame["position"]
    u, v = (position[..., 0] + 1) / 2 * SIDE - 0.5, (1 - position[..., 1]) / 2 * SIDE - 0.5
    slope_v, slope_u = np.gradient(heights.astype(np.float64))
    at = np.rint(v).astype(int), np.rint(u).astype(int)
    normal = np.stack([-slope_u[at] * SIDE / 2, slope_v[at] * SIDE / 2, np.ones_like(u)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    cosine = (frame["shading_normal"] * normal).sum(-1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 4
    # The triangle and the weights determine the position.
    corners = world.triangles(0)[frame["triangle"]]
    assert (corners * frame["barycentric"][..., None]).sum(-2) == pytest.approx(position, abs=1e-5)


def test_edges_are_split_until_they_are_as_short_as_a_texel_or_max_edge() -> None:
    texels = displaced(np.zeros((64, 64)), plane=2)
    assert texels.counts["triangles"] == 2 * 64**2
    coarse = displaced(np.zeros((64, 64)), plane=2, displace={"max_edge": 0.36})
    edges = np.linalg.norm(np.diff(coarse.triangles(0)[:, [0, 1, 2, 0]], axis=1), axis=-1)
    assert 0.18 < edges.max() <= 0.36
    doubled = displaced(np.zeros((64, 64)), plane=2, displace={"max_edge": 0.36}, scale=2)
    assert doubled.counts["triangles"] == 4 * coarse.counts["triangles"]
    repeated = displaced(raycam.Texture(np.zeros((16, 16)), repeat=4), plane=2)
    assert repeated.counts["triangles"] == 2 * 64**2


def test_displaced_triangles_keep_the_attributes_of_their_triangle() -> None:
    """A displaced square of two triangles keeps its colours, coordinates and triangle order."""
    square = {"vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "triangles": [[0, 1, 2], [0, 2, 3]]}
    uvs = [[0, 1], [1, 1], [1, 0], [0, 0]]
    colors = [[1, 0, 0], [0, 1, 0]]
    world = displaced(np.full((32, 32), 0.1), **square, uvs=uvs, face_colors=colors, color=[1, 1, 1])
    camera = raycam.Camera.look_at([0.5, 0.5, 2], [0.5, 0.5, 0], up=[0, 1, 0], size=(16, 16), fov=20)
    frame = raycam.render(world, camera, channels=["albedo", "position", "uv", "triangle"])
    x, y, z = np.moveaxis(frame["position"], -1, 0)
    assert z == pytest.approx(0.1, abs=1e-6)
    below, beside = x > y, np.abs(x - y) > 0.01
    expected = np.where(below[..., None], [1, 0, 0], [0, 1, 0])
    assert frame["albedo"][beside] == pytest.approx(expected[beside], abs=1e-6)
    assert frame["uv"] == pytest.approx(np.stack([x, 1 - y], -1), abs=1e-5)
    # The displaced triangles have the order of the original triangles.
    first_half = frame["triangle"] < world.counts["triangles"] // 2
    assert (first_half == below)[beside].all()


def test_budget_is_checked_before_the_surface_is_refined() -> None:
    image = np.zeros((512, 512), np.uint8)
    facts = ["displace", "524288 triangles", "max_triangles is 100000", "max_edge"]
    with raises(raycam.WorldError, code="budget_exceeded", mentions=facts):
        displaced(image, plane=1, displace={"max_triangles": 100_000})
    with raises(raycam.WorldError, code="budget_exceeded", mentions=["displace", "GiB", "4000000"]):
        displaced(raycam.Texture(image, repeat=1000), plane=1)
    assert displaced(image, plane=1).counts["triangles"] == 2 * 512**2


@pytest.mark.parametrize(
    ("keys", "code", "fact"),
    [
        ({"displace": True, "plane": 1}, "missing_value", "textures.height"),
        ({"displace": {"max_edge": -1}}, "out_of_range", "max_edge"),
        ({"displace": {"zero": np.nan}}, "out_of_range", "zero"),
        ({"displace": {"max_triangles": 0}}, "out_of_range", "max_triangles"),
        ({"displace": {"max_triangles": 10**9}}, "out_of_range", "max_triangles"),
        ({"displace": {"edge": 1}}, "unknown_key", "edge"),
        ({"displace": 3}, "wrong_type", "displace"),
    ],
)
def test_invalid_displacements_are_refused(keys: dict[str, Any], code: str, fact: str) -> None:
    world = raycam.World()
    if "plane" not in keys:
        keys = {"plane": 1, "textures": {"height": np.full((4, 4), 10.0)}, **keys}
    with raises(raycam.WorldError, code=code, mentions=[fact]):
        world.add_object(**keys)
    assert len(world.objects) == 0


def test_displaced_objects_have_no_height_map() -> None:
    """The relief is part of the surface, so the height map must not be applied again."""
    world = displaced(random_heights(1), plane=1)
    assert world.counts["textures"] == 0
    with raises(raycam.WorldError, code="missing_value", mentions=["height_scale"]):
        world.set_object(0, height_scale=2)
    both = raycam.World()
    heights = random_heights(1)
    both.add_object(
        plane=1, textures={"height": heights, "roughness": heights}, type="principled", displace=True
    )
    assert both.counts["textures"] == 1


def test_set_object_displaces_an_existing_object_and_undoes_it() -> None:
    heights = random_heights(3)
    changed = raycam.World()
    changed.add_object(plane=2, textures={"height": heights}, height_scale=0.1)
    changed.set_object(0, displace=True)
    expected = displaced(heights, plane=2, height_scale=0.1)
    assert changed.triangles(0) == pytest.approx(expected.triangles(0))
    assert changed.counts == expected.counts
    later = raycam.World()
    later.add_object(plane=2)
    later.set_object(0, textures={"height": heights}, height_scale=0.1, displace=True)
    assert later.triangles(0) == pytest.approx(expected.triangles(0))
    before = later.to_bytes()
    later.set_object(0, displace=False)
    assert later.to_bytes() == before


def test_instances_share_the_displaced_mesh() -> None:
    world = displaced(random_heights(3), sphere=1, height_scale=0.1, name="rock", displace={"max_edge": 0.1})
    world.add_object(instance_of="rock", location=[3, 0, 0], scale=2)
    assert world.counts["meshes"] == 1
    assert world.triangles(1) == pytest.approx(2 * world.triangles(0) + [3, 0, 0])
    with raises(raycam.WorldError, mentions=["displace"]):
        world.add_object(instance_of="rock", displace=True, textures={"height": random_heights(4)})


def test_recipes_measure_the_displaced_shape() -> None:
    rock = {
        "sphere": {"radius": 0.3},
        "type": "matte",
        "textures": {"height": [[0.2, 0.2], [0.2, 0.2]]},
        "displace": True,
        "count": 4,
        "on": "floor",
        "category": "rock",
    }
    recipe = raycam.Recipe({"object": [{"plane": {"size": 5}, "name": "floor"}, rock]})
    world = recipe.world(0)
    for number in range(1, 5):
        lowest = world.triangles(number)[..., 2].min()
        assert lowest == pytest.approx(0, abs=2e-3)


def test_displaced_surface_does_not_tear_between_materials(tmp_path: Any) -> None:
    """Two materials meet at an edge of the surface."""
    corners = [[-1, 0, 0], [0, 0, 0], [1, 0, 0], [-1, 1, 0], [0, 1, 0], [1, 1, 0]]
    (tmp_path / "a.obj").write_text(
        "\n".join(
            [f"v {x} {y} {z}" for x, y, z in corners]
            + [f"vt {x} {y}" for x, y, _ in corners]
            + ["usemtl a", "f 1/1 2/2 5/5", "f 1/1 5/5 4/4", "usemtl b", "f 2/2 3/3 6/6", "f 2/2 6/6 5/5"]
        )
    )
    world = raycam.World.from_dict(
        {"object": {"mesh": "a.obj", "textures": {"height": [[0.1, 0.1], [0.1, 0.1]]}, "displace": True}},
        folder=tmp_path,
    )
    assert world.triangles(0)[..., 2] == pytest.approx(0.1, abs=1e-6)
