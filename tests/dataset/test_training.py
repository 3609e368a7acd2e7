"""Formats for training: YOLO, panoptic COCO, MOT, semantic PNG, HDF5; and splits."""

from __future__ import annotations

import configparser
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
import yaml
from raycam.cli import main
from raycam.dataset import write
from raycam.dataset.training.yolo import joined, rectangle
from support.box_table import SIZE, picture, ring, table, truth
from support.raises import raises

CATEGORIES = [1, 2, 9]


def labels(folder: Path, name: str) -> list[list[float]]:
    (file,) = folder.glob(f"labels/*/{name}.txt")
    return [[float(word) for word in line.split()] for line in file.read_text().splitlines()]


def objects_of(instance: np.ndarray) -> dict[int, int]:
    """The class of each visible labelled object."""
    categories = table().categories
    ids = {name: number for number, name in categories.items()}
    classes = {number: i for i, number in enumerate(sorted(categories))}
    return {
        item.id: classes[ids[item.category]]
        for item in table().objects
        if item.category is not None and (instance == item.id).any()
    }


def test_yolo_detection_labels_equal_the_boxes(tmp_path: Path) -> None:
    cameras = ring(5)
    write(table(), tmp_path, "yolo", cameras=cameras, samples=1)
    table_of = yaml.safe_load((tmp_path / "data.yaml").read_text())
    assert table_of["names"] == {0: "box", 1: "ball", 2: "9"}
    assert table_of["val"] == "images/val"
    assert len(list(tmp_path.glob("images/train/*.png"))) == 4
    for number, camera in enumerate(cameras):
        instance = truth(camera)
        expected = []
        for key, own in objects_of(instance).items():
            rows, columns = np.nonzero(instance == key)
            low = np.array([columns.min(), rows.min()])
            high = np.array([columns.max(), rows.max()]) + 1
            expected.append([own, *((low + high) / 2 / SIZE), *((high - low) / SIZE)])
        np.testing.assert_allclose(sorted(labels(tmp_path, f"{number:06d}")), sorted(expected), atol=1e-9)


def test_yolo_segmentation_polygons_cover_the_masks(tmp_path: Path) -> None:
    cameras = ring(2)
    write(table(), tmp_path, "yolo", cameras=cameras, task="segment", samples=1)
    scale = 16
    for number, camera in enumerate(cameras):
        instance = truth(camera)
        drawn = np.full((SIZE[1] * scale, SIZE[0] * scale), -1, np.int32)
        for own, *corners in labels(tmp_path, f"{number:06d}"):
            points = np.reshape(corners, (-1, 2)) * SIZE * scale - 0.5
            mask = np.zeros(drawn.shape, np.uint8)
            cv2.fillPoly(mask, [np.rint(points).astype(np.int32)], 1)
            drawn[mask > 0] = own
        centers = drawn[scale // 2 :: scale, scale // 2 :: scale]
        expected = np.full(instance.shape, -1)
        for key, own in objects_of(instance).items():
            expected[instance == key] = own
        # The pixels of the bridges that connect the ring's outline with its hole.
        assert (centers != expected).mean() < 0.002


def test_polygon_pieces_are_joined_without_adding_area() -> None:
    def area(p: np.ndarray) -> float:
        x, y = p.T
        return 0.5 * abs(float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))

    first = np.array([[0, 0], [4, 0], [4, 3], [0, 3.0]])
    second = np.add(first, [10, 1])
    assert area(joined([first, second])) == 24.0


@pytest.mark.parametrize("degrees", [0, 17, 45, 80])
def test_oriented_boxes_have_minimal_area(degrees: float) -> None:
    random = np.random.default_rng(3)
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = random.uniform([0, 0], [9, 4], (200, 2)) @ turn.T
    found = rectangle(points + 20, np.array([40.0, 40.0]))
    sides = np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1)
    (_, (w, h), _) = cv2.minAreaRect(points.astype(np.float32))
    np.testing.assert_allclose(sides[0] * sides[1], w * h, rtol=1e-4)


