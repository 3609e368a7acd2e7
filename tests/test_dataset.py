"""Data sets read back by the libraries that people read them with."""

from __future__ import annotations

import json
import tarfile
import tracemalloc
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pycolmap
import pytest
import raycam
import raycam.cli
import raycam.dataset
from bending_plate import FACES, bending_plate, plate_at
from box_table import SIZE, picture, ring, table, truth
from PIL import Image
from pycocotools.coco import COCO
from raycam.dataset import FORMATS, views, write
from raycam.jobs import Job

NERF_LENS = ("k1", "k2", "k3", "k4", "p1", "p2")


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # of pycocotools
@pytest.mark.parametrize("segmentation", ["rle", "polygon"])
def test_coco(tmp_path: Path, segmentation: str) -> None:
    cameras = ring(distortion=[-0.2, 0.05, 0.001, 0.0])
    corner = [[0.3, 0.2, 0.25], [-0.3, -0.2, -0.25]]
    keypoints = {"box": {"names": ["top", "bottom"], "points": corner, "skeleton": [[1, 2]]}}
    write(table(), tmp_path, "coco", cameras=cameras, segmentation=segmentation, keypoints=keypoints)
    coco = COCO(str(tmp_path / "annotations" / "instances.json"))
    assert {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())} == {1: "box", 2: "ball", 9: "9"}
    assert coco.loadCats(1)[0]["keypoints"] == ["top", "bottom"]
    names = {item.name: item.id for item in table().objects}
    for number, camera in enumerate(cameras):
        image = coco.loadImgs(number + 1)[0]
        with Image.open(tmp_path / "images" / image["file_name"]) as file:
            assert file.size == SIZE == (image["width"], image["height"])
        instance = truth(camera)
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=number + 1))
        assert {names[a["object"]] for a in annotations} == set(np.unique(instance)) - {-1, 0}
        for one in annotations:
            mask = instance == names[one["object"]]
            np.testing.assert_array_equal(coco.annToMask(one), mask)
            assert one["area"] == mask.sum()
            rows, columns = np.nonzero(mask)
            box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
            assert one["bbox"] == box
            if one["category_id"] == 1:
                matrix = table().objects[names[one["object"]]].matrix
                pixels, _ = camera.project(corner @ matrix[:3, :3].T + matrix[:3, 3])
                points = np.reshape(one["keypoints"], (2, 3))
                inside = points[:, 2] > 0
                np.testing.assert_allclose(points[inside, :2], pixels[inside] + 0.5)
                assert one["num_keypoints"] == inside.sum()
    ids = coco.getAnnIds()
    assert sorted(ids) == list(range(1, len(ids) + 1))


