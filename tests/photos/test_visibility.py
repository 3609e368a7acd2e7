"""Visibility of faces against brute force over all triangles, and closed forms."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
import trimesh
from raycam.cli import main
from raycam.notices import collected
from raycam.photos.face_samples import sample_pattern
from support.box_table import ring, table
from support.raises import warns

FISHEYE = {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]}


def first_hit(origin: np.ndarray, way: np.ndarray, corners: np.ndarray) -> float:
    """The smallest ray parameter over all triangles [n, 3, 3]; inf for a miss.

    The method is that of Möller and Trumbore (1997).
    """
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(way, f)
    with np.errstate(divide="ignore", invalid="ignore"):
        d = 1 / (e * p).sum(axis=1)
        s = origin - a
        u = (s * p).sum(axis=1) * d
        q = np.cross(s, e)
        v = (q @ way) * d
        t = (f * q).sum(axis=1) * d
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return float(t[hit].min(initial=np.inf))


@pytest.mark.parametrize("lens", [{}, FISHEYE])
def test_visibility_equals_brute_force(lens: dict) -> None:
    world = table()
    world.remove_object("ball")
    cameras = ring(2, **lens)
    seen = raycam.surface_visibility(world, cameras, samples=1, pairs=True)
    corners = world.triangles()
    weights = sample_pattern(1, corners=False)[0]
    points = np.einsum("k,nkj->nj", weights, corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    matrix = np.zeros((len(corners), 2), bool)
    for number, camera in enumerate(cameras):
        local = (points - camera.C) @ camera.R.T
        if lens:
            pixels = cv2.fisheye.projectPoints(
                points[None], cv2.Rodrigues(camera.R)[0], camera.t, camera.K, camera.distortion
            )[0][0]
        else:
            pixels = (local / local[:, 2:]) @ camera.K.T
        inside = (local[:, 2] > 0) & (pixels[:, :2] >= -0.5).all(axis=1)
        inside &= (pixels[:, :2] < np.array(camera.size) - 0.5).all(axis=1)
        faces = ((camera.C - points) * normals).sum(axis=1) > 0
        for i in np.flatnonzero(inside & faces):
            way = points[i] - camera.C
            matrix[i, number] = first_hit(camera.C, way, corners) > 1 - 1e-9
    assert 0.1 < matrix.mean() < 0.5
    np.testing.assert_array_equal(seen.views, matrix.sum(axis=1))
    np.testing.assert_array_equal(seen.faces_seen, matrix.sum(axis=0))
    assert seen.pairs is not None
    rows = np.repeat(np.arange(len(corners)), np.diff(seen.pairs.offsets))
    found = np.zeros_like(matrix)
    found[rows, seen.pairs.camera] = True
    np.testing.assert_array_equal(found, matrix)


def test_tiny_face_in_the_foreground_is_visible() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [4, 4]})
    tiny = np.array([[0, 0, 1], [1e-5, 0, 1], [0, 1e-5, 1]])  # the triangle covers 1/3000 of a pixel
    world.add_mesh(tiny, [[0, 1, 2]])
    camera = raycam.Camera.look_at([0.3, 0.2, 3], [0, 0, 0], up=[0, 1, 0], fov=60, size=(100, 80))
    seen = raycam.surface_visibility(world, [camera])
    assert (seen.views == 1).all()
    assert seen.fraction[-1] == 1


def test_resolution_and_angle_equal_the_closed_form() -> None:
    world = raycam.World()
    world.add_mesh([[-0.001, -0.001, 0], [0.001, -0.001, 0], [0, 0.002, 0]], [[0, 1, 2]])
    for angle in (0, 30, 60):
        a = np.radians(angle)
        camera = raycam.Camera.look_at(
            [2 * np.sin(a), 0, 2 * np.cos(a)], [0, 0, 0], up=[0, 1, 0], fov=40, size=(200, 200)
        )
        seen = raycam.surface_visibility(world, {"a": camera}, samples=1)
        # At distance d, a small patch appears scaled by f / d across the slope, and also by the cosine along the slope.
        assert seen.best_resolution[0] == pytest.approx(camera.K[0, 0] / 2 * np.cos(a), rel=2e-3)
        assert seen.angle[0] == pytest.approx(angle, abs=0.1)


def test_half_hidden_square_has_the_fraction_of_its_area() -> None:
    world = raycam.World()
    world.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    # A lid hides x < 0.4 from a distant camera straight above: 1 - 0.6² of the triangle.
    world.add_mesh([[-5, -5, 1], [0.4, -5, 1], [0.4, 5, 1], [-5, 5, 1]], [[0, 1, 2], [0, 2, 3]])
    camera = raycam.Camera.look_at([0.4, 0.3, 1000], [0.4, 0.3, 0], up=[0, 1, 0], fov=0.2, size=(600, 600))
    seen = raycam.surface_visibility(world, [camera])
    assert seen.fraction[0] == pytest.approx(0.36, abs=0.02)


def test_rolling_shutter_visibility_uses_the_position_of_each_line() -> None:
    world = raycam.World()
    world.add_mesh([[-0.01, -1.6, 0], [0.01, -1.6, 0], [0, -1.58, 0]], [[0, 1, 2]])
    world.add_mesh([[-0.7, -2, 1], [0.7, -2, 1], [0.7, 2, 1], [-0.7, 2, 1]], [[0, 1, 2], [0, 2, 3]])
    start, end = (
        raycam.Camera.look_at([x, 0, 2], [x, 0, 0], up=[0, 1, 0], fov=100, size=(64, 64)) for x in (0, 2.2)
    )
    # The face is in the lower part of the image, which is read when the camera is at about x = 1.85. From there, the
    # face is visible past the lid; from the middle of the motion, x = 1.1, the lid hides the face.
    rolling = start.moving(end, readout=0.03)
    assert raycam.surface_visibility(world, [rolling.still()]).views[0] == 0
    assert raycam.surface_visibility(world, [rolling]).views[0] == 1
    upwards = start.moving(end, readout=0.03, direction="up")
    assert raycam.surface_visibility(world, [upwards]).views[0] == 0


def test_inside_out_mesh_counts_both_sides_with_a_notice() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    world = raycam.World()
    world.add_mesh(ball.vertices, ball.faces[:, ::-1])
    cameras = [raycam.Camera.look_at([3, 0, 0], [0, 0, 0], fov=50, size=(64, 64))]
    with warns(raycam.Notice, code="inside_out_mesh"):
        seen = raycam.surface_visibility(world, cameras)
    assert seen.facing == "both"
    assert 0.2 < (seen.views > 0).mean() < 0.5
    assert (raycam.surface_visibility(world, cameras, facing="front").views > 0).mean() < 0.2


def test_mesh_in_millimetres_around_the_cameras_is_misplaced_instead_of_inside_out() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    world = raycam.World()
    world.add_mesh(ball.vertices * 1000, ball.faces)
    with collected() as notices:
        seen = raycam.surface_visibility(world, ring(6))
    assert [notice.code for notice in notices] == ["misplaced_mesh"]
    assert seen.facing == "front"
    assert not seen.views.any()


def test_command_visible_prints_notices_and_the_share_without_an_output_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.invert()
    ball.export(tmp_path / "scan.ply")
    cameras = {str(i): camera for i, camera in enumerate(ring(6))}
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap")
    assert main(["visible", str(tmp_path / "scan.ply"), "--cameras", str(tmp_path / "sparse")]) == 0
    printed = capsys.readouterr()
    assert "faces are visible" in printed.out
    assert "inside out" in printed.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scan.ply", "sparse"]


def test_world_without_faces_is_refused() -> None:
    with pytest.raises(raycam.WorldError):
        raycam.surface_visibility(raycam.World(), ring(1))


def test_visibility_does_not_depend_on_threads_or_camera_order() -> None:
    world, cameras = table(), ring(3)
    one = raycam.surface_visibility(world, cameras, threads=1)
    two = raycam.surface_visibility(world, cameras[::-1], threads=2)
    for name in ("views", "fraction", "best_resolution", "angle"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_culled_object_keeps_positions_texture_coordinates_and_material() -> None:
    world = raycam.data.spot()
    keep = world.triangles(0).mean(axis=1)[:, 2] > 0.7
    culled = world.cull_faces(0, keep)
    np.testing.assert_allclose(culled.triangles(0), world.triangles(0)[keep], atol=1e-12)
    camera = world.default_camera().resized((160, 100))
    frames = [
        raycam.render(each, camera, samples=1, channels=["uv", "albedo", "position", "instance"])
        for each in (world, culled)
    ]
    same = (frames[0]["instance"] == 0) & (frames[1]["instance"] == 0)
    same &= np.abs(frames[0]["position"] - frames[1]["position"]).max(axis=-1) < 1e-9
    assert same.sum() > 1000
    np.testing.assert_allclose(frames[0]["uv"][same], frames[1]["uv"][same], atol=1e-6)
    np.testing.assert_allclose(frames[0]["albedo"][same], frames[1]["albedo"][same], atol=1e-5)


@pytest.mark.parametrize("keep", [np.ones(3, bool), np.ones(93696), np.zeros(93696, bool)])
def test_invalid_masks_are_refused(keep: np.ndarray) -> None:
    with pytest.raises(raycam.WorldError):
        raycam.data.spot().cull_faces(0, keep)


def test_command_visible_writes_culled_faces_and_a_heat_map(tmp_path: Path) -> None:
    world, cameras = table(), {f"IMG_{i}.jpg": camera for i, camera in enumerate(ring(2))}
    world.to_gltf(tmp_path / "scan.glb")
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap")
    common = ["visible", str(tmp_path / "scan.glb"), "--cameras", str(tmp_path / "sparse")]
    assert (
        main([*common, "--cull", "-o", str(tmp_path / "seen.ply"), "--heat", str(tmp_path / "heat.png")]) == 0
    )
    assert main([*common, "--cull", "-o", str(tmp_path / "seen.glb")]) == 0
    assert main([*common, "-o", str(tmp_path / "seen.npz")]) == 0
    arrays = np.load(tmp_path / "seen.npz")
    count = int((arrays["views"] > 0).sum())
    mesh = trimesh.load(tmp_path / "seen.ply", process=False)
    assert len(mesh.faces) == count < len(arrays["views"])
    np.testing.assert_array_equal(
        mesh.metadata["_ply_raw"]["face"]["data"]["views"].reshape(-1), arrays["views"][arrays["views"] > 0]
    )
    assert raycam.load(tmp_path / "seen.glb").counts["triangles"] == count
    assert cv2.imread(str(tmp_path / "heat.png")).std() > 10
    assert main([*common, "-o", str(tmp_path / "seen.obj")]) == 2
