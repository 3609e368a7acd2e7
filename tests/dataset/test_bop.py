"""BOP read back, also as COCO."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from pycocotools.coco import COCO
from raycam.dataset import write
from support.box_table import picture, ring, table, truth


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
