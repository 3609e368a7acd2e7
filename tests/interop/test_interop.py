"""Conversion of other libraries' meshes to worlds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import raycam
import trimesh
from PIL import Image
from support.raises import has_notice, raises
from trimesh.visual.material import PBRMaterial

BOX = trimesh.creation.box()


def test_from_trimesh_keeps_vertices_and_colors() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    world = raycam.from_trimesh(sphere)
    assert world.up == "z"
    np.testing.assert_allclose(world.triangles(), sphere.triangles, atol=1e-7)
    np.testing.assert_allclose(world.triangle_colors(), 0.8, atol=1e-6)
    # float32 values are kept bit for bit; far from the origin, only float32 rounding is lost.
    np.testing.assert_array_equal(raycam.from_trimesh(BOX).triangles(), BOX.triangles)
    far = sphere.copy()
    far.apply_translation([4e6, 5e5, 1e3])
    np.testing.assert_allclose(raycam.from_trimesh(far).triangles(), far.triangles, rtol=0, atol=1e-6)


def test_from_trimesh_converts_vertex_and_face_colors() -> None:
    colors = np.random.default_rng(5).integers(0, 256, (12, 4), np.uint8)
    colors[:, 3] = 255
    linear = trimesh.visual.color.to_float(colors)[:, :3]
    linear = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)
    faces = trimesh.Trimesh(BOX.vertices, BOX.faces, face_colors=colors, process=False)
    np.testing.assert_allclose(raycam.from_trimesh(faces).triangle_colors(), linear, atol=1e-6)
    vertices = trimesh.Trimesh(BOX.vertices, BOX.faces, vertex_colors=colors[:8], process=False)
    expected = linear[:8][BOX.faces].mean(axis=1)
    np.testing.assert_allclose(raycam.from_trimesh(vertices).triangle_colors(), expected, atol=1e-6)


def test_from_trimesh_converts_textures_and_materials() -> None:
    """In trimesh, the upper left texel is at u = 0, v = 1."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    uv = (square[:, :2] + 1) / 2
    pixels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [90, 120, 33]]], np.uint8)
    camera = raycam.Camera.look_at(
        [0, 0, 9], [0, 0, 0], [0, 1, 0], size=(2, 2), fov=2 * np.degrees(np.arctan(1 / 9))
    )
    for material in (
        PBRMaterial(baseColorTexture=Image.fromarray(pixels), metallicFactor=0.5, doubleSided=True),
        trimesh.visual.material.SimpleMaterial(image=Image.fromarray(pixels), diffuse=[255] * 4),
    ):
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        mesh = trimesh.Trimesh(square, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False)
        world = raycam.from_trimesh(mesh)
        shown = raycam.render(world, camera, integrator="flat", samples=1).to_srgb8()
        np.testing.assert_array_equal(shown, pixels)
    factor = PBRMaterial(baseColorFactor=[255, 51, 0, 255])
    mesh = trimesh.Trimesh(BOX.vertices, BOX.faces, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=factor)
    np.testing.assert_allclose(raycam.from_trimesh(mesh).triangle_colors()[0], [1, 0.2, 0], atol=1e-6)


def test_vertex_colors_multiply_the_texture() -> None:
    """trimesh stores both vertex colours and texture for a glTF file that contains both."""
    image = Image.fromarray(np.full((2, 2, 3), 188, np.uint8))
    visual = trimesh.visual.TextureVisuals(uv=np.full((8, 2), 0.5), image=image)
    visual.vertex_attributes["color"] = np.tile(np.array([255, 0, 128, 255], np.uint8), (8, 1))
    mesh = trimesh.Trimesh(BOX.vertices, BOX.faces, visual=visual, process=False)
    factor = mesh.visual.material.to_pbr().baseColorFactor
    factor = np.ones(3) if factor is None else np.asarray(factor[:3]) / 255
    expected = linear(np.array([188, 188, 188]) / 255) * linear(np.array([255, 0, 128]) / 255) * factor
    shown = raycam.from_trimesh(mesh).triangle_colors()
    np.testing.assert_allclose(shown, np.tile(expected, (12, 1)), atol=1e-5)


def test_from_trimesh_converts_the_nodes_of_a_scene() -> None:
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.5, [1, 2, 3], [4, 5, 6])
    scene.add_geometry(BOX, node_name="first", geom_name="box", transform=turn)
    scene.graph.update(frame_to="second", frame_from="first", matrix=np.diag([-1.0, 2, 3, 1]), geometry="box")
    scene.add_geometry(trimesh.PointCloud(np.zeros((3, 3))), geom_name="cloud")
    scene.camera = trimesh.scene.Camera(resolution=(64, 48), fov=(60, 46.8))
    scene.camera_transform = turn
    world = raycam.from_trimesh(scene, up="y")
    assert world.up == "y"
    matrices = {thing.name: thing.matrix for thing in world.objects}
    np.testing.assert_allclose(matrices["first"], turn, atol=1e-12)
    np.testing.assert_allclose(matrices["second"], turn @ np.diag([-1.0, 2, 3, 1]), atol=1e-12)
    assert world.counts["meshes"] == 1
    assert has_notice(world.notices, "ignored_element", "cloud", "PointCloud")
    camera = world.cameras["camera"]
    np.testing.assert_allclose(camera.C, turn[:3, 3], atol=1e-9)
    ray = turn[:3, :3] @ [0, 0, -1]
    pixel, in_front = camera.project(turn[:3, 3] + ray)
    assert in_front.all()
    np.testing.assert_allclose(pixel, [32, 24], atol=1e-6)


