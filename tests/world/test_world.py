"""Worlds built in Python, from dicts and from files; rays, triangles and time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import raycam
import trimesh
from raycam import _core
from support.raises import raises

CUBE = trimesh.creation.box()


def cube(world: raycam.World, **keys: object) -> int:
    return world.add_mesh(CUBE.vertices, CUBE.faces, **keys)  # type: ignore[arg-type]


def test_add_mesh_and_add_object_create_objects_and_instances() -> None:
    world = raycam.World()
    assert cube(world, name="box", category="furniture") == 0
    assert world.add_object(instance_of="box", location=[3, 0, 0], scale=2) == 1
    first, second = world.objects
    assert (first.name, first.category, first.triangles, first.id) == ("box", "furniture", 12, 0)
    assert second.mesh == first.mesh
    np.testing.assert_allclose(second.matrix, [[2, 0, 0, 3], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
    assert world.counts["triangles"] == 24
    assert world.counts["mesh_triangles"] == 12
    np.testing.assert_allclose(world.bounds, [[-0.5, -1, -1], [4, 1, 1]])
    assert "2 objects, 24 triangles" in repr(world)
    world.add_light(type="sky", radiance=1)
    assert repr(world).endswith(": 2 objects, 24 triangles, 1 light, 0 cameras")
    assert repr(first) == "Object 0 'box', category 'furniture': 12 triangles of mesh 0 at (0, 0, 0)"
    world.set_object(1, visible=False)
    assert repr(world.objects[1]).endswith("12 triangles of mesh 0 at (3, 0, 0), invisible")


@pytest.mark.parametrize("kind", ["list", "big endian", "float32", "strided", "fortran", "uint8 faces"])
def test_mesh_arrays_of_every_dtype_and_layout_are_accepted(kind: str) -> None:
    vertices, faces = np.asarray(CUBE.vertices), np.asarray(CUBE.faces)
    variants = {
        "list": (vertices.tolist(), faces.tolist()),
        "big endian": (vertices.astype(">f8"), faces.astype(">i4")),
        "float32": (vertices.astype(np.float32), faces.astype(np.uint32)),
        "strided": (np.repeat(vertices, 2, axis=0)[::2], np.repeat(faces, 2, axis=1)[:, ::2]),
        "fortran": (np.asfortranarray(vertices), np.asfortranarray(faces)),
        "uint8 faces": (vertices.astype(np.float16), faces.astype(np.uint8)),
    }
    world = raycam.World()
    world.add_mesh(*variants[kind])
    np.testing.assert_array_equal(world.triangles(), vertices[faces])


def test_triangles_ids_and_colors_of_instances_are_returned() -> None:
    world = raycam.World()
    colors = np.linspace(0, 1, 36).reshape(12, 3)
    cube(world, face_colors=colors)
    matrix = np.array([[0.0, -2, 0, 1], [1, 0.5, 0, 2], [0, 0, -3, 3]])
    cube(world, matrix=matrix, material={"color": [0.1, 0.2, 0.3]})
    corners = np.asarray(CUBE.vertices)[CUBE.faces]
    placed = corners @ matrix[:, :3].T + matrix[:, 3]
    np.testing.assert_allclose(world.triangles(), np.concatenate([corners, placed]), atol=1e-15)
    ids = world.triangle_ids()
    assert ids.dtype == np.int32
    np.testing.assert_array_equal(ids, [(i, t) for i in range(2) for t in range(12)])
    expected = np.concatenate([colors, np.tile([0.1, 0.2, 0.3], (12, 1))])
    np.testing.assert_allclose(world.triangle_colors(), expected, atol=1e-7)


def test_world_without_objects_returns_empty_arrays() -> None:
    world = raycam.World()
    assert world.triangles().shape == (0, 3, 3)
    assert world.triangle_ids().shape == (0, 2)
    assert world.bounds is None
    assert world.cast_rays([[0, 0, 0]], [[0, 0, 1]])["instance"].tolist() == [-1]
    frame = raycam.render(world, raycam.Camera.look_at([1, 0, 0], [0, 0, 0], size=(4, 3)))
    assert (frame["instance"] == -1).all()


def test_uint8_colors_are_srgb_and_float_colors_linear() -> None:
    world = raycam.World()
    cube(world, face_colors=np.full((12, 3), 188, np.uint8))
    cube(world, face_colors=np.full((12, 3), 0.5))
    cube(world, vertex_colors=np.full((8, 3), 188, np.uint8))
    cube(world, material={"color": np.array([188, 188, 188], np.uint8)})
    cube(world, material={"color": "#bcbcbc"})
    srgb = ((188 / 255 + 0.055) / 1.055) ** 2.4
    first = world.triangle_colors().reshape(5, 12, 3)[:, 0, 0]
    np.testing.assert_allclose(first, [srgb, 0.5, srgb, srgb, srgb], rtol=1e-6)


def test_objects_and_lights_accept_dicts_tuples_scalars_and_paths() -> None:
    world = raycam.World()
    world.add_object(MappingProxyType({"box": MappingProxyType({"size": (np.float32(1), 2, np.int64(3))})}))
    np.testing.assert_allclose(world.bounds, [[-0.5, -1, -1.5], [0.5, 1, 1.5]])
    world.add_light({"type": "sun", "direction": np.array([0, 0, -1]), "irradiance": (1, 1.0, np.float16(1))})
    assert world.lights == [
        {"type": "sun", "direction": [0, 0, -1], "irradiance": [1, 1, 1], "angular_diameter": 0}
    ]
    with pytest.raises(FileNotFoundError):
        world.add_object(mesh=Path("nowhere.obj"))
    loop: list[object] = []
    loop.append(loop)
    with raises(raycam.WorldError, code="invalid_world", mentions=["[0]"]):
        world.add_object(box={"size": loop})


def test_from_dict_equals_the_world_file(tmp_path: Path) -> None:
    text = """
