"""BOP data sets, read back also as COCO."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pycocotools.coco import COCO
from raycam.dataset import write
from scipy.spatial.transform import Rotation
from support.box_table import picture, ring, table, truth
from support.raises import raises, warns


def test_bop_data_set_is_complete_and_consistent(tmp_path: Path) -> None:
    cameras = ring(pixel_center="half")
    write(table(), tmp_path, "bop", cameras=cameras)
    scene = tmp_path / "train_pbr" / "000000"
    rows = {
        name: json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info")
    }
    assert all(" " not in (scene / f"scene_{name}.json").read_text() for name in rows)
    information = json.loads((tmp_path / "models" / "models_info.json").read_text())
    assert information["2"]["diameter"] == pytest.approx(1000 * np.linalg.norm([0.6, 0.4, 0.5]))
    assert information["1"]["diameter"] == pytest.approx(600, rel=0.02)
    assert information["2"]["size_x"] == pytest.approx(600)
    assert set(information) == {"1", "2", "9"}
    import trimesh

    model = trimesh.load(tmp_path / "models" / "obj_000002.ply", process=False)
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
        assert [g["obj_id"] for g in rows["gt"][str(number)]] == [{1: 2, 2: 2, 3: 1, 4: 9}[n] for n in order]
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
            # As in the toolkit's calc_2d_bbox, a box extends from the first pixel's coordinate to the last pixel's.
            rows_of, columns_of = np.nonzero(visible)
            low, size = [columns_of.min(), rows_of.min()], [np.ptp(columns_of), np.ptp(rows_of)]
            assert info["bbox_visib"] == [*low, *size]
            x, y, width, height = info["bbox_obj"]
            assert labels[n].amodal_box == (x, y, width + 1, height + 1)
            # The model in its pose equals the world's object in camera coordinates.
            to_camera = np.reshape(pose["cam_R_m2c"], (3, 3)), np.array(pose["cam_t_m2c"])
            model = trimesh.load(tmp_path / "models" / f"obj_{pose['obj_id']:06d}.ply", process=False)
            placed = model.vertices @ to_camera[0].T + to_camera[1]
            ids = table().triangle_ids()[:, 0]
            corners = table().triangles()[ids == n].reshape(-1, 3) * 1000 @ R.T + t
            np.testing.assert_allclose(placed.min(axis=0), corners.min(axis=0), atol=1e-2)
            np.testing.assert_allclose(placed.max(axis=0), corners.max(axis=0), atol=1e-2)
            assert np.linalg.det(to_camera[0]) == pytest.approx(1)


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # a warning of pycocotools
def test_bop_data_set_contains_coco_annotations(tmp_path: Path) -> None:
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


def model_rows(folder: Path) -> dict[int, float]:
    """The diameters of the models, by obj_id."""
    rows = json.loads((folder / "models/models_info.json").read_text())
    assert {f"obj_{int(key):06d}.ply" for key in rows} | {"models_info.json"} == {
        path.name for path in (folder / "models").iterdir()
    }
    return {int(key): round(row["diameter"], 3) for key, row in rows.items()}


def pose_ids(folder: Path, scene: int = 0) -> list[int]:
    rows = json.loads((folder / f"train_pbr/{scene:06d}/scene_gt.json").read_text())
    return [row["obj_id"] for row in rows["0"]]


def test_bop_meshes_loaded_several_times_are_one_model(tmp_path: Path) -> None:
    source = raycam.World()
    source.add_object(sphere={"radius": 0.2, "level": 2})
    source.to_gltf(tmp_path / "ball.glb")
    world = raycam.World()
    for x in (-0.6, 0.0, 0.6):
        world.add_object(mesh=str(tmp_path / "ball.glb"), location=[x, 0, 0.2], yaw=40 * x, category="ball")
    world.add_object(mesh=str(tmp_path / "ball.glb"), location=[0, 0.8, 0.5], scale=2, category="big ball")
    write(world, tmp_path / "set", "bop", cameras=ring(1), samples=1, integrator="flat")
    assert list(model_rows(tmp_path / "set")) == [1, 2]
    assert pose_ids(tmp_path / "set") == [1, 1, 1, 2]


def test_bop_model_ids_do_not_depend_on_the_order_of_objects(tmp_path: Path) -> None:
    things = [
        {"box": {"size": [0.3, 0.2, 0.1]}, "name": "a", "category": "cup", "location": [0, 0, 0.3]},
        {"sphere": {"radius": 0.2}, "name": "b", "category": "ball", "location": [0.6, 0, 0.3]},
        {"cone": {"radius": 0.2, "height": 0.3}, "name": "c", "category": 7, "location": [-0.6, 0, 0.3]},
        {"box": {"size": [0.1, 0.1, 0.1]}, "name": "d", "category": "cup", "location": [0, 0.6, 0.3]},
    ]
    found = []
    for number, order in enumerate(([0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1])):
        world = raycam.World()
        for place in order:
            world.add_object(**things[place])
        folder = tmp_path / str(number)
        write(world, folder, "bop", cameras=ring(1), samples=1, integrator="flat")
        found.append((model_rows(folder), dict(zip(order, pose_ids(folder), strict=True))))
    assert found[0] == found[1] == found[2]
    assert found[0][1][2] == 7
    # Scenes with different objects use the same ids, because `model_ids` specifies them.
    ids = {"cup": 30, "ball": 20, "d": 31}
    for number, chosen in enumerate(([0, 1], [1, 2, 3])):
        world = raycam.World()
        for place in chosen:
            world.add_object(**things[place])
        given = {name: own for name, own in ids.items() if name != "d" or 3 in chosen}
        given = {name: own for name, own in given.items() if name != "cup" or 0 in chosen}
        folder = tmp_path / f"scene{number}"
        write(
            world, folder, "bop", cameras=ring(1), model_ids=given, scene=number, samples=1, integrator="flat"
        )
        assert pose_ids(folder, number) == [{0: 30, 1: 20, 2: 7, 3: 31}[place] for place in chosen]


def test_bop_objects_of_equal_shape_keep_the_ids_assigned_to_them(tmp_path: Path) -> None:
    world = raycam.World()
    for x, name, category in ((-0.6, "a", "red"), (-0.2, "b", "blue"), (0.2, "c", "red"), (0.6, "d", "red")):
        world.add_object(box={"size": [0.2, 0.1, 0.3]}, location=[x, 0, 0.3], name=name, category=category)
    for number, (given, expected) in enumerate(
        [
            (None, [1, 1, 1, 1]),
            ({"red": 8, "blue": 9}, [8, 9, 8, 8]),
            ({"red": 8, "c": 4, "d": 8}, None),
            ({"red": 8, "c": 4, "d": 7}, [8, 4, 4, 7]),
        ]
    ):
        folder = tmp_path / str(number)
        options = {"cameras": ring(1), "model_ids": given, "samples": 1, "integrator": "flat"}
        if expected is None:
            with raises(raycam.SettingsError, code="duplicate_name"):
                write(world, folder, "bop", **options)
            continue
        write(world, folder, "bop", **options)
        assert pose_ids(folder) == expected
        assert set(model_rows(folder)) == set(expected)


def test_bop_reports_categories_with_several_shapes(tmp_path: Path) -> None:
    world = raycam.World()
    for x, size in ((-0.4, 0.1), (0.4, 0.2)):
        world.add_object(box={"size": [size] * 3}, location=[x, 0, 0.3], category=5)
    with warns(raycam.Notice, code="duplicate_name", mentions=["obj_id"]):
        write(world, tmp_path / "set", "bop", cameras=ring(1), samples=1, integrator="flat")
    assert list(model_rows(tmp_path / "set")) == [1, 5]
    for wrong in ({"cup": 1}, {"5": 0}, {"5": 2.5}, [1]):
        with pytest.raises(raycam.SettingsError):
            write(world, tmp_path / "wrong", "bop", cameras=ring(1), model_ids=wrong)


def model_points(folder: Path, model: int) -> np.ndarray:
    """The vertices of a model in millimetres."""
    data = (folder / f"models/obj_{model:06d}.ply").read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(data.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(data[start : start + 12 * count], np.float32).reshape(-1, 3)


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 2, 1, 0]])
def test_bop_mesh_is_one_model_in_the_axes_of_its_file_and_of_the_world(
    tmp_path: Path, order: list[int]
) -> None:
    source = raycam.World()
    source.add_object(
        vertices=[[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0.05, 0.1]],
        triangles=[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    )
    source.to_gltf(tmp_path / "part.glb")
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec([0.4, -0.3, 0.9]).as_matrix()
    matrix[:3, 3] = [0.5, 0.1, 0.2]
    placements: list[dict[str, Any]] = [
        {"location": [-0.5, 0, 0.2], "yaw": 40},
        {"matrix": matrix.tolist()},
        {"location": [0, 0.5, 0.2], "roll": 10, "upright": False},
        {"matrix": matrix.tolist(), "upright": True},
    ]
    world = raycam.World()
    for place in order:
        world.add_object(mesh=str(tmp_path / "part.glb"), name=f"part{place}", **placements[place])
    (camera,) = ring(1)
    write(world, tmp_path / "set", "bop", cameras=[camera], samples=1, integrator="flat")
    assert pose_ids(tmp_path / "set") == [1, 1, 1, 1]
    rows = json.loads((tmp_path / "set/train_pbr/000000/scene_gt.json").read_text())["0"]
    points = model_points(tmp_path / "set", 1)
    for number, row in enumerate(rows):
        found = points @ np.reshape(row["cam_R_m2c"], (3, 3)).T + row["cam_t_m2c"]
        corners = world.triangles(number).reshape(-1, 3)
        expected = (corners @ camera.R.T + camera.t) * 1000
        apart = np.linalg.norm(found[:, None] - expected, axis=2)
        assert apart.min(axis=0).max() < 1e-3
        assert apart.min(axis=1).max() < 1e-3
