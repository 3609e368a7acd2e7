"""COCO data sets, read back by pycocotools."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from pycocotools.coco import COCO
from raycam.dataset import write
from support.bending_plate import FACES, bending_plate, plate_at
from support.box_table import SIZE, ring, table, truth
from support.raises import raises


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools causes it
@pytest.mark.parametrize("segmentation", ["rle", "polygon"])
def test_coco_data_set_is_read_by_pycocotools(tmp_path: Path, segmentation: str) -> None:
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


def test_coco_keypoints_follow_deforming_meshes_with_a_rolling_shutter(tmp_path: Path) -> None:
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
    with raises(raycam.SettingsError, code="wrong_shape"):
        write(world, tmp_path / "no", "coco", **given, keypoints={"object": points | {"triangles": [0]}})


def test_world_without_categories_labels_all_objects(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.5})
    write(world, tmp_path, cameras=[raycam.Camera.look_at([2, 0, 0], [0, 0, 0], size=SIZE)])
    coco = COCO(str(tmp_path / "annotations" / "instances.json"))
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["object"]
    assert len(coco.getAnnIds()) == 1