def test_coco_keypoints_follow_what_bends_before_a_rolling_shutter(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    camera = raycam.Camera.look_at([1, 2, 6], [0.3, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    rolling = camera.exposing(0.01, readout=0.3)
    weights, triangles = [[0.2, 0.3, 0.5], [0.6, 0.3, 0.1]], [0, 3]
    points = {"names": ["low", "high"], "points": weights, "triangles": triangles}
    given = {"cameras": [rolling], "times": [0.5], "samples": 1}
    write(world, tmp_path / "set", "coco", **given, keypoints={"object": points})
    (one,) = json.loads((tmp_path / "set/annotations/instances.json").read_text())["annotations"]
    found = np.reshape(one["keypoints"], (2, 3))
    seen = raycam.keypoints(world.at(0.5), rolling, weights, [0, 0], triangles=triangles)
    np.testing.assert_allclose(found[:, :2], seen.pixels + 0.5)
    corners = plate_at(0.5)[FACES[triangles]]
    still = camera.project(np.einsum("nk,nkj->nj", weights, corners))[0]
    assert np.abs(seen.pixels - still).max() > 0.3
    with pytest.raises(raycam.SettingsError, match="one of triangles for each of the names"):
        write(world, tmp_path / "no", "coco", **given, keypoints={"object": points | {"triangles": [0]}})


def test_a_world_without_categories_is_all_objects(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.5})
    write(world, tmp_path, cameras=[raycam.Camera.look_at([2, 0, 0], [0, 0, 0], size=SIZE)])
    coco = COCO(str(tmp_path / "annotations" / "instances.json"))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["object"]
    assert len(coco.getAnnIds()) == 1


def test_bop(tmp_path: Path) -> None:
    cameras = ring(pixel_center="half")
    write(table(), tmp_path, "bop", cameras=cameras)
    scene = tmp_path / "train_pbr" / "000000"
    rows = {
        name: json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info")
    }
    information = json.loads((tmp_path / "models" / "models_info.json").read_text())
    assert information["1"]["diameter"] == pytest.approx(1000 * np.linalg.norm([0.6, 0.4, 0.5]))
    assert information["2"]["diameter"] == pytest.approx(600, rel=0.02)
    assert information["1"]["size_x"] == pytest.approx(600)
    assert set(information) == {"1", "2", "3"}
    import trimesh

    model = trimesh.load(tmp_path / "models" / "obj_000001.ply", process=False)
    np.testing.assert_allclose(np.ptp(model.vertices, axis=0), [600, 400, 500], rtol=1e-6)
    for number, camera in enumerate(cameras):
        row = rows["camera"][str(number)]
        K, R, t = (
            np.reshape(row[key], shape)
            for key, shape in (("cam_K", (3, 3)), ("cam_R_w2c", (3, 3)), ("cam_t_w2c", 3))
        )
        np.testing.assert_allclose(K, camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        depth = picture(scene / "depth" / f"{number:06d}.png")
        assert depth.dtype == np.uint16
        expected = truth(camera, "depth") * 1000
        seen = np.isfinite(expected)
        assert np.abs(depth[seen] * row["depth_scale"] - expected[seen]).max() <= 0.0501
        assert (depth[~seen] == 0).all()
        instance = truth(camera)
        labels = {item.object: item for item in raycam.label(table(), camera)}
        order = [n for n in (1, 2, 3, 4) if n in labels]
        assert [g["obj_id"] for g in rows["gt"][str(number)]] == [{1: 1, 2: 1, 3: 2, 4: 3}[n] for n in order]
        for place, (n, pose, info) in enumerate(
            zip(order, rows["gt"][str(number)], rows["gt_info"][str(number)], strict=True)
        ):
            visible = picture(scene / "mask_visib" / f"{number:06d}_{place:06d}.png") > 0
            np.testing.assert_array_equal(visible, instance == n)
            amodal = picture(scene / "mask" / f"{number:06d}_{place:06d}.png") > 0
            assert (amodal & visible == visible).all()
            assert info["px_count_visib"] == visible.sum()
            assert info["px_count_all"] >= amodal.sum() >= info["px_count_valid"] >= visible.sum()
            assert info["visib_fract"] == info["px_count_visib"] / info["px_count_all"]
            # As calc_2d_bbox of the toolkit has it: from the first pixel's coordinate to the last one's.
            rows_of, columns_of = np.nonzero(visible)
            low, size = [columns_of.min(), rows_of.min()], [np.ptp(columns_of), np.ptp(rows_of)]
            assert info["bbox_visib"] == [*low, *size]
            x, y, width, height = info["bbox_obj"]
            assert labels[n].amodal_box == (x, y, width + 1, height + 1)
            # The model in its pose is the object in the world, seen by the camera.
            to_camera = np.reshape(pose["cam_R_m2c"], (3, 3)), np.array(pose["cam_t_m2c"])
            model = trimesh.load(tmp_path / "models" / f"obj_{pose['obj_id']:06d}.ply", process=False)
            placed = model.vertices @ to_camera[0].T + to_camera[1]
            ids = table().triangle_ids()[:, 0]
            corners = table().triangles()[ids == n].reshape(-1, 3) * 1000 @ R.T + t
            np.testing.assert_allclose(placed.min(axis=0), corners.min(axis=0), atol=1e-2)
            np.testing.assert_allclose(placed.max(axis=0), corners.max(axis=0), atol=1e-2)
            assert np.linalg.det(to_camera[0]) == pytest.approx(1)


def test_kitti(tmp_path: Path) -> None:
    level = [
        raycam.Camera.look_at([3 * np.cos(a), 3 * np.sin(a), 0.4], [0, 0, 0.4], size=SIZE, fov=40)
        for a in (0.1, 0.2)
    ]
    write(table(), tmp_path, "kitti", cameras=level, times=[0.0, 0.5], baseline=0.2, flow=True)
    base = tmp_path / "object" / "training"
    world = table()
    for number, camera in enumerate(level):
        name = f"{number:06d}"
        now = world.at(0.5 * number)
        depth = picture(base / "depth_2" / f"{name}.png")
        expected = truth(camera, "depth", now)
        seen = np.isfinite(expected)
        assert np.abs(depth[seen] / 256 - expected[seen]).max() <= 0.5 / 256 + 1e-6
        rows = (base / "calib" / f"{name}.txt").read_text().split("\n")
        calib = {row.split(":")[0]: np.array(row.split(":")[1].split(), float) for row in rows if row}
        P2 = calib["P2"].reshape(3, 4)
        np.testing.assert_allclose(P2[:, :3], camera.K)
        lines = [row.split() for row in (base / "label_2" / f"{name}.txt").read_text().splitlines()]
        instance = truth(camera, world=now)
        assert len(lines) == len(set(np.unique(instance)) - {-1, 0})
        for row in lines:
            assert row[0] in ("box", "ball", "9")
            truncated, occluded, alpha, left, top, right, bottom, h, w, length, x, y, z, ry = map(
                float, row[1:]
            )
            assert 0 <= truncated <= 1
            assert occluded in (0, 1, 2)
            assert alpha == pytest.approx((ry - np.arctan2(x, z) + np.pi) % (2 * np.pi) - np.pi, abs=1e-5)
            # The box as KITTI's development kit draws it: computeBox3D.m.
            turn = np.array([[np.cos(ry), 0, np.sin(ry)], [0, 1, 0], [-np.sin(ry), 0, np.cos(ry)]])
            corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-1, 0) for k in (-0.5, 0.5)]) * [
                length,
                h,
                w,
            ]
            pixels = (corners @ turn.T + [x, y, z]) @ P2[:, :3].T
            pixels = pixels[:, :2] / pixels[:, 2:]
            assert pixels[:, 0].min() <= left + 0.5
            assert pixels[:, 0].max() >= right - 0.5
            assert pixels[:, 1].min() <= top + 0.5
            assert pixels[:, 1].max() >= bottom - 0.5
            if row[0] == "box":
                np.testing.assert_allclose(sorted([h, w, length]), [0.4, 0.5, 0.6], atol=1e-5)
                assert length == pytest.approx(0.6, abs=1e-5)
    base = tmp_path / "scene_flow" / "training"
    found = raycam.flow(world.at(0), level[0], world.at(0.5), level[1])
    for kind, wanted in (("occ", True), ("noc", ~found["occluded"] & ~found["outside"])):
        stored = picture(base / f"flow_{kind}" / "000000_10.png")[..., ::-1].astype(float)
        valid = stored[..., 2] > 0
        np.testing.assert_array_equal(valid, np.isfinite(found["flow"][..., 0]) & wanted)
        assert np.abs((stored[valid, :2] - 2**15) / 64 - found["flow"][valid]).max() <= 0.5 / 64 + 1e-5
    depth = truth(level[0], "depth", world.at(0))
    disparity = picture(base / "disp_occ_0" / "000000_10.png") / 256
    seen = np.isfinite(depth)
    assert np.abs(disparity[seen] - level[0].K[0, 0] * 0.2 / depth[seen]).max() < 0.5 / 256 + 1e-4
    assert (picture(base / "disp_noc_0" / "000000_10.png") > 0).sum() < (disparity > 0).sum()
    assert (base / "image_2" / "000000_11.png").exists()
    assert not (base / "image_2" / "000001_11.png").exists()
    poses = np.loadtxt(tmp_path / "poses.txt").reshape(-1, 3, 4)
    np.testing.assert_allclose(poses[1][:, 3], level[1].C)