up = "y"
[camera]
size = [64, 48]
fov = 40
location = [0, 0, 5]
[[object]]
name = "ball"
sphere = { radius = 1, level = 2 }
[[light]]
type = "point"
position = [0, 3, 0]
power = [60, 60, 60]
[render]
samples = 4
[video]
fps = 10
seconds = 2
orbit = { target = [0, 0, 0] }
"""
    description = {
        "up": "y",
        "camera": {"size": [64, 48], "fov": 40, "location": [0, 0, 5]},
        "object": [{"name": "ball", "sphere": {"radius": 1, "level": 2}}],
        "light": {"type": "point", "position": [0, 3, 0], "power": [60, 60, 60]},
        "render": {"samples": 4},
        "video": {"fps": 10, "seconds": 2, "orbit": {"target": [0, 0, 0]}},
    }
    (tmp_path / "a.toml").write_text(text)
    for world in (raycam.load(tmp_path / "a.toml"), raycam.World.from_dict(description)):
        assert world.up == "y"
        assert [item.name for item in world.objects] == ["ball"]
        assert list(world.cameras) == ["camera"]
        assert world.camera("camera").up == "y"
        np.testing.assert_allclose(world.camera("camera").forward, [0, 0, -1], atol=1e-15)
        assert world.render_settings == {"samples": 4}
        assert world.video == raycam.Video(10, 2, 20)
        assert world.lights[0]["power"] == [60, 60, 60]
        quarter = world.camera_at(world.default_camera(), 0.5)
        np.testing.assert_allclose(np.abs(quarter.C), [5, 0, 0], atol=1e-12)


TRIANGLE = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def test_relative_file_names_refer_to_the_folder_of_the_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.off").write_text(TRIANGLE)
    world = raycam.World(folder=tmp_path)
    world.add_object(mesh="a.off")
    np.testing.assert_array_equal(world.triangles(), [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert raycam.load(tmp_path / "a.off").counts["triangles"] == 1
    # In other worlds, including loaded worlds, names are relative to the current folder, as elsewhere in Python.
    loaded = raycam.load(tmp_path / "a.off")
    here = tmp_path / "here"
    here.mkdir()
    (here / "b.off").write_text(TRIANGLE)
    monkeypatch.chdir(here)
    for other in (raycam.World(), loaded, loaded.at(0), raycam.World.from_bytes(loaded.to_bytes())):
        before = other.counts["objects"]
        other.add_object(mesh="b.off")
        other.add_object(mesh="../a.off")
        with raises(FileNotFoundError, code="file_not_found", mentions=["nowhere.off"]):
            other.add_object(mesh="nowhere.off")
        assert other.counts["objects"] == before + 2


def test_scripts_may_name_files_in_any_folder(tmp_path: Path) -> None:
    """The model is in one folder, and the added file in another."""
    model, things = tmp_path / "model", tmp_path / "things"
    for folder in (model, things):
        folder.mkdir()
    (model / "a.off").write_text(TRIANGLE)
    (things / "b.obj").write_text("mtllib b.mtl\nusemtl m\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n")
    (things / "b.mtl").write_text("newmtl m\nKd 0.25 0.5 1\n")
    sky = np.full((4, 8, 3), [1.0, 0.5, 0.25], dtype=np.float32)
    (things / "sky.hdr").write_bytes(_core.encode_hdr(sky))
    (things / "green.png").write_bytes(_core.encode_png(np.full((2, 2, 3), [0, 255, 0], dtype=np.uint8)))
    world = raycam.load(model / "a.off")
    world.add_light(type="environment", image=things / "sky.hdr")
    world.add_object(mesh=str(things / "b.obj"))
    world.add_object(plane={"size": [9, 9]}, location=[0, 0, -1], texture=things / "green.png", type="unlit")
    uvs = [[0, 0], [1, 0], [0, 1]]
    world.add_mesh(
        np.eye(3), [[0, 1, 2]], uvs=uvs, material={"texture": raycam.Texture(things / "green.png")}
    )
    np.testing.assert_allclose(world.triangle_colors()[1], [0.25, 0.5, 1.0])
    up = raycam.Camera.look_at([0, 0, 9], [0, 0, 20], up=[0, 1, 0], size=(8, 8))
    down = raycam.Camera.look_at([3, 3, 9], [3, 3, 0], up=[0, 1, 0], size=(8, 8), fov=1)
    # The package for workers and other programs also contains the light.
    for each in (world, raycam.World.from_bytes(world.to_bytes())):
        np.testing.assert_allclose(
            raycam.render(each, up, samples=1)["color"], sky[:1, :1] + np.zeros((8, 8, 3))
        )
        np.testing.assert_allclose(raycam.render(each, down, samples=1)["color"][4, 4], [0, 1, 0])
    assert world.to_gltf(tmp_path / "world.glb")
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["b.mtl"]):
        world.add_light(type="environment", image=things / "b.mtl")
    # A script may name the file again for another world, but a world file may not.
    (light,) = world.lights
    assert light["image"] == str(things / "sky.hdr")
    raycam.World().add_light(light)
    with raises(raycam.FormatError, code="outside_root"):
        raycam.World.from_dict({"light": [light]})


def test_world_files_and_dicts_may_only_name_files_in_their_folder(tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text(TRIANGLE)
    inside = tmp_path / "world"
    inside.mkdir()
    for name in ("../a.off", str(tmp_path / "a.off")):
        table = {"object": [{"mesh": name}]}
        with raises(raycam.FormatError, code="outside_root"):
            raycam.World.from_dict(table, folder=inside)
        (inside / "world.toml").write_text(f'[[object]]\nmesh = "{name}"\n')
        with raises(raycam.FormatError, code="outside_root"):
            raycam.load(inside / "world.toml")


def test_cameras_are_found_by_name() -> None:
    world = raycam.World()
    cube(world)
    framed = world.default_camera((100, 50))
    assert framed.size == (100, 50)
    corners = np.array(np.meshgrid(*np.transpose(world.bounds))).reshape(3, -1).T  # type: ignore[arg-type]
    pixels, in_front = framed.project(corners)
    assert in_front.all()
    assert (pixels > 0).all()
    assert (pixels < [100, 50]).all()
    left = raycam.Camera.look_at([-5, 0, 0], [0, 0, 0])
    world.add_camera(left, "left")
    world.add_camera(framed, "right")
    assert list(world.cameras) == ["left", "right"]
    assert world.default_camera() == left
    assert world.camera("right") == framed
    with raises(raycam.WorldError, code="unknown_name"):
        world.camera("lft")


def test_cast_rays_agrees_with_a_closed_form() -> None:
    world = raycam.World()
    cube(world)
    cube(world, location=[0, 0, 10])
    hits = world.cast_rays([[0.1, 0.2, 5], [9, 9, 9]], [[0, 0, -2], [0, 0, 1]])
    assert {name: (a.dtype, a.shape) for name, a in hits.items()} == {
        "t": (np.float64, (2,)),
        "instance": (np.int32, (2,)),
        "triangle": (np.int32, (2,)),
        "barycentric": (np.float64, (2, 3)),
        "normal": (np.float64, (2, 3)),
        "position": (np.float64, (2, 3)),
    }
    np.testing.assert_allclose(hits["t"], [2.25, np.inf])
    assert hits["instance"].tolist() == [0, -1]
    np.testing.assert_allclose(hits["normal"], [[0, 0, 1], [0, 0, 0]], atol=1e-7)
    np.testing.assert_allclose(hits["position"], [[0.1, 0.2, 0.5], [np.nan] * 3])
    corners = world.triangles()[hits["triangle"][0]]
    np.testing.assert_allclose(hits["barycentric"][0] @ corners, [0.1, 0.2, 0.5], atol=1e-6)


def test_ray_arrays_of_any_shape_keep_their_shape() -> None:
    world = raycam.World()
    cube(world)
    camera = raycam.Camera.look_at([3, 2, 1], [0, 0, 0], size=(16, 12))
    origins, directions = camera.rays()
    hits = world.cast_rays(origins, directions)
    assert hits["instance"].shape == (12, 16)
    assert hits["position"].shape == (12, 16, 3)
    frame = raycam.render(world, camera, channels=["instance", "triangle", "distance"])
    np.testing.assert_array_equal(hits["instance"], frame["instance"])
    np.testing.assert_array_equal(hits["triangle"], frame["triangle"])
    np.testing.assert_allclose(hits["t"], frame["distance"], rtol=1e-6)
    one = world.cast_rays([3, 2, 1], [-3, -2, -1])
    assert one["t"].shape == ()
    many = world.cast_rays([3, 2, 1], directions)
    np.testing.assert_array_equal(many["triangle"], hits["triangle"])
    assert world.cast_rays(np.zeros((0, 3)), np.zeros((0, 3)))["t"].shape == (0,)


def test_occluded_respects_the_distance_limit() -> None:
    world = raycam.World()
    cube(world)
    origins = np.tile([0.1, 0.2, 5], (4, 1))
    directions = np.array([[0, 0, -1], [0, 0, 1], [0, 0, -1], [0, 0, -3]])
    assert world.occluded(origins, directions).tolist() == [True, False, True, True]
    assert world.occluded(origins, directions, [4.4, 9, 4.6, 1.6]).tolist() == [False, False, True, True]
    assert world.occluded(origins, directions, 4.4).tolist() == [False, False, False, True]
    assert world.occluded([0.1, 0.2, 5], [0, 0, -1]).shape == ()


def test_invalid_rays_return_misses() -> None:
    world = raycam.World()
    cube(world)
    directions = np.array([[0, 0, 0], [np.nan, 0, -1], [0, 0, -np.inf]])
    hits = world.cast_rays([0, 0, 5], directions)
    assert (hits["instance"] == -1).all()
    assert np.isinf(hits["t"]).all()
    assert not world.occluded([0, 0, 5], directions).any()


def test_changed_world_is_prepared_again() -> None:
    world = raycam.World()
    cube(world)
    ray = ([0, 0, 5], [0, 0, -1])
    assert world.cast_rays(*ray)["t"] == 4.5
    cube(world, location=[0, 0, 2])
    assert world.cast_rays(*ray)["t"] == 2.5
    assert world.cast_rays(*ray)["instance"] == 1


def test_at_returns_a_moved_copy_of_the_world() -> None:
    world = raycam.World()
    cube(world, name="box")
    world.set_video(
        fps=2,
        interpolation="linear",
        keyframe=[
            {"time": 0, "object": "box", "location": [0, 0, 0]},
            {"time": 2, "object": "box", "location": [0, 0, 2]},
        ],
    )
    assert world.video == raycam.Video(2, 2, 4)
    moved = world.prepare().at(1)
    np.testing.assert_allclose(moved.objects[0].matrix[:3, 3], [0, 0, 1])
    assert moved.cast_rays([0, 0, 5], [0, 0, -1])["t"] == 3.5
    assert world.cast_rays([0, 0, 5], [0, 0, -1])["t"] == 4.5
    with raises(raycam.WorldError, code="unknown_name"):
        world.set_video(keyframe=[{"time": 0, "object": "bax", "location": [0, 0, 0]}])
    with raises(raycam.WorldError, code="invalid_world", mentions=["[video]"]):
        raycam.World().camera_at(raycam.Camera.look_at([1, 0, 0], [0, 0, 0]), 0)


def test_zero_area_triangles_are_kept_counted_and_never_hit() -> None:
    world = raycam.World()
    world.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 3], [0, 0, 1], [0, 1, 2]])
    assert world.counts["zero_area_triangles"] == 2
    assert world.counts["triangles"] == 3
    hits = world.cast_rays([[0.5, 0, 1], [0.2, 0.2, 1]], [0, 0, -1])
    assert hits["triangle"].tolist() == [2, 2]


def test_categories_can_be_names_or_numbers() -> None:
    world = raycam.World()
    for category in ("cow", 7, None, "cow", "tree"):
        cube(world, **({"category": category} if category is not None else {}))
    assert world.categories == {1: "cow", 2: "tree", 7: "7"}
    assert [item.category for item in world.objects] == ["cow", "7", None, "cow", "tree"]
    for wrong in (-1, 1.5, ""):
        with raises(raycam.WorldError, mentions=["category"]):
            cube(world, category=wrong)


def test_masked_arrays_are_refused() -> None:
    """NumPy's `asarray` drops the mask, so masked depths or points would become valid values."""
    points = np.ma.masked_greater(np.eye(3), 0.5)
    calls: list[Callable[[raycam.World], object]] = [
        lambda world: world.add_mesh(points, [[0, 1, 2]]),
        lambda world: world.add_mesh(np.eye(3), np.ma.masked_equal([[0, 1, 2]], 2)),
        lambda world: world.add_object(plane={}, texture=np.ma.masked_equal(np.eye(4), 0)),
        lambda world: world.cast_rays(np.zeros((3, 3)), points),
        lambda _: raycam.Camera.look_at(points[0], [0, 0, 0]),
    ]
    for call in calls:
        world = raycam.World()
        world.add_object(box={})
        with raises(raycam.Error, code="wrong_type"):
            call(world)
    world.add_mesh(np.ma.masked_greater(np.eye(3), 5), [[0, 1, 2]])  # no value is masked