@pytest.mark.parametrize(
    ("points", "turned"),
    [
        # A thin pole that ends one pixel outside of the image, and a wide pole that starts at the image corner.
        ([[10, 0], [13, 0], [23, 40], [20, 40]], True),
        ([[0, 0], [20, 0], [44, 30], [28, 44], [0, 14]], False),
    ],
)
def test_oriented_boxes_stay_in_the_image(points: list[list[float]], turned: bool) -> None:
    size, corners = np.array([64.0, 48.0]), np.array(points, dtype=np.float32)
    assert cv2.boxPoints(cv2.minAreaRect(corners)).min() < -0.3
    found = rectangle(corners.astype(float), size)
    assert (found >= 0).all()
    assert (found <= size).all()
    (_, (w, h), angle) = cv2.minAreaRect(found.astype(np.float32))
    assert (1 < angle % 90 < 89) == turned
    (_, (least_w, least_h), _) = cv2.minAreaRect(corners)
    assert w * h == pytest.approx(least_w * least_h if turned else 44 * 44, rel=0.1)
    outline = found.astype(np.float32)
    assert min(cv2.pointPolygonTest(outline, corner.tolist(), True) for corner in corners) > -1


def test_yolo_oriented_boxes_and_keypoints_are_written(tmp_path: Path) -> None:
    cameras = ring(1)
    write(table(), tmp_path / "obb", "yolo", cameras=cameras, task="obb", samples=1)
    assert {len(row) for row in labels(tmp_path / "obb", "000000")} == {9}
    points = {"points": [[0.1, 0.0, 0.2], [0, 0, -0.2]]}
    given: dict[str, Any] = {"cameras": cameras, "task": "pose", "samples": 1}
    write(table(), tmp_path / "pose", "yolo", keypoints=points, flip_idx=[1, 0], **given)
    data = yaml.safe_load((tmp_path / "pose/data.yaml").read_text())
    assert data["kpt_shape"] == [2, 3]
    assert data["flip_idx"] == [1, 0]
    matrices = {item.id: item.matrix for item in table().objects}
    found = labels(tmp_path / "pose", "000000")
    for (key, own), row in zip(objects_of(truth(cameras[0])).items(), found, strict=True):
        assert row[0] == own
        world = np.array(points["points"]) @ matrices[key][:3, :3].T + matrices[key][:3, 3]
        expected = (cameras[0].project(world)[0] + 0.5) / SIZE
        triples = np.reshape(row[5:], (2, 3))
        inside = triples[:, 2] > 0
        np.testing.assert_allclose(triples[inside, :2], expected[inside], atol=1e-9)
    with raises(raycam.SettingsError, code="missing_value"):
        write(table(), tmp_path / "no", "yolo", **given)
    with raises(raycam.SettingsError, code="out_of_range"):
        write(table(), tmp_path / "no", "yolo", cameras=cameras, splits={"train": 0.7})


