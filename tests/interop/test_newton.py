"""Newton models: a recorded one, and real ones if the package `newton` is installed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.interop.newton import NewtonScene
from support.raises import notice_codes, raises

HALF = float(np.sqrt(0.5))


def model() -> Any:
    """The arrays that Newton 1.8 has for a body with four shapes at (0, 0, 1).

    The shapes are a box, a rotated capsule, a cone and a mesh. The model also has a ground plane, a site, and
    a shape that only collides.
    """
    tetrahedron = SimpleNamespace(
        vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32),
        indices=np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.int32),
    )
    still = [0, 0, 0, 0, 0, 0, 1]
    return SimpleNamespace(
        up_axis=2,
        shape_type=np.array([7, 4, 9, 8, 1, 3, 3], np.int32),
        shape_scale=np.array(
            [[0.1, 0.2, 0.3], [0.1, 0.2, 0], [0.1, 0.2, 0], [2, 1, 1], [0, 0, 0], [1, 0, 0], [1, 0, 0]],
            np.float32,
        ),
        shape_transform=np.array(
            [
                still,
                [0, 0, 1, HALF, 0, 0, HALF],
                [1, 0, 0, 0, 0, 0, 1],
                [2, 0, 0, 0, 0, 0, 1],
                still,
                still,
                still,
            ],
            np.float32,
        ),
        shape_body=np.array([0, 0, 0, 0, -1, 0, 0], np.int32),
        shape_flags=np.array([7, 7, 1, 1, 7, 9, 6], np.int32),
        shape_color=np.tile(np.array([[0.5, 0, 1]], np.float32), (7, 1)),
        shape_opacity=np.array([1, 0.5, 1, 1, 1, 1, 1], np.float32),
        shape_source=[None, None, None, tetrahedron, None, None, None],
        shape_label=["box", "capsule", "cone", "mesh", "ground", "site", "hull"],
        body_label=["arm"],
        body_q=np.array([[0, 0, 1, 0, 0, 0, 1]], np.float32),
        particle_count=0,
        tri_count=0,
    )


def corners(scene: NewtonScene, name: str) -> Any:
    number = [item.name for item in scene.world.objects].index(name)
    return scene.world.triangles(number).reshape(-1, 3)


def test_visible_shapes_become_objects_at_their_poses() -> None:
    scene = raycam.from_newton(model())
    objects = scene.world.objects
    assert [item.name for item in objects] == ["box", "capsule", "cone", "mesh", "ground"]
    assert [item.category for item in objects] == ["arm"] * 4 + [None]
    for name, low, high in (
        ("box", [-0.1, -0.2, 0.7], [0.1, 0.2, 1.3]),
        ("capsule", [-0.1, -0.3, 1.9], [0.1, 0.3, 2.1]),  # turned about x, so its length is along y
        ("cone", [0.9, -0.1, 0.8], [1.1, 0.1, 1.2]),
        ("mesh", [2, 0, 1], [4, 1, 2]),
        ("ground", [-500, -500, 0], [500, 500, 0]),
    ):
        found = corners(scene, name)
        np.testing.assert_allclose([found.min(axis=0), found.max(axis=0)], [low, high], atol=2e-3)
    apex = corners(scene, "cone")
    np.testing.assert_allclose(apex[apex[:, 2].argmax()], [1, 0, 1.2], atol=1e-6)


def test_update_moves_objects_without_new_meshes() -> None:
    scene = raycam.from_newton(model())
    before = scene.world.counts
    scene.update(SimpleNamespace(body_q=np.array([[5, 0, 0, 0, 0, HALF, HALF]], np.float32)))
    box = corners(scene, "box")  # turned about z: x and y are exchanged
    np.testing.assert_allclose(
        [box.min(axis=0), box.max(axis=0)], [[4.8, -0.1, -0.3], [5.2, 0.1, 0.3]], atol=1e-6
    )
    assert scene.world.counts == before
    assert np.array_equal(corners(scene, "ground").max(axis=0), [500, 500, 0])


def test_omitted_parts_give_notices() -> None:
    given = model()
    given.shape_type[2], given.particle_count = 11, 8
    with pytest.warns(raycam.Notice):
        scene = raycam.from_newton(given)
    assert notice_codes(scene.notices) == ["ignored_element", "ignored_element"]
    assert "cone" not in [item.name for item in scene.world.objects]


def test_wrong_objects_and_states_are_refused() -> None:
    with raises(raycam.WorldError, code="wrong_type", mentions=["dict"]):
        raycam.from_newton({})
    with raises(raycam.WorldError, code="wrong_type", mentions=["list"]):
        raycam.from_newton(model(), [])
    with raises(raycam.WorldError, code="wrong_shape", mentions=["0 bodies"]):
        raycam.from_newton(model(), SimpleNamespace(body_q=np.zeros((0, 7))))
    with raises(raycam.WorldError, code="out_of_range"):
        raycam.from_newton(model(), SimpleNamespace(body_q=np.full((1, 7), np.nan)))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_depth_and_ids_equal_newtons_own_rays() -> None:
    newton = pytest.importorskip("newton")
    warp = pytest.importorskip("warp")
    warp.config.quiet = True
    builder = newton.ModelBuilder()
    turned = warp.transform((0.0, 0.0, 1.0), warp.quat(0.1, 0.1, 0.7, 0.7))
    body = builder.add_body(xform=turned, label="body")
    at = lambda x, y: warp.transform((x, y, 0.1), warp.quat(0.1, 0.3, 0.3, 0.9))  # noqa: E731
    builder.add_shape_box(body, xform=at(0.0, 0.0), hx=0.1, hy=0.2, hz=0.3)
    builder.add_shape_sphere(body, xform=at(0.8, 0.0), radius=0.2)
    builder.add_shape_capsule(body, xform=at(-0.8, 0.0), radius=0.1, half_height=0.2)
    builder.add_shape_cylinder(body, xform=at(0.0, 0.8), radius=0.1, half_height=0.2)
    builder.add_shape_cone(body, xform=at(-0.4, -0.5), radius=0.2, half_height=0.2)
    builder.add_shape_ellipsoid(body, xform=at(0.8, 0.8), rx=0.1, ry=0.2, rz=0.3)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    mesh = newton.Mesh(corners, np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.int32))
    builder.add_shape_mesh(body, xform=at(-0.8, 0.8), mesh=mesh, scale=(0.3, 0.5, 0.4))
    heights = np.arange(12, dtype=np.float32).reshape(3, 4) ** 2 / 400
    builder.add_shape_heightfield(heightfield=newton.Heightfield(heights, 3, 4, 0.5, 0.3), xform=at(2.0, 0.0))
    builder.add_ground_plane()
    real = builder.finalize(device="cpu")
    state = real.state()
    sensor = newton.sensors.SensorTiledCamera(real)
    size = (96, 72)
    rays = sensor.utils.compute_camera_rays_pinhole(*size, camera_fovs=0.9)
    outputs = {
        "depth_image": sensor.utils.create_depth_image_output(*size),
        "shape_index_image": sensor.utils.create_shape_index_image_output(*size),
    }
    eye, target = np.array([2.2, -2.2, 2.6]), np.array([0.4, 0.1, 0.9])
    camera = raycam.Camera.look_at(eye, target, fov=40, size=size)
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(camera.R.T @ np.diag([1.0, -1, -1])).as_quat()
    pose = warp.array([[warp.transformf(warp.vec3f(*eye), warp.quatf(x, y, z, w))]], dtype=warp.transformf)
    sensor.update(state, pose, rays, **outputs)
    depth = outputs["depth_image"].numpy().reshape(size[1], size[0])
    ids = outputs["shape_index_image"].numpy().reshape(size[1], size[0]).astype(np.int64)
    scene = raycam.from_newton(real, state)
    directions = (
        rays.numpy().reshape(size[1], size[0], 2, 3)[:, :, 1] @ (camera.R.T @ np.diag([1.0, -1, -1])).T
    )
    hits = scene.world.cast_rays(eye, directions, fields=("instance", "distance"))
    shapes = np.append(scene.shapes, -1)[hits["instance"]]
    same = shapes == np.where(depth < 0, -1, ids)
    # Pixels at edges may differ, because raycam converts round shapes to triangle meshes.
    assert same.mean() > 0.99
    assert set(ids[depth >= 0]) == set(range(9))
    near = same & (depth >= 0)
    difference = abs(hits["distance"][near] - depth[near])
    assert np.quantile(difference, 0.99) < 1e-3
    flat = near & np.isin(ids, [0, 6, 7, 8])
    np.testing.assert_allclose(hits["distance"][flat], depth[flat], atol=1e-4)