def test_kitti_right_camera_is_the_left_one_elsewhere(tmp_path: Path) -> None:
    (camera,) = ring(1)
    dark = camera.with_vignetting(polynomial=[-3.0])
    write(table(), tmp_path, "kitti", cameras=[dark], baseline=0.2, samples=4)
    right = dark.at_pose(dark.R, dark.C + 0.2 * dark.R[0])
    expected = raycam.render(table(), right, samples=4, frame=0).to_png()
    assert (tmp_path / "object" / "training" / "image_3" / "000000.png").read_bytes() == expected
    with pytest.raises(raycam.CameraError, match="because of a shutter"):
        write(table(), tmp_path / "no", "kitti", cameras=[camera.exposing(0.01)], baseline=0.2)
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize(
    ("options", "model"),
    [
        ({}, "PINHOLE"),
        ({"distortion": [-0.1, 0.02, 0.001, 0.002]}, "OPENCV"),
        ({"distortion": [-0.1, 0.02, 0.001, 0.002, 0.01, 0.1, 0.02, 0.003]}, "FULL_OPENCV"),
        ({"distortion": [0.01, 0.002, 0, 0], "model": "fisheye"}, "OPENCV_FISHEYE"),
        ({"distortion": [0.4], "model": "fov"}, "FOV"),
        ({"distortion": [-0.05], "model": "division"}, "DIVISION"),
        ({"distortion": [0.6, 1.1], "model": "eucm"}, "EUCM"),
        (
            {"distortion": [0.01, 0.002, 1e-3, 0, 1e-3, 0, 1e-3, -1e-3], "model": "thin_prism_fisheye"},
            "THIN_PRISM_FISHEYE",
        ),
    ],
)
def test_colmap(tmp_path: Path, options: dict[str, Any], model: str) -> None:
    cameras = ring(3, **options)
    write(table(), tmp_path, "colmap", cameras=cameras, points=300)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert len(read.cameras) == 1
    assert read.cameras[1].model.name == model
    assert read.num_reg_images() == 3
    assert 250 < read.num_points3D() <= 300
    assert read.compute_mean_track_length() > 1
    for number, image in read.images.items():
        assert image.name == f"{number - 1:06d}.png"
        assert (tmp_path / "images" / image.name).exists()
        for point in image.points2D:
            where = read.points3D[point.point3D_id].xyz
            seen = image.project_point(where)
            assert seen is not None
            assert np.abs(seen - point.xy).max() < 1e-6
            pixel, _ = cameras[number - 1].project(where)
            np.testing.assert_allclose(point.xy, pixel + 0.5, atol=1e-9)


