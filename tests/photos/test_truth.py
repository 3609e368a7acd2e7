"""Ground truth of photographs, read back by other programs and compared with closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pycolmap
import pytest
import raycam
from raycam.cli import main
from raycam.dataset.photographs.format import normal_steps
from support.box_table import picture, ring, table
from support.raises import raises, warns

FISHEYE = {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]}


def floor() -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": [40, 40]}, name="floor")
    return world


def floor_depth(camera: raycam.Camera) -> np.ndarray:
    """The depth [h, w] of the plane z = 0 for pinhole and OpenCV's fisheye.

    The value is inf beyond the plane's edges.
    """
    width, height = camera.size
    pixels = (
        np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 1, 2).astype(float)
    )
    if camera.model == "fisheye":
        plane = cv2.fisheye.undistortPoints(pixels, camera.K, camera.distortion)
    else:
        plane = cv2.undistortPoints(pixels, camera.K, None)
    ways = np.concatenate([plane.reshape(-1, 2), np.ones((width * height, 1))], axis=1) @ camera.R
    with np.errstate(divide="ignore"):
        depth = -camera.C[2] / ways[:, 2]
    points = camera.C + depth[:, None] * ways
    depth[(depth <= 0) | (np.abs(points[:, :2]) > 20).any(axis=1)] = np.inf
    return depth.reshape(height, width)


def photographs(count: int = 2, **lens: Any) -> dict[str, raycam.Camera]:
    return {f"left/IMG_{number:04d}.JPG": camera for number, camera in enumerate(ring(count, **lens))}


@pytest.mark.parametrize("lens", [{}, FISHEYE])
def test_depth_of_a_floor_equals_the_closed_form(tmp_path: Path, lens: dict[str, Any]) -> None:
    cameras = photographs(**lens)
    raycam.photo_truth(floor(), cameras, tmp_path, depth_scale=0.5)
    for name, camera in cameras.items():
        read = picture(tmp_path / "depth" / f"{name[:-4]}.png")
        assert read.dtype == np.uint16
        expected = np.rint(floor_depth(camera) * 2000)
        hit = expected <= 65535
        assert hit.mean() > 0.5
        # cv2.fisheye.undistortPoints iterates to 1e-8, an error of up to one depth unit for distant points.
        np.testing.assert_allclose(read[hit], expected[hit], atol=1.01)
        assert (read[~np.isfinite(expected)] == 0).all()


def test_plain_layout_contains_every_channel_under_the_photographs_name(tmp_path: Path) -> None:
    cameras = photographs()
    world = table()
    names = ["depth", "distance", "normal", "mask", "instance", "position", "valid", "confidence"]
    result = raycam.photo_truth(world, cameras, tmp_path, channels=names, depth_format="exr", normal_bits=16)
    assert result.complete
    for name, camera in cameras.items():
        frame = raycam.render(
            world, camera, samples=1, channels=["depth", "normal_camera", "instance", "position"]
        )
        place = name[:-4]
        layers = OpenEXR.File(str(tmp_path / f"depth/{place}.exr")).channels()
        depth = next(iter(layers.values())).pixels
        hit = np.isfinite(frame["depth"])
        np.testing.assert_array_equal(depth, np.where(hit, frame["depth"], 0))
        normal = picture(tmp_path / f"normal/{place}.png")[..., ::-1] / 65535 * 2 - 1
        np.testing.assert_allclose(normal[hit], frame["normal_camera"][hit], atol=1e-4)
        ways = camera.rays()[1] @ camera.R.T
        # Normals point towards the camera, in OpenCV's axes.
        assert ((normal * ways).sum(axis=-1)[hit] < 0.01).all()
        np.testing.assert_array_equal(picture(tmp_path / f"mask/{place}.png"), np.where(hit, 255, 0))
        np.testing.assert_array_equal(picture(tmp_path / f"instance/{place}.png"), frame["instance"] + 1)
        assert (picture(tmp_path / f"valid/{place}.png") == 255).all()
        planes = OpenEXR.File(str(tmp_path / f"position/{place}.exr")).channels()
        points = np.stack([planes[name].pixels for name in sorted(planes)], axis=-1)
        assert np.nanmax(np.abs(points[hit] - frame["position"][hit])) < 1e-5
        shares = json.loads((tmp_path / "error.json").read_text())["without_surface"]
        assert shares[name] == pytest.approx(1 - hit.mean(), abs=1e-6)


def test_confidence_is_the_cosine_and_zero_at_edges(tmp_path: Path) -> None:
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 48))
    world = raycam.World()
    world.add_object(plane={"size": [2, 2]})
    raycam.photo_truth(world, {"a": camera}, tmp_path, channels=["confidence", "mask"])
    read = picture(tmp_path / "confidence/a.png").astype(float)
    mask = picture(tmp_path / "mask/a.png") > 0
    ways = camera.rays()[1]
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3))) > 0
    np.testing.assert_allclose(read[inner], -ways[inner][:, 2] * 255, atol=0.51)
    edge = mask & ~(cv2.erode(mask.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))) > 0)
    assert edge.any()
    assert (read[edge] == 0).all()


@pytest.mark.parametrize("axes", ["opencv", "opengl"])
@pytest.mark.parametrize("bits", [8, 16])
def test_normals_are_rounded_to_the_nearest_step(bits: int, axes: str) -> None:
    normals = np.random.default_rng(1).normal(size=(40, 50, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    mask = np.ones((40, 50), bool)
    mask[3:7, :9] = False
    steps = normal_steps(normals, mask, bits, axes)
    assert steps.dtype == (np.uint8 if bits == 8 else np.uint16)
    exact = (normals.astype(float) * ([1, 1, 1] if axes == "opencv" else [1, -1, -1]) + 1) / 2 * (2**bits - 1)
    np.testing.assert_allclose(steps[mask], exact[mask], rtol=0, atol=0.51)
    assert (steps[~mask] == 0).all()


def test_opengl_normals_have_y_and_z_reversed(tmp_path: Path) -> None:
    cameras = photographs(1)
    for axes in ("opencv", "opengl"):
        raycam.photo_truth(
            table(), cameras, tmp_path / axes, channels=["normal", "mask"], normal_bits=16, normal_axes=axes
        )
    one, two = (
        picture(tmp_path / axes / "normal/left/IMG_0000.png")[..., ::-1] / 65535 * 2 - 1
        for axes in ("opencv", "opengl")
    )
    mask = picture(tmp_path / "opencv/mask/left/IMG_0000.png") > 0
    np.testing.assert_allclose(two[mask], one[mask] * [1, -1, -1], atol=4e-5)
    assert two[mask][:, 2].mean() > 0.3


def test_front_option_ignores_surfaces_seen_from_behind(tmp_path: Path) -> None:
    world = floor()
    # The faces point down.
    world.add_mesh([[-30, -30, 1], [-30, 30, 1], [30, 30, 1], [30, -30, 1]], [[0, 1, 2], [0, 2, 3]])
    camera = ring(1)[0]
    depths = {}
    for facing in ("both", "front"):
        raycam.photo_truth(world, {"a": camera}, tmp_path / facing, depth_format="npy", facing=facing)
        depths[facing] = np.load(tmp_path / facing / "depth/a.npy")
    expected = floor_depth(camera)
    hit = np.isfinite(expected)
    np.testing.assert_allclose(depths["front"][hit], expected[hit], rtol=1e-6)
    assert (depths["both"][hit] < 0.9 * expected[hit]).all()


def test_scannetpp_layout_contains_render_depth(tmp_path: Path) -> None:
    cameras = photographs(**FISHEYE)
    raycam.photo_truth(floor(), cameras, tmp_path, layout="scannetpp")
    for name, camera in cameras.items():
        read = picture(tmp_path / "render_depth" / f"{name[:-4]}.png")
        expected = np.rint(floor_depth(camera) * 1000)
        hit = expected <= 65535
        np.testing.assert_allclose(read[hit], expected[hit], atol=1.01)


def read_array(path: Path) -> np.ndarray:
    """COLMAP's `read_array` of scripts/python/read_write_dense.py.

    It is used because pycolmap's `NormalMap.to_array` mixes the planes.
    """
    data = path.read_bytes()
    *sizes, rest = data.split(b"&", 3)
    array = np.frombuffer(rest, np.float32).reshape([int(size) for size in sizes], order="F")
    return np.transpose(array, (1, 0, 2)).squeeze()


def test_colmap_layout_is_read_by_pycolmap_and_reprojects(tmp_path: Path) -> None:
    cameras = photographs(pixel_center="half")
    raycam.photo_truth(table(), cameras, tmp_path, layout="colmap")
    model = pycolmap.Reconstruction(str(tmp_path / "sparse"))
    by_name = {image.name: image for image in model.images.values()}
    assert set(by_name) == set(cameras)
    for name, camera in cameras.items():
        depth_map = pycolmap.DepthMap()
        depth_map.read(str(tmp_path / f"stereo/depth_maps/{name}.geometric.bin"))
        depth = depth_map.to_array()
        normal = read_array(tmp_path / f"stereo/normal_maps/{name}.geometric.bin")
        frame = raycam.render(table(), camera, samples=1, channels=["depth", "normal_camera", "position"])
        hit = np.isfinite(frame["depth"])
        np.testing.assert_array_equal(depth, np.where(hit, frame["depth"], 0))
        np.testing.assert_array_equal(normal[hit], frame["normal_camera"][hit])
        image = by_name[name]
        v, u = np.nonzero(hit)
        ways = image.camera.cam_from_img(np.stack([u + 0.5, v + 0.5], axis=1))
        local = np.concatenate([ways, np.ones((len(ways), 1))], axis=1) * depth[hit][:, None]
        points = image.cam_from_world().inverse() * local
        np.testing.assert_allclose(points, frame["position"][hit], atol=1e-5)


@pytest.mark.parametrize(
    ("layout", "depths", "cams"),
    [
        ("mvsnet", "Depths/depth_map_{:04d}.pfm", "Cameras/{:08d}_cam.txt"),
        ("blendedmvs", "rendered_depth_maps/{:08d}.pfm", "cams/{:08d}_cam.txt"),
    ],
)
def test_mvsnet_layouts_are_read_by_opencv_and_reproject(
    tmp_path: Path, layout: str, depths: str, cams: str
) -> None:
    cameras = photographs()
    raycam.photo_truth(floor(), cameras, tmp_path, layout=layout)
    assert json.loads((tmp_path / "photographs.json").read_text()) == list(cameras)
    for number, camera in enumerate(cameras.values()):
        depth = cv2.imread(str(tmp_path / depths.format(number)), cv2.IMREAD_UNCHANGED)
        expected = floor_depth(camera)
        hit = np.isfinite(expected)
        np.testing.assert_allclose(depth[hit], expected[hit], rtol=1e-5)
        assert (depth[~hit] == 0).all()
        # The camera file, as MVSNet reads it: words 1..16 are the pose, 18..26 K, then the depths.
        words = (tmp_path / cams.format(number)).read_text().split()
        pose, k = np.array(words[1:17], float).reshape(4, 4), np.array(words[18:27], float).reshape(3, 3)
        v, u = np.nonzero(hit)
        local = np.linalg.inv(k) @ np.stack([u, v, np.ones(len(u))]) * depth[hit]
        points = pose[:3, :3].T @ (local - pose[:3, 3:])
        assert np.abs(points[2]).max() < 1e-4
        nearest, step, planes, farthest = np.array(words[27:31], float)
        assert nearest == depth[hit].min()
        np.testing.assert_allclose(nearest + step * (planes - 1), farthest)
        np.testing.assert_allclose(farthest, depth.max())


def test_interrupted_job_resumes(tmp_path: Path) -> None:
    cameras = photographs(3)
    raycam.photo_truth(table(), cameras, tmp_path)
    (tmp_path / "depth/left/IMG_0001.png").unlink()
    again = raycam.photo_truth(table(), cameras, tmp_path)
    assert again.made == 1
    assert (tmp_path / "depth/left/IMG_0001.png").exists()


@pytest.mark.parametrize("layout", ["mvsnet", "colmap", "blendedmvs"])
def test_layouts_for_pinhole_cameras_raise_for_fisheye_cameras(tmp_path: Path, layout: str) -> None:
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["IMG_0000"]):
        raycam.photo_truth(table(), photographs(**FISHEYE), tmp_path, layout=layout)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    "options",
    [
        {"layout": "scannet"},
        {"channels": ["depht"]},
        {"depth_format": "tiff"},
        {"normal_bits": 12},
        {"normal_axes": "blender"},
        {"facing": "back"},
        {"depth_scale": None},
        {"layout": "mvsnet", "channels": ["normal"]},
    ],
)
def test_unknown_options_are_refused(tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(raycam.SettingsError):
        raycam.photo_truth(table(), photographs(), tmp_path, **options)
    assert not any(tmp_path.iterdir())


def test_mesh_in_millimetres_gives_a_notice_with_the_factor(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 500.0}, location=[0, 0, 30000])
    cameras = {
        f"{i}": raycam.Camera.look_at([3 * np.cos(i), 3 * np.sin(i), 30], [0, 0, 30], fov=30, size=(32, 24))
        for i in range(5)
    }
    with warns(raycam.Notice, code="misplaced_mesh", mentions=["0.001"]):
        raycam.photo_truth(world, cameras, tmp_path)


def test_two_cameras_of_one_photograph_are_refused(tmp_path: Path) -> None:
    with raises(raycam.SettingsError, code="duplicate_name", mentions=["IMG"]):
        raycam.photo_truth(
            table(),
            dict(enumerate(ring(2))),
            tmp_path,
            images={0: "IMG.png", 1: "IMG.png"},  # type: ignore[dict-item]
        )


def test_command_depth_keeps_names_of_a_colmap_model(tmp_path: Path) -> None:
    world, cameras = table(), photographs(2, **FISHEYE)
    world.to_gltf(tmp_path / "scan.glb")
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap", images={name: name for name in cameras})
    out = tmp_path / "truth"
    common = ["depth", str(tmp_path / "scan.glb"), "--cameras", str(tmp_path / "sparse")]
    assert main([*common, "-o", str(out), "--channels", "depth", "mask"]) == 0
    assert sorted(p.name for p in (out / "depth/left").iterdir()) == ["IMG_0000.png", "IMG_0001.png"]
    undistorted = tmp_path / "dense"
    options = ["--undistort", "--layout", "colmap", "--size", "32x24"]
    assert main([*common, "-o", str(undistorted), *options]) == 0
    read = pycolmap.DepthMap()
    read.read(str(undistorted / "stereo/depth_maps/left/IMG_0000.JPG.geometric.bin"))
    assert read.to_array().shape == (24, 32)