def test_splits_depend_on_seed_and_fractions(tmp_path: Path) -> None:
    cameras = ring(10)
    shares = {"train": 0.6, "val": 0.2, "test": 0.2}
    found = []
    for seed in (0, 0, 1):
        folder = tmp_path / f"{len(found)}"
        write(
            table(),
            folder,
            "yolo",
            cameras=cameras,
            splits=shares,
            split_seed=seed,
            samples=1,
            integrator="flat",
        )
        found.append({split: sorted(p.stem for p in folder.glob(f"images/{split}/*")) for split in shares})
    assert found[0] == found[1] != found[2]
    assert [len(names) for names in found[0].values()] == [6, 2, 2]
    rigs = {str(i): raycam.Rig.stereo(camera, 0.1) for i, camera in enumerate(ring(4))}
    write(table(), tmp_path / "rigs", "yolo", cameras=rigs, splits={"train": 0.5, "val": 0.5}, samples=1)
    numbers = [int(path.stem) for path in (tmp_path / "rigs/images/val").iterdir()]
    assert len(numbers) == 4
    assert len({number // 2 for number in numbers}) == 2


def test_panoptic_segments_equal_the_ground_truth(tmp_path: Path) -> None:
    cameras = ring(2)
    write(table(), tmp_path, "panoptic", cameras=cameras, stuff=["box"], samples=1)
    data = json.loads((tmp_path / "annotations/panoptic.json").read_text())
    assert {c["name"]: c["isthing"] for c in data["categories"]} == {"box": 0, "ball": 1, "9": 1}
    assert [c["color"] for c in data["categories"]] == [[128, 0, 0], [0, 128, 0], [192, 0, 0]]
    for number, annotation in enumerate(data["annotations"]):
        bgr = picture(tmp_path / "panoptic" / annotation["file_name"]).astype(np.int64)
        ids = bgr[..., 2] + 256 * bgr[..., 1] + 65536 * bgr[..., 0]
        instance = truth(cameras[number])
        segments = annotation["segments_info"]
        assert {one["id"] for one in segments} == set(np.unique(ids)) - {0}
        boxes = [item.id for item in table().objects if item.category == "box"]
        for one in segments:
            mask = ids == one["id"]
            assert one["area"] == mask.sum()
            expected = np.isin(instance, boxes) if one["category_id"] == 1 else instance == one["id"] - 1
            np.testing.assert_array_equal(mask, expected)
            rows, columns = np.nonzero(mask)
            assert one["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]


def test_mot_data_set_contains_the_tracks(tmp_path: Path) -> None:
    world = table()
    world.add_camera(ring(1)[0])
    write(world, tmp_path, "mot", fps=4.0, samples=1)
    info = configparser.ConfigParser()
    info.read(tmp_path / "seq01/seqinfo.ini")
    assert info["Sequence"]["seqLength"] == "4"
    assert info["Sequence"]["imWidth"] == str(SIZE[0])
    rows = np.loadtxt(tmp_path / "seq01/gt/gt.txt", delimiter=",")
    assert sorted(set(rows[:, 0])) == [1, 2, 3, 4]
    assert set(rows[:, 7]) <= {1, 2, 9}
    view = raycam.dataset.views(world)[2]
    for label in raycam.label(world.at(view.time), view.camera):
        own = rows[(rows[:, 0] == 3) & (rows[:, 1] == label.object + 1)]
        if label.category is not None and label.truncated_fraction < 1:
            np.testing.assert_allclose(own[0, 2:6], np.add(label.amodal_box, (1, 1, 0, 0)))
            np.testing.assert_allclose(own[0, 8], label.visible_fraction, atol=1e-6)


def test_semantic_images_contain_classes_and_instances(tmp_path: Path) -> None:
    (camera,) = ring(1)
    given = {"labels": {"box": 26, "ball": 24, "9": 33}, "void": 0, "palette": {"box": [0, 0, 142]}}
    write(table(), tmp_path, "semantic", cameras=[camera], samples=1, **given)
    instance = truth(camera)
    labels_of = picture(tmp_path / "labelIds/000000.png")
    ids = {"box": 26, "ball": 24, "9": 33}
    names = {1: "box", 2: "ball", 9: "9"}
    expected = np.zeros(instance.shape, np.uint8)
    for item in table().objects:
        if item.category is not None:
            expected[instance == item.id] = ids[item.category]
    np.testing.assert_array_equal(labels_of, expected)
    instances = picture(tmp_path / "instanceIds/000000.png")
    assert instances.dtype == np.uint16
    np.testing.assert_array_equal(instances // 1000, expected)
    color = picture(tmp_path / "color/000000.png")[..., ::-1]
    np.testing.assert_array_equal(
        color[expected == 26], np.broadcast_to([0, 0, 142], (int((expected == 26).sum()), 3))
    )
    rows = json.loads((tmp_path / "labels.json").read_text())["categories"]
    assert {row["name"]: row["id"] for row in rows} == ids
    assert set(names.values()) == set(ids)
    with raises(raycam.SettingsError, code="out_of_range"):
        write(table(), tmp_path / "no", "semantic", cameras=[camera], labels={"box": 300})


def test_palette_equals_that_of_pascal_voc() -> None:
    from raycam.dataset.training.semantic import pascal_palette

    known = [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0], [0, 0, 128], [128, 0, 128], [0, 128, 128]]
    palette = pascal_palette()
    np.testing.assert_array_equal(palette[:7], known)
    np.testing.assert_array_equal(
        palette[[8, 15, 20, 255]], [[64, 0, 0], [192, 128, 128], [0, 64, 128], [224, 224, 192]]
    )


def test_hdf5_files_contain_the_channels(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    (camera,) = ring(1)
    write(table(), tmp_path, "hdf5", cameras=[camera], samples=1)
    instance = truth(camera)
    with h5py.File(tmp_path / "0.hdf5") as file:
        np.testing.assert_array_equal(file["instance_segmaps"][()], instance + 1)
        depth = truth(camera, "depth")
        np.testing.assert_array_equal(
            file["depth"][()], np.where(np.isfinite(depth), depth, np.float32(1e10))
        )
        assert file["colors"].shape == (SIZE[1], SIZE[0], 3)
        assert file["colors"].dtype == np.uint8
        attributes = json.loads(bytes(file["instance_attribute_maps"][()]))
        assert {one["idx"] for one in attributes} == {key + 1 for key in objects_of(instance)}


def test_hdf5_arrays_are_shown_as_images_by_blenderprocs_viewer(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    cameras = ring(2)
    write(table(), tmp_path, "hdf5", cameras=cameras, samples=1)
    assert sorted(path.name for path in tmp_path.glob("*.hdf5")) == ["0.hdf5", "1.hdf5"]
    kinds = {
        "colors": (np.uint8, (SIZE[1], SIZE[0], 3)),
        "depth": (np.float32, SIZE[::-1]),
        "distance": (np.float32, SIZE[::-1]),
        "normals": (np.float32, (SIZE[1], SIZE[0], 3)),
        "instance_segmaps": (np.int32, SIZE[::-1]),
        "category_id_segmaps": (np.int32, SIZE[::-1]),
    }
    categories = {item.id: item.category for item in table().objects}
    for number, camera in enumerate(cameras):
        instance = truth(camera)
        with h5py.File(tmp_path / f"{number}.hdf5", "r") as file:
            values = {key: np.array(file[key]) for key in file}
        # The viewer shows everything except texts and lists, and takes a leading axis of length 2 for a stereo pair.
        texts = {key for key, value in values.items() if np.issubdtype(value.dtype, np.bytes_)}
        assert texts == {"instance_attribute_maps", "blender_proc_version"}
        assert {key: (value.dtype, value.shape) for key, value in values.items() if key not in texts} == kinds
        background = values["instance_segmaps"] == 0
        np.testing.assert_array_equal(background, instance < 0)
        assert (values["depth"][background] == 1e10).all()
        np.testing.assert_array_equal(values["distance"][~background], truth(camera, "distance")[~background])
        # Normals are in Blender's camera axes (y up, z to the viewer), scaled to 0 to 1, and face the viewer.
        normals = 2 * values["normals"][~background] - 1
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
        v, u = np.nonzero(~background)
        toward = -camera.rays(np.column_stack([u, v]))[1] @ camera.R.T * [1, -1, -1]
        assert ((normals * toward).sum(axis=1) > 0).all()
        numbers = {name: number for number, name in table().categories.items()}
        for one in json.loads(values["instance_attribute_maps"].tobytes()):
            mask = values["instance_segmaps"] == one["idx"]
            assert one["category_id"] == numbers[str(categories[one["idx"] - 1])]
            assert set(values["category_id_segmaps"][mask]) == {one["category_id"]}


def test_missing_hdf5_package_is_reported_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["'raycam[hdf5]'"]):
        write(table(), tmp_path, "hdf5", cameras=ring(1))


def test_data_set_card_counts_views_and_objects(tmp_path: Path) -> None:
    cameras = ring(3)
    write(table(), tmp_path / "a", "coco", cameras=cameras, samples=1, licence="CC0-1.0")
    card = json.loads((tmp_path / "a/dataset_card.json").read_text())
    annotations = json.loads((tmp_path / "a/annotations/instances.json").read_text())["annotations"]
    assert card["views"] == 3
    assert sum(card["objects"].values()) == len(annotations)
    assert card["licence"]["pictures"] == "CC0-1.0"
    assert card["sizes"] == {"64 x 48": 3}
    assert "CC0-1.0" in (tmp_path / "a/dataset_card.md").read_text()
    write(table(), tmp_path / "b", "yolo", cameras=cameras, samples=1)
    assert json.loads((tmp_path / "b/dataset_card.json").read_text())["splits"] == {"train": 2, "val": 1}


def test_contact_sheet_shows_every_label(tmp_path: Path) -> None:
    from raycam.dataset.training.contact_sheet import contact_sheet
    from raycam.dataset.training.marks import _strips

    (camera,) = ring(1)
    write(table(), tmp_path / "coco", "coco", cameras=[camera], samples=1)
    data = json.loads((tmp_path / "coco/annotations/instances.json").read_text())
    page = contact_sheet(tmp_path / "coco").read_text()
    assert page.count("<rect") == len(data["annotations"])
    assert "fields of view of 1 camera from above" in page
    instance = truth(camera)
    names = {item.name: item.id for item in table().objects}
    for one in data["annotations"]:
        mask = np.zeros(instance.shape, bool)
        for x, y, count in _strips(one["segmentation"]["counts"], SIZE[1]):
            mask[y : y + count, x] = True
        np.testing.assert_array_equal(mask, instance == names[one["object"]])
    for task in ("detect", "segment"):
        write(table(), tmp_path / task, "yolo", cameras=[camera], samples=1, task=task)
        page = contact_sheet(tmp_path / task).read_text()
        assert page.count("<title>ball") == 1
        assert page.count("<g>") == len(data["annotations"])
    with raises(raycam.SettingsError, code="unknown_format"):
        contact_sheet(tmp_path)


def test_show_option_writes_the_contact_sheet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(table(), tmp_path, "coco", cameras=ring(2), samples=1)
    assert main(["dataset", "--show", str(tmp_path)]) == 0
    assert "contact_sheet.html" in capsys.readouterr().out
    assert (tmp_path / "contact_sheet.html").read_text().count("<svg class=labels") == 2
    assert main(["dataset", "--show", str(tmp_path / "none")]) != 0
    assert "none" in capsys.readouterr().err


@pytest.mark.parametrize(
    "format", ["bop", "mot", "kitti", "panoptic", "replicator", "semantic", "coco", "yolo"]
)
def test_contact_sheet_shows_every_labelled_format(tmp_path: Path, format: str) -> None:
    from raycam.dataset.training.contact_sheet import contact_sheet
    from raycam.dataset.training.marks import pictures_of

    cameras = ring(2)
    write(table(), tmp_path, format, cameras=cameras, samples=1)
    page = contact_sheet(tmp_path).read_text()
    assert ("fields of view of 2 cameras from above" in page) == (
        format in ("bop", "kitti", "replicator", "coco")
    )
    pictures = pictures_of(tmp_path)
    assert len(pictures) == page.count("<svg class=labels") == 2
    by_number = sorted(pictures, key=lambda one: Path(one.file).stem)
    for one, camera in zip(by_number, cameras, strict=True):
        assert one.size == SIZE
        instance = truth(camera)
        assert (tmp_path / one.file).is_file()
        assert one.mask is None or (tmp_path / one.mask).is_file()
        boxes = {mark.box for mark in one.marks if mark.box is not None}
        expected = set()
        for key in objects_of(instance):
            rows, columns = np.nonzero(instance == key)
            expected.add((columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1))
        if format == "semantic":
            assert not boxes
        elif format in ("mot", "kitti"):  # boxes of these formats include hidden parts
            assert len(boxes) == len(expected)
        else:
            np.testing.assert_allclose(sorted(boxes), sorted(expected), atol=1e-4)
        axes = [mark.axes for mark in one.marks if mark.axes]
        assert len(axes) == (len(expected) if format == "bop" else 0)
        centers = {
            tuple(np.round(camera.project(item.matrix[:3, 3])[0] + 0.5, 6)) for item in table().objects
        }
        assert {tuple(np.round(start, 6)) for (_, start, _), *_ in axes} <= centers
