"""Code for Open3D, run with `raycam.compat.open3d` and, if installed, with Open3D."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.compat import open3d as compat
from support.raises import Fault, fault, raises
from support.surfaces import cube, joined

HAS_OPEN3D = importlib.util.find_spec("open3d") is not None
with_open3d = pytest.mark.skipif(not HAS_OPEN3D, reason="Open3D is not installed")


@pytest.fixture(
    params=["raycam", pytest.param("installed", marks=with_open3d), pytest.param("open3d", marks=with_open3d)]
)
def o3d(request: pytest.FixtureRequest) -> Iterator[Any]:
    """The module that a test uses as `open3d`."""
    if request.param == "raycam":
        yield compat
        return
    module = importlib.import_module("open3d")
    if request.param == "installed":
        compat.install()
    yield module
    compat.uninstall()


def box_scene(o3d: Any) -> Any:
    scene = o3d.t.geometry.RaycastingScene()
    vertices, faces = cube()
    assert (
        scene.add_triangles(
            o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))
        )
        == 0
    )
    return scene


def test_calls_copied_from_public_projects_return_the_results_of_open3d(o3d: Any) -> None:
    scene = box_scene(o3d)
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(cube((3, 0, 0), (4, 1, 1))[0]), o3d.utility.Vector3iVector(cube()[1])
    )
    assert scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(legacy)) == 1
    origin, direction = [0.3, 0.4, -1.0], [0.0, 0.0, 2.0]
    rays = o3d.core.Tensor(
        [[*origin, *direction], [3.3, 0.4, 5, 0, 0, -1], [9, 9, 9, 0, 0, 1]], dtype=o3d.core.Dtype.Float32
    )
    answer = scene.cast_rays(rays)
    assert set(answer) == {"t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals"}
    assert answer["t_hit"][0].item() == pytest.approx(0.5)
    assert bool(answer["t_hit"].isfinite()[1])
    assert answer["t_hit"].numpy()[2] == np.inf
    geometry = answer["geometry_ids"].numpy()
    assert (geometry == scene.INVALID_ID).tolist() == [False, False, True]
    assert geometry.dtype == answer["primitive_ids"].numpy().dtype == np.uint32
    assert geometry.tolist() == [0, 1, 4294967295]
    np.testing.assert_allclose(
        answer["primitive_normals"].numpy(), [[0, 0, -1], [0, 0, 1], [0, 0, 0]], atol=1e-6
    )
    uv, primitive = answer["primitive_uvs"].numpy(), answer["primitive_ids"].numpy()
    v, f = cube()
    w = np.column_stack([1 - uv.sum(1), uv])
    np.testing.assert_allclose((v[f[primitive[0]]] * w[0][:, None]).sum(0), [0.3, 0.4, 0], atol=1e-6)
    lists = scene.list_intersections(rays)
    assert lists["ray_splits"].numpy().tolist() == [0, 2, 4, 4]
    assert lists["ray_ids"].numpy().tolist() == [0, 0, 1, 1]
    t, ray = lists["t_hit"].numpy(), lists["ray_ids"].numpy()
    np.testing.assert_allclose(t[np.lexsort((t, ray))], [0.5, 1.0, 4, 5], rtol=1e-6)
    assert scene.count_intersections(rays, nthreads=1).numpy().tolist() == [2, 2, 0]
    assert scene.count_intersections(rays).numpy().dtype == np.int32
    assert scene.test_occlusions(rays, tfar=1.0).numpy().tolist() == [True, False, False]
    assert scene.test_occlusions(rays, tnear=1e-4, tfar=10.0).numpy().reshape(3, 1).tolist() == [
        [True],
        [True],
        [False],
    ]
    assert scene.cast_rays(rays.numpy())["t_hit"].numpy().shape == (3,), "NumPy as it is"


def test_distances_signs_and_occupancy_of_points_equal_closed_forms(o3d: Any) -> None:
    scene = box_scene(o3d)
    grid = np.array([[[0.5, 0.5, 0.9], [0.5, 0.5, 3]], [[2, 0.25, 0.5], [0.5, 0.4, 0.5]]], dtype=np.float32)
    signed = scene.compute_signed_distance(grid).numpy()
    assert signed.dtype == np.float32
    np.testing.assert_allclose(signed, [[-0.1, 2], [1, -0.4]], rtol=1e-5)
    np.testing.assert_allclose(scene.compute_distance(grid).numpy(), np.abs(signed))
    assert scene.compute_occupancy(grid, nsamples=3).numpy().astype(bool).tolist() == [
        [True, False],
        [False, True],
    ]
    assert scene.compute_occupancy(grid).numpy().dtype == np.float32
    found = scene.compute_closest_points(grid)
    np.testing.assert_allclose(found["points"].numpy()[0], [[0.5, 0.5, 1]] * 2)
    assert found["geometry_ids"].numpy().tolist() == [[0, 0], [0, 0]]
    np.testing.assert_allclose(found["primitive_normals"].numpy()[1, 0], [1, 0, 0], atol=1e-7)
    assert found["primitive_uvs"].numpy().shape == (2, 2, 2)
    with pytest.raises(RuntimeError):
        scene.compute_occupancy(grid, nsamples=2)
    with pytest.raises(RuntimeError):
        scene.cast_rays(np.zeros((4, 5), np.float32))


def test_pinhole_rays_equal_those_of_open3d(o3d: Any) -> None:
    scene = box_scene(o3d)
    angle = 0.3
    extrinsic = np.array(
        [
            [np.cos(angle), 0, np.sin(angle), -0.4],
            [0, 1, 0, -0.5],
            [-np.sin(angle), 0, np.cos(angle), 3],
            [0, 0, 0, 1],
        ]
    )
    intrinsic = np.array([[40, 0, 15.2], [0, 42, 12], [0, 0, 1.0]])
    rays = scene.create_rays_pinhole(intrinsic, extrinsic, 30, 24)
    assert rays.numpy().dtype == np.float32
    assert rays.numpy().shape == (24, 30, 6)
    ray = rays.numpy()[3, 7].astype(float)
    np.testing.assert_allclose(extrinsic[:3] @ [*ray[:3], 1], 0, atol=1e-6)
    np.testing.assert_allclose(
        extrinsic[:3, :3] @ ray[3:], [(7.5 - 15.2) / 40, (3.5 - 12) / 42, 1], atol=1e-6
    )
    depth = scene.cast_rays(rays)["t_hit"].numpy()
    depth[~np.isfinite(depth)] = 0
    assert 2 < depth.max() < 5
    looking = o3d.t.geometry.RaycastingScene.create_rays_pinhole(
        fov_deg=60.0, center=[0, 0, 0], eye=[0, 0, 5], up=[0, 1, 0], width_px=4, height_px=3
    )
    np.testing.assert_allclose(looking.numpy()[0, 0], [0, 0, 5, 0.4330127, -0.28867513, -1], rtol=1e-6)
    positional = o3d.t.geometry.RaycastingScene.create_rays_pinhole(
        60.0, [0, 0, 0], [0, 0, 5], [0, 1, 0], 4, 3
    )
    np.testing.assert_array_equal(positional.numpy(), looking.numpy())


@pytest.mark.parametrize("scene_of", ["raycam", pytest.param("installed", marks=with_open3d)])
def test_edge_cases_that_open3d_gets_wrong_are_correct(scene_of: str, tmp_path: Path) -> None:
    if scene_of == "installed":
        compat.install()
        module = importlib.import_module("open3d")
    else:
        module = compat
    try:
        scene = module.t.geometry.RaycastingScene(device=module.core.Device("CPU:0"))
        point = np.zeros((1, 3))
        assert scene.compute_distance(point).numpy().tolist() == [np.inf]
        assert scene.cast_rays(np.zeros((2, 6)))["geometry_ids"].numpy().tolist() == [scene.INVALID_ID] * 2
        vertices, faces = joined(cube(), cube((0.5, 0.5, 0.5), (1.5, 1.5, 1.5)), cube((0, 0, -9), (1, 1, -8)))
        scene.add_triangles(vertices, faces)
        assert scene.compute_occupancy([[0.7, 0.7, 0.7]]).numpy().tolist() == [1.0]
        t = scene.list_intersections([[0.7, 0.6, 5, 0, 0, -1]])["t_hit"].numpy()
        assert (np.diff(t) > 0).all()
        assert len(t) == 6
        with raises(raycam.SettingsError, code="invalid_settings", mentions=["[5]"]):
            scene.count_intersections(np.zeros(5))
    finally:
        compat.uninstall()


def test_tensors_convert_and_files_are_read(tmp_path: Path) -> None:
    tensor = compat.core.Tensor([[1.0, np.inf]], dtype=compat.core.float32)
    assert tensor.isinf().numpy().tolist() == [[False, True]]
    assert (tensor.clone() + 1)[0, 0].item() == 2
    assert compat.core.Tensor.from_numpy(np.arange(3)).to(compat.core.Dtype.Float32).dtype == np.float32
    with raises(RuntimeError, mentions=["CPU"]):
        compat.core.Device("CUDA:0")
    path = tmp_path / "box.obj"
    v, f = cube()
    path.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in v)
        + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in f)
    )
    mesh = compat.io.read_triangle_mesh(str(path))
    assert (mesh.vertices.shape, mesh.triangles.shape) == ((8, 3), (12, 3))
    scene = compat.t.geometry.RaycastingScene()
    scene.add_triangles(compat.t.geometry.TriangleMesh.from_legacy(mesh.translate([0, 0, 1])))
    assert scene.cast_rays([[0.2, 0.3, -1, 0, 0, 1]])["t_hit"].numpy().tolist() == [2.0]


SOLID = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
FACES = np.array([[0, 1, 2], [0, 1, 3]], np.uint32)


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        # Indices of quads would be read as other triangles, and fractions would be cut off.
        (SOLID, [[0, 1, 2, 3]] * 3, fault("invalid_settings", "triangle_indices", "[n, 3]", "[3, 4]")),
        (SOLID, [0, 1, 2], fault("invalid_settings", "[3]")),
        (SOLID, FACES + 0.5, fault("invalid_settings", "float64")),
        (SOLID, [[0, 1, 9]], fault("invalid_settings", "add_triangles")),
        (SOLID.ravel(), FACES, fault("invalid_settings", "vertex_positions", "[n, 3]", "[12]")),
        (SOLID * 1j, FACES, fault("invalid_settings", "vertex_positions")),
        (SOLID * np.nan, FACES, fault("invalid_settings", "add_triangles")),
        ([[0, 1], [2]], FACES, fault("invalid_settings", "vertex_positions")),
    ],
)
def test_triangles_of_wrong_shapes_and_kinds_raise(vertices: Any, faces: Any, words: Fault) -> None:
    scene = compat.t.geometry.RaycastingScene()
    with raises(RuntimeError, **words) as caught:
        scene.add_triangles(vertices, faces)
    assert isinstance(caught.value, raycam.SettingsError)
    assert scene.add_triangles(SOLID, FACES) == 0


def test_invalid_matrices_sizes_and_threads_raise() -> None:
    scene = compat.t.geometry.RaycastingScene
    one, four = np.eye(3), np.eye(4)
    looking = {"center": [0, 0, 1], "eye": [0, 0, 0], "up": [0, 1, 0], "width_px": 4, "height_px": 3}
    for arguments, words in (
        ((four, four, 4, 3), fault("invalid_settings", "intrinsic_matrix", "[3, 3]")),
        ((one, one, 4, 3), fault("invalid_settings", "extrinsic_matrix", "[4, 4]")),
        ((one * 0, four, 4, 3), fault("invalid_settings", "intrinsic_matrix")),
        ((one, four, 0, 3), fault("invalid_settings", "width_px")),
        ((one, four, 4, 2.5), fault("invalid_settings", "height_px", "2.5")),
    ):
        with raises(RuntimeError, **words):
            scene.create_rays_pinhole(*arguments)
    for given in ({"fov_deg": 190}, {"fov_deg": 60, "eye": [0, 0, 1]}, {"fov_deg": 60, "up": [0, 0, 2]}):
        with raises(RuntimeError, code="invalid_settings"):
            scene.create_rays_pinhole(**(looking | given))
    with raises(RuntimeError, code="invalid_settings", mentions=["-1"]):
        scene().cast_rays(np.zeros((1, 6), np.float32), nthreads=-1)
    with raises(RuntimeError, code="invalid_settings", mentions=["positions"]):
        scene().add_triangles(compat.t.geometry.TriangleMesh())


SHAPES_OF_OPEN3D = [
    ("box", (1, 2, 3), 8, 2246, [20.0, 52.0, 66.0], [3.428571, 6.857143, 2.285714]),
    (
        "sphere",
        (0.7, 5),
        42,
        690075,
        [-10.771892, -33.152476, -192.224758],
        [-16.157483, -49.72762, -254.296108],
    ),
    (
        "cylinder",
        (0.7, 1.5, 7, 3),
        30,
        243117,
        [-9.8, -20.34991, -123.25],
        [-12.082509, -25.089589, -100.617183],
    ),
    ("cone", (0.7, 1.5, 7, 1), 9, 3654, [-2.45, -5.087477, 3.0], [-3.5, -7.267825, 1.0]),
    ("cone", (0.7, 1.5, 7, 3), 23, 100821, [-4.9, -10.174955, 188.5], [-10.130568, -18.934444, 76.919477]),
    ("torus", (2, 0.3, 5, 4), 20, 80850, [-80.0, -110.110554, -3.0], [-0.970759, -1.336135, -9.707587]),
    ("tetrahedron", (1.3,), 4, 137, [-1.838478, -1.061446, 2.6], [-1.414214, -0.816497, 2.0]),
    ("octahedron", (1.3,), 6, 858, [-3.9, -3.9, -3.9], [-3.0, -3.0, -3.0]),
    ("icosahedron", (1.3,), 12, 11084, [0.0, 5.2, -13.613777], [0.0, 2.102924, -5.505528]),
]
"""Shapes with their sizes, and what Open3D 0.20 prints for them: the number of vertices, the sum of all
indices times their positions in the list (from 1), and the sums of vertices and of normals times their rows."""


@pytest.mark.parametrize(("shape", "sizes", "count", "indices", "vertices", "normals"), SHAPES_OF_OPEN3D)
def test_shapes_equal_open3d(
    o3d: Any, shape: str, sizes: Any, count: int, indices: int, vertices: Any, normals: Any
) -> None:
    legacy = getattr(o3d.geometry.TriangleMesh, f"create_{shape}")(*sizes)
    tensors = getattr(o3d.t.geometry.TriangleMesh, f"create_{shape}")(*sizes)
    legacy.compute_vertex_normals()
    tensors.compute_vertex_normals()
    rows = np.arange(1, count + 1)
    for positions, triangles, directions in (
        (legacy.vertices, legacy.triangles, legacy.vertex_normals),
        (
            tensors.vertex.positions.cpu().numpy(),
            tensors.triangle["indices"].cpu().numpy(),
            tensors.vertex.normals.cpu().numpy(),
        ),
    ):
        assert len(positions) == count
        faces = np.asarray(triangles)
        assert faces.ravel() @ np.arange(1, faces.size + 1) == indices
        np.testing.assert_allclose(rows @ np.asarray(positions), vertices, atol=2e-4)
        np.testing.assert_allclose(rows @ np.asarray(directions), normals, atol=2e-4)


def test_mesh_methods_equal_open3d(o3d: Any) -> None:
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    legacy = o3d.geometry.TriangleMesh.create_box(1, 2, 3).compute_vertex_normals()
    tensors = o3d.t.geometry.TriangleMesh.create_box(1, 2, 3).compute_vertex_normals()
    assert legacy.has_vertices()
    assert legacy.has_triangles()
    assert legacy.has_vertex_normals()
    for mesh in (legacy, tensors):
        assert mesh.get_surface_area() == pytest.approx(22)
        mesh.rotate(turn, np.array([0.0, 0, 0])).scale(2.0, np.array([0.0, 0, 0]))
        mesh.translate(np.array([1.0, 2, 3])).translate(np.array([0.0, 0, 1]), relative=False)
        mesh.transform(np.diag([1.0, 1, -1, 1]))

    def numbers(values: Any) -> Any:
        return np.asarray(values.numpy() if hasattr(values, "numpy") else values)

    for mesh in (legacy, tensors):
        np.testing.assert_allclose(numbers(mesh.get_min_bound()), [-2, -1, -4], atol=1e-6)
        np.testing.assert_allclose(numbers(mesh.get_max_bound()), [2, 1, 2], atol=1e-6)
        np.testing.assert_allclose(numbers(mesh.get_center()), [0, 0, -1], atol=1e-6)
    # The first corner's normal, (-6, -3, -2) / 7, rotated by 90 degrees and mirrored.
    # The weights are the areas 3, 3 / 2 and 1 of the adjacent triangles.
    for normal in (legacy.vertex_normals[0], tensors.to_legacy().vertex_normals[0]):
        np.testing.assert_allclose(normal, np.array([3, -6, 2]) / 7, atol=1e-6)
    copied = tensors.to(o3d.core.Device("CPU:0")).clone().cpu()
    copied.vertex.positions = copied.vertex.positions * 2
    assert float(tensors.get_max_bound()[0].item()) == pytest.approx(2)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(copied)
    found = scene.compute_closest_points(np.array([[9, 0, 0]], np.float32))
    assert found["points"][0, 0].cpu().item() == pytest.approx(4)


def test_meshes_are_copied_and_added(o3d: Any) -> None:
    box, ball = o3d.geometry.TriangleMesh.create_box(), o3d.geometry.TriangleMesh.create_sphere(0.5)
    copied = o3d.geometry.TriangleMesh(box)
    copied.translate([5, 0, 0])
    np.testing.assert_array_equal(box.get_max_bound(), [1, 1, 1])
    ball.compute_vertex_normals()
    both = box + ball
    assert not both.has_vertex_normals()
    assert len(both.vertices) == len(box.vertices) + len(ball.vertices)
    assert both.get_surface_area() == pytest.approx(box.get_surface_area() + ball.get_surface_area())
    copied += copied
    assert copied.get_surface_area() == pytest.approx(12)
    assert o3d.__version__.split(".")[0] == "0"


def test_tensor_methods_equal_open3d(o3d: Any) -> None:
    tensor = o3d.core.Tensor([[1.0, 2, 3], [4, 5, 6]])
    assert tensor[1, 2].cpu().item() == 6
    assert tensor.sum().cpu().item() == 21
    assert tensor.sum(dim=(0,)).numpy().tolist() == [5, 7, 9]
    assert tensor.mean(dim=(1,), keepdim=True).numpy().tolist() == [[2], [5]]
    assert tensor.argmin((1,)).numpy().tolist() == [0, 0]
    assert tensor.T().numpy().tolist() == [[1, 4], [2, 5], [3, 6]]
    assert tensor.eq(4).numpy().tolist() == [[False] * 3, [True, False, False]]
    assert bool((tensor > 5).any().cpu())
    assert [row.cpu().numpy().tolist() for row in tensor] == [[1, 2, 3], [4, 5, 6]]
    assert o3d.core.concatenate((tensor, tensor), 0).shape[0] == 4
    assert tensor.append(tensor, axis=0).numpy().shape == (4, 3)
    assert tensor.device == o3d.core.Device("CPU:0")
    assert str(tensor.device) == "CPU:0"
    assert (o3d.core.cuda.device_count(), o3d.core.cuda.is_available()) == (0, False)
    view = tensor[0, 1]
    tensor[0, 1] = 9
    assert view.item() == 9
    assert o3d.core.Tensor.full((2,), 3.0).numpy().tolist() == [3, 3]


def test_tensors_pass_through_numpy() -> None:
    tensor = compat.core.Tensor([[1.0, 2, 3], [4, 5, 6]])
    assert np.sum(tensor) == 21
    np.testing.assert_array_equal(np.max(tensor, axis=0, keepdims=True), [[4, 5, 6]])
    assert f"{float(tensor.min()):.1f}" == "1.0"
    assert np.linalg.norm(tensor[0]) == pytest.approx(np.sqrt(14))
    assert str(tensor) == "[[1. 2. 3.]\n [4. 5. 6.]]"


def test_sizes_that_are_not_positive_raise(o3d: Any) -> None:
    for mesh in (o3d.geometry.TriangleMesh, o3d.t.geometry.TriangleMesh):
        for call in (
            lambda mesh=mesh: mesh.create_sphere(-1),
            lambda mesh=mesh: mesh.create_box(0, 1, 1),
            lambda mesh=mesh: mesh.create_sphere(1, 0),
            lambda mesh=mesh: mesh.create_cylinder(1, 1, 5, 0),
        ):
            with pytest.raises(RuntimeError):
                call()


@pytest.mark.parametrize(
    ("path", "alternative"),
    [
        ("visualization", "raycam.view"),
        ("pipelines", "install Open3D"),
        ("camera", "raycam.Camera"),
        ("geometry.PointCloud", "NumPy"),
        ("geometry.TriangleMesh.create_arrow", "trimesh"),
        ("t.geometry.TriangleMesh.create_text", "trimesh"),
        ("t.geometry.RaycastingScene.foo", "raycam.World"),
        ("core.HashMap", "dict"),
        ("core.Tensor.svd", "NumPy"),
        ("io.write_triangle_mesh", "to_gltf"),
        ("t.io.read_point_cloud", "NumPy"),
        ("utility.set_verbosity_level", "logging"),
    ],
)
def test_missing_names_raise_with_an_alternative(path: str, alternative: str) -> None:
    found: Any = compat
    *owners, name = path.split(".")
    for owner in owners:
        found = getattr(found, owner)
    with pytest.raises(AttributeError) as caught:
        getattr(found, name)
    assert alternative in str(caught.value)
    assert name in str(caught.value)


def test_missing_methods_raise_with_an_alternative() -> None:
    mesh = compat.geometry.TriangleMesh.create_box()
    with raises(AttributeError, mentions=["world.topology"]):
        mesh.is_watertight()
    with raises(AttributeError, mentions=["trimesh"]):
        mesh.subdivide_loop()
    with raises(AttributeError, mentions=["positions"]):
        _ = compat.t.geometry.TriangleMesh.create_box().vertex.normals
    with raises(RuntimeError, mentions=["cpu()"]):
        compat.core.Tensor([1]).cuda()
    assert not hasattr(mesh, "_private")