def test_from_trimesh_shades_smoothly_on_request() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1)
    camera = raycam.Camera.look_at([3, 1, 2], [0, 0, 0], [0, 0, 1], size=(32, 32), fov=30)
    for smooth, few in ((False, True), (True, False)):
        world = raycam.from_trimesh(sphere, smooth=smooth)
        frame = raycam.render(world, camera, channels=["shading_normal", "instance"], samples=1)
        normals = frame["shading_normal"][frame["instance"] == 0]
        assert (len(np.unique(normals.round(4), axis=0)) <= len(sphere.faces)) == few


class Legacy(SimpleNamespace):
    """The attributes of an `open3d.geometry.TriangleMesh`."""

    def has_vertex_normals(self) -> bool:
        return hasattr(self, "vertex_normals")

    def has_vertex_colors(self) -> bool:
        return hasattr(self, "vertex_colors")

    def has_triangle_uvs(self) -> bool:
        return hasattr(self, "triangle_uvs")

    def has_textures(self) -> bool:
        return hasattr(self, "textures")


def test_from_open3d_keeps_vertices_colors_and_textures() -> None:
    colors = np.random.default_rng(6).random((8, 3))
    mesh = Legacy(vertices=BOX.vertices, triangles=BOX.faces, vertex_colors=colors)
    world = raycam.from_open3d(mesh)
    np.testing.assert_array_equal(world.triangles(), BOX.triangles)
    shown = linear(colors)[BOX.faces].mean(axis=1)
    np.testing.assert_allclose(world.triangle_colors(), shown, atol=1e-6)
    two: Any = raycam.from_open3d([mesh, mesh])
    assert two.counts["objects"] == 2
    # Each vertex has its own texture coordinates, and each triangle has its own image.
    images = [np.full((2, 2, 3), value, np.uint8) for value in (255, 0)]
    ids = np.arange(12) % 2
    mesh = Legacy(
        vertices=BOX.vertices, triangles=BOX.faces, triangle_uvs=np.full((36, 2), 0.5), textures=images,
        triangle_material_ids=ids,
    )  # fmt: skip
    world = raycam.from_open3d(mesh)
    by_place = {tuple(corner.mean(axis=0).round(6)): color for corner, color in zip(
        world.triangles(), world.triangle_colors(), strict=True)}  # fmt: skip
    for corners, which in zip(BOX.triangles, ids, strict=True):
        np.testing.assert_allclose(by_place[tuple(corners.mean(axis=0).round(6))], 1 - which, atol=1e-6)


class Held(np.ndarray):
    """The methods of an `open3d.core.Tensor` or an `open3d.t.geometry.Image`."""

    def cpu(self) -> Any:
        return self

    def numpy(self) -> Any:
        return np.asarray(self)

    def as_tensor(self) -> Any:
        return self

    def is_empty(self) -> bool:
        return self.size == 0


class Tensor:
    """The maps of an `open3d.t.geometry.TriangleMesh`, which can only be converted to a `dict`."""

    def __init__(self, triangle: dict[str, Any], material: SimpleNamespace | None, **legacy: Any) -> None:
        self.triangle, self.material, self.legacy = triangle, material, legacy

    def has_valid_material(self) -> bool:
        return self.material is not None

    def to_legacy(self) -> Legacy:
        return Legacy(vertices=BOX.vertices, triangles=BOX.faces, **self.legacy)


def test_from_open3d_accepts_tensor_meshes() -> None:
    painted = np.random.default_rng(7).integers(0, 256, (12, 3), np.uint8)
    world = raycam.from_open3d(Tensor({"colors": painted.view(Held)}, None))
    np.testing.assert_allclose(world.triangle_colors(), linear(painted / 255), atol=1e-6)
    np.testing.assert_array_equal(world.triangles(), BOX.triangles)
    texture = np.zeros((2, 2, 3), np.uint8)
    texture[...] = (255, 128, 0)
    material = SimpleNamespace(
        material_name="defaultLit",
        texture_maps=[("albedo", texture.view(Held)), ("roughness", texture[..., :1].copy().view(Held))],
        scalar_properties=[("metallic", 0.25), ("clear_coat", 1.0), ("reflectance", 0.75)],
        vector_properties=[
            ("base_color", np.array([0.5, 1, 1, 1])),
            ("emissive_color", np.array([0, 0, 0, 1])),
        ],
    )
    world = raycam.from_open3d(Tensor({}, material, triangle_uvs=np.full((36, 2), 0.5)))
    assert not world.notices
    expected = linear(np.array([255, 128, 0]) / 255) * [0.5, 1, 1]
    np.testing.assert_allclose(world.triangle_colors(), np.tile(expected, (12, 1)), atol=1e-6)


def linear(srgb: Any) -> Any:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def test_objects_that_are_not_meshes_are_refused() -> None:
    with raises(raycam.WorldError, code="wrong_type", mentions=["trimesh.Trimesh", "trimesh.Scene"]):
        raycam.from_trimesh(3)
    cloud: Any = SimpleNamespace(to_legacy=lambda: None, point={})
    with raises(raycam.WorldError, code="wrong_type", mentions=["Open3D", "TriangleMesh", "SimpleNamespace"]):
        raycam.from_open3d(cloud)
    with raises(raycam.WorldError, code="nothing_visible"):
        raycam.from_open3d([])
    with raises(raycam.WorldError, code="nothing_visible"):
        raycam.from_trimesh(trimesh.Trimesh(np.zeros((3, 3)), np.zeros((0, 3), int), process=False))
    with raises(raycam.WorldError, code="out_of_range"):
        raycam.from_open3d(Legacy(vertices=np.full((3, 3), np.nan), triangles=np.array([[0, 1, 2]])))
    with raises(raycam.WorldError, code="index_out_of_range"):
        raycam.from_open3d(Legacy(vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 5]])))