def test_colmap_observes_nothing_behind_the_plane_of_a_wide_lens(tmp_path: Path) -> None:
    """COLMAP has no image of that, though the lens has one."""
    k = [[20, 0, 31.5], [0, 20, 23.5], [0, 0, 1]]
    cameras = [
        raycam.Camera(k, camera.R, camera.C, SIZE, distortion=[0.0, 0, 0, 0], model="fisheye")
        for camera in (raycam.Camera.look_at([0, y, 0.5], [3, y, 1.5], size=SIZE, fov=40) for y in (0, 0.3))
    ]
    wide = [(truth(camera, "depth") < 0).sum() for camera in cameras]
    assert min(wide) > 50
    write(table(), tmp_path, "colmap", cameras=cameras, points=1000, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert read.num_points3D() == 1000
    for image in read.images.values():
        assert len(image.points2D) > 300
        for point in image.points2D:
            seen = image.project_point(read.points3D[point.point3D_id].xyz)
            assert seen is not None
            assert np.abs(seen - point.xy).max() < 1e-6


def test_colmap_has_as_many_points_as_asked_for(tmp_path: Path) -> None:
    """However many views share them; every observation is in the picture's line and in the point's."""
    write(table(), tmp_path, "colmap", cameras=ring(7), points=1500, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert read.num_points3D() == 1500
    observed = {
        (image, place, point.point3D_id)
        for image, entry in read.images.items()
        for place, point in enumerate(entry.points2D)
    }
    told = {
        (element.image_id, element.point2D_idx, number)
        for number, point in read.points3D.items()
        for element in point.track.elements
    }
    assert observed == told
    assert len(told) > 2 * 1500
    skewed = raycam.Camera([[90, 1, 40], [0, 90, 30], [0, 0, 1]], np.eye(3), [0, 0, 0], SIZE)
    with pytest.raises(raycam.CameraError, match="camera 1: COLMAP has no camera model with skew"):
        write(table(), tmp_path / "skew", "colmap", cameras=[*ring(1), skewed])


def test_colmap_observes_no_points_of_what_has_moved_away(tmp_path: Path) -> None:
    cameras, times = ring(4), [0.0, 0.25, 0.5, 0.75]
    write(table(), tmp_path, "colmap", cameras=cameras, times=times, points=800, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    gone = 0
    for number, camera in enumerate(cameras):
        world = table().at(times[number])
        image = read.images[number + 1]
        ids = [point.point3D_id for point in image.points2D]
        points = np.array([read.points3D[i].xyz for i in ids])
        np.testing.assert_allclose(world.cast_rays(camera.C, points - camera.C)["t"], 1.0, rtol=2e-4)
        others = np.array([point.xyz for i, point in read.points3D.items() if i not in set(ids)])
        gone += (world.cast_rays(camera.C, others - camera.C)["t"] > 1.01).sum()
    assert gone > 10
    assert read.compute_mean_track_length() > 1.5


def test_nerf(tmp_path: Path) -> None:
    cameras = ring()
    write(table(), tmp_path, "nerf", cameras=cameras)
    meta = json.loads((tmp_path / "transforms.json").read_text())
    assert meta["camera_model"] == "PINHOLE"
    assert len(meta["frames"]) == 4
    K = [[meta["fl_x"], 0, meta["cx"]], [0, meta["fl_y"], meta["cy"]], [0, 0, 1]]
    assert meta["camera_angle_x"] == pytest.approx(2 * np.arctan(meta["w"] / (2 * meta["fl_x"])))
    for camera, row in zip(cameras, meta["frames"], strict=True):
        again = raycam.Camera.from_opengl(
            K, row["transform_matrix"], (meta["w"], meta["h"]), pixel_center="half"
        )
        points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
        np.testing.assert_allclose(again.project(points)[0] - 0.5, camera.project(points)[0], atol=1e-9)
        depth = picture(tmp_path / row["depth_file_path"])
        expected = truth(camera, "depth")
        seen = np.isfinite(expected)
        assert np.abs(depth[seen] * 1e-3 - expected[seen]).max() < 0.51e-3
    mixed = [*ring(1, fov=50), *ring(1)]
    write(table(), tmp_path / "mixed", "nerf", cameras=mixed)
    meta = json.loads((tmp_path / "mixed" / "transforms.json").read_text())
    assert "fl_x" not in meta
    assert [row["fl_x"] for row in meta["frames"]] == [camera.K[0, 0] for camera in mixed]


@pytest.mark.parametrize(
    ("model", "lens"),
    [
        ("opencv", [-0.2, 0.05, 1e-3, 2e-3, 0.01]),
        ("opencv", [-0.2, 0.05, 1e-3, 2e-3]),
        ("fisheye", [0.02, 1e-3, 0, 0]),
    ],
)
def test_nerf_lenses_by_their_names(tmp_path: Path, model: Any, lens: list[float]) -> None:
    cameras = ring(2, distortion=lens, model=model)
    write(table(), tmp_path, "nerf", cameras=cameras)
    meta = json.loads((tmp_path / "transforms.json").read_text())
    # As nerfstudio reads them: its two names of lenses, k1 to k4, p1 and p2, with 0 for those that are missing.
    assert meta["camera_model"] == {"opencv": "OPENCV", "fisheye": "OPENCV_FISHEYE"}[model]
    assert meta.keys() <= {"camera_model", "fl_x", "fl_y", "cx", "cy", "w", "h", "frames", *NERF_LENS}
    k1, k2, k3, k4, p1, p2 = (meta.get(name, 0.0) for name in NERF_LENS)
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (50, 3)) + np.array([0, 0, 1.5])
    K = np.array([[meta["fl_x"], 0, meta["cx"] - 0.5], [0, meta["fl_y"], meta["cy"] - 0.5], [0, 0, 1]])
    if model == "fisheye":
        pixels = cv2.fisheye.projectPoints(
            points[:, None], np.zeros(3), np.zeros(3), K, np.array([k1, k2, k3, k4])
        )[0]
    else:
        assert k4 == 0.0  # a fourth power there
        pixels = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array([k1, k2, p1, p2, k3]))[0]
    world = points @ cameras[0].R + cameras[0].C
    np.testing.assert_allclose(cameras[0].project(world)[0], pixels[:, 0], atol=1e-9)


def test_nerf_refuses_what_it_would_mean_otherwise(tmp_path: Path) -> None:
    rational = ring(1, distortion=[-0.2, 0.05, 1e-3, 2e-3, 0.01, 0.1, 0.0, 0.0])
    with pytest.raises(raycam.CameraError, match=r"more distortion than transforms.json"):
        write(table(), tmp_path, "nerf", cameras=rational)


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # of pycocotools
def test_bop_as_coco(tmp_path: Path) -> None:
    world = table()
    world.add_object(box={"size": [0.1, 0.1, 0.1]}, name="inside", category="box", location=[0, 0, 0.25])
    cameras = ring(3)
    write(world, tmp_path, "bop", cameras=cameras)
    scene = tmp_path / "train_pbr" / "000000"
    gt, information = (
        json.loads((scene / f"{name}.json").read_text()) for name in ("scene_gt", "scene_gt_info")
    )
    hidden = 0
    for kind, folder in (("scene_gt_coco", "mask"), ("scene_gt_coco_modal", "mask_visib")):
        coco = COCO(str(scene / f"{kind}.json"))
        assert sorted(coco.getImgIds()) == [0, 1, 2]
        for number in range(3):
            assert (scene / coco.loadImgs(number)[0]["file_name"]).exists()
            found = iter(coco.loadAnns(coco.getAnnIds(imgIds=number)))
            for place, (pose, info) in enumerate(zip(gt[str(number)], information[str(number)], strict=True)):
                name = f"{number:06d}_{place:06d}.png"
                mask, bounded = (picture(scene / kind / name) > 0 for kind in ("mask_visib", folder))
                if not mask.any():
                    assert info["bbox_obj"] == info["bbox_visib"] == [-1, -1, -1, -1]
                    hidden += 1
                    continue
                one = next(found)
                assert one["category_id"] == pose["obj_id"]
                np.testing.assert_array_equal(coco.annToMask(one), mask)
                assert one["area"] == mask.sum()
                rows, columns = np.nonzero(bounded)
                assert one["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
                assert one["ignore"] == (info["visib_fract"] < 0.1)
            assert next(found, None) is None
    assert hidden


def test_tum(tmp_path: Path) -> None:
    from scipy.spatial.transform import Rotation

    world = table()
    world.add_camera(ring(1)[0])
    write(world, tmp_path, "tum")  # every frame of its video
    seen = views(world)
    lines = (tmp_path / "groundtruth.txt").read_text().splitlines()[1:]
    assert len(lines) == len(seen) == 4
    pairs = [line.split() for line in (tmp_path / "associations.txt").read_text().splitlines()]
    for line, pair, view in zip(lines, pairs, seen, strict=True):
        time, *numbers = map(float, line.split())
        assert time == float(pair[0]) == view.time
        np.testing.assert_allclose(numbers[:3], view.camera.C)
        np.testing.assert_allclose(Rotation.from_quat(numbers[3:]).as_matrix(), view.camera.R.T, atol=1e-12)
        depth = picture(tmp_path / pair[3])
        expected = truth(view.camera, "depth", table().at(view.time))
        inside = expected < 13  # what 16 bits reach
        assert inside.any()
        assert np.abs(depth[inside] / 5000 - expected[inside]).max() < 1.01e-4
        assert picture(tmp_path / pair[1]).shape == (*depth.shape, 3)


def test_tum_has_one_picture_at_a_time(tmp_path: Path) -> None:
    cameras = ring(3)
    with pytest.raises(raycam.SettingsError, match=r"views 0 and 2 are both of the time 0\.500000"):
        write(table(), tmp_path / "tum", "tum", cameras=cameras, times=[0.5, 0.6, 0.5000001])
    assert not (tmp_path / "tum").exists()


def test_scannet(tmp_path: Path) -> None:
    cameras = ring(2)
    write(table(), tmp_path, "scannet", cameras=cameras)
    for number, camera in enumerate(cameras):
        pose = np.loadtxt(tmp_path / "pose" / f"{number}.txt")
        np.testing.assert_allclose(pose[:3, :3], camera.R.T)
        np.testing.assert_array_equal(picture(tmp_path / "instance" / f"{number}.png"), truth(camera) + 1)
        category = picture(tmp_path / "label" / f"{number}.png")
        assert set(np.unique(category)) <= {0, 1, 2, 9}
    K = np.loadtxt(tmp_path / "intrinsic" / "intrinsic_depth.txt")
    np.testing.assert_allclose(K[:3, :3], cameras[0].K)


def test_webdataset(tmp_path: Path) -> None:
    cameras = ring(5)
    write(table(), tmp_path, "webdataset", cameras=cameras, shard_size=2, channels=["depth", "normal"])
    index = json.loads((tmp_path / "index.json").read_text())
    assert [shard["nsamples"] for shard in index["shardlist"]] == [2, 2, 1]
    samples: dict[str, dict[str, bytes]] = {}
    for shard in index["shardlist"]:
        with tarfile.open(tmp_path / shard["url"]) as tar:
            for member in tar:
                key, _, ending = member.name.partition(".")
                samples.setdefault(key, {})[ending] = tar.extractfile(member).read()
    assert sorted(samples) == [f"{i:06d}" for i in range(5)]
    for camera, (_, sample) in zip(cameras, sorted(samples.items()), strict=True):
        import io

        assert set(sample) == {"png", "json", "depth.npy", "normal.npy"}
        np.testing.assert_array_equal(np.load(io.BytesIO(sample["depth.npy"])), truth(camera, "depth"))
        described = json.loads(sample["json"])
        again = raycam.Camera(described["K"], described["R"], described["C"], described["size"])
        np.testing.assert_array_equal(again.P, camera.P)
        assert described["categories"] == {"1": "box", "2": "ball", "9": "9"}


def test_webdataset_holds_samples_and_not_their_shard(tmp_path: Path) -> None:
    channels = ["depth", "position", "normal", "normal_camera", "shading_normal", "barycentric", "uv"]
    peaks, sizes = [], []
    for count in (4, 64):
        given = {"cameras": ring(count), "shard_size": count, "channels": channels, "samples": 1}
        tracemalloc.start()
        write(table(), tmp_path / f"{count}", "webdataset", **given)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        sizes.append((tmp_path / f"{count}" / "shard-000000.tar").stat().st_size)
    assert peaks[1] - peaks[0] < (sizes[1] - sizes[0]) / 8


def quick(tmp_path: Path, **options: Any) -> raycam.dataset.Written:
    return write(table(), tmp_path, cameras=ring(3), integrator="flat", samples=1, **options)


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_call_gives_the_same_files(tmp_path: Path, name: str) -> None:
    def read(folder: Path) -> dict[str, bytes]:
        return {
            str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file() and ".raycam" not in path.relative_to(folder).parts
        }

    assert quick(tmp_path / "a", format=name).made > 0
    quick(tmp_path / "b", format=name, threads=1)
    whole = read(tmp_path / "a")
    assert read(tmp_path / "b") == whole

    # Stopped after the first unit of work, it goes on where it was.
    class Stop(Exception):
        pass

    def stop(done: int, total: int, failed: int) -> None:
        if done:
            raise Stop

    with pytest.raises(Stop):
        quick(tmp_path / "c", format=name, progress=stop)
    assert not {path.name for path in (tmp_path / "c").rglob("*.json")} & {
        "instances.json",
        "transforms.json",
    }
    kept = len([path for path in (tmp_path / "c").rglob("*") if path.is_file()])
    assert 0 < kept < len(whole) + 8  # the job's own
    assert quick(tmp_path / "c", format=name).made == FORMATS[name].units(plan(name)) - 1
    assert Job(tmp_path / "c").verify() == {}
    assert read(tmp_path / "c") == whole
    assert quick(tmp_path / "c", format=name).made == 0


def plan(name: str) -> raycam.dataset.Plan:
    return raycam.dataset.Plan(table(), views(table(), ring(3)), {}, FORMATS[name].options)


def test_what_cannot_be_is_refused_before_it_begins(tmp_path: Path) -> None:
    lens = ring(1, distortion=[-0.1, 0, 0, 0])
    for name in ("bop", "kitti", "tum", "scannet"):
        with pytest.raises(raycam.CameraError, match="camera 0 has"):
            write(table(), tmp_path / name, name, cameras=lens)
    with pytest.raises(raycam.SettingsError, match="did you mean 'coco'"):
        write(table(), tmp_path / "x", "cocco")
    with pytest.raises(raycam.SettingsError, match="option of coco"):
        quick(tmp_path / "x", segmentatio="rle")
    with pytest.raises(raycam.SettingsError, match="segmentation is 'mask'"):
        quick(tmp_path / "x", segmentation="mask")
    with pytest.raises(raycam.SettingsError, match="no category 'cow'"):
        quick(tmp_path / "x", keypoints={"cow": {}})
    with pytest.raises(raycam.SettingsError, match="2 times for 3 cameras"):
        write(table(), tmp_path / "x", cameras=ring(3), times=[0, 1])
    with pytest.raises(raycam.SettingsError, match="flow goes from each view to the next"):
        write(table(), tmp_path / "x", "kitti", cameras=ring(1), flow=True)
    assert list(tmp_path.iterdir()) == []
    quick(tmp_path / "y")
    with pytest.raises(raycam.JobError, match=r'options.segmentation was "rle", is "polygon"'):
        quick(tmp_path / "y", segmentation="polygon")
    assert quick(tmp_path / "y", segmentation="polygon", resume=False).made == 3


def test_shards_that_run_at_the_same_time_make_one_data_set(tmp_path: Path) -> None:
    def other(done: int, total: int, failed: int) -> None:
        if done == 1:
            assert not quick(tmp_path / "a", shard=(2, 2)).complete

    assert quick(tmp_path / "a", shard=(1, 2), progress=other).complete
    quick(tmp_path / "b")
    index = "annotations/instances.json"
    assert (tmp_path / "a" / index).read_bytes() == (tmp_path / "b" / index).read_bytes()


def test_shards_make_one_data_set(tmp_path: Path) -> None:
    one = quick(tmp_path / "a", shard=(1, 2))
    assert (one.made, one.complete) == (2, False)
    assert not (tmp_path / "a" / "annotations").exists()
    two = quick(tmp_path / "a", shard=(2, 2))
    assert (two.made, two.complete) == (1, True)
    quick(tmp_path / "b")
    for name in ("annotations/instances.json", "images/000001.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.parametrize("change", ["mesh", "texture"])
def test_another_mesh_or_texture_is_another_data_set(tmp_path: Path, change: str) -> None:
    def files(scale: float, shade: int) -> raycam.World:
        corners = f"v 0 0 0\nv {scale} 0 0\nv 0 {scale} 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
        (tmp_path / "a.obj").write_text(corners)
        cv2.imwrite(str(tmp_path / "t.png"), np.full((4, 4, 3), shade, np.uint8))
        world = raycam.World(folder=tmp_path)
        world.add_object(mesh="a.obj", texture="t.png")
        return world

    camera = [raycam.Camera.look_at([0.2, 0.2, 3], [0.2, 0.2, 0], [0, 1, 0], size=(16, 12))]
    write(files(1.0, 80), tmp_path / "d", cameras=camera)
    assert write(files(1.0, 80), tmp_path / "d", cameras=camera).made == 0
    with pytest.raises(raycam.JobError, match="another job is here: world was"):
        write(files(2.0 if change == "mesh" else 1.0, 81), tmp_path / "d", cameras=camera)
