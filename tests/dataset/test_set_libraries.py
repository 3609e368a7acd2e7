"""Data sets read by the formats' own libraries, if installed.

The libraries are panopticapi, motmetrics and the parser of Ultralytics.
"""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from raycam.dataset import write
from support.box_table import SIZE, picture, ring, table, truth

# The libraries leave files open.
pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


def test_panopticapi_scores_identical_data_sets_as_perfect(tmp_path: Path) -> None:
    evaluation = pytest.importorskip("panopticapi.evaluation", exc_type=ImportError)
    write(table(), tmp_path, "panoptic", cameras=ring(3), stuff=["box"], samples=1)
    (file,) = tmp_path.glob("annotations/*.json")
    categories = json.loads(file.read_text())["categories"]
    folders = [path for path in tmp_path.rglob("*") if path.is_dir() and "panoptic" in path.name]
    quality = evaluation.pq_compute(str(file), str(file), str(folders[0]), str(folders[0]))
    assert quality["All"]["pq"] == 1.0
    assert quality["All"]["n"] == len(categories)


def test_panopticapi_assigns_category_colours(tmp_path: Path) -> None:
    utils = pytest.importorskip("panopticapi.utils", exc_type=ImportError)
    write(table(), tmp_path, "panoptic", cameras=ring(2), stuff=["box"], samples=1)
    categories = json.loads((tmp_path / "annotations/panoptic.json").read_text())["categories"]
    generator = utils.IdGenerator({category["id"]: category for category in categories})
    colors = [generator.get_color(category["id"]) for category in categories]
    assert len({tuple(color) for color in colors} - {(0, 0, 0)}) == len(categories)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_motmetrics_reads_the_tracks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    motmetrics = pytest.importorskip("motmetrics", exc_type=ImportError)
    # motmetrics 1.4 calls a function that NumPy 2 no longer has.
    monkeypatch.setattr(np, "asfarray", lambda array: np.asarray(array, dtype=float), raising=False)
    cameras = ring(4)
    write(table(), tmp_path, "mot", cameras=cameras, samples=1)
    rows = motmetrics.io.loadtxt(str(tmp_path / "seq01/gt/gt.txt"), fmt="mot16", min_confidence=1)
    assert sorted({frame for frame, _ in rows.index}) == [1, 2, 3, 4]
    for number, camera in enumerate(cameras, 1):
        instance = truth(camera)
        for (_, track), row in rows.loc[[number]].iterrows():
            if row.Visibility == 1.0:
                ys, xs = np.nonzero(instance == track - 1)
                box = [xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1]
                # The library subtracts 1 from `left` and `top`, because these coordinates start at 1 in the file.
                np.testing.assert_array_equal([row.X, row.Y, row.Width, row.Height], box)
    found = motmetrics.utils.compare_to_groundtruth(rows, rows, "iou", distth=0.5)
    summary = motmetrics.metrics.create().compute(found, metrics=["mota", "num_switches"])
    assert summary.mota.iloc[0] == 1.0
    assert summary.num_switches.iloc[0] == 0


@pytest.mark.parametrize("task", ["detect", "segment", "pose", "obb"])
def test_ultralytics_loads_every_label(tmp_path: Path, task: str) -> None:
    loader = pytest.importorskip("ultralytics.data.dataset", exc_type=ImportError)
    options: dict[str, Any] = {"task": task}
    if task == "pose":
        options["keypoints"] = {"points": [[0, 0, 0.25]]}
    cameras = ring(3)
    write(table(), tmp_path, "yolo", cameras=cameras, samples=1, **options)
    # The current folder is not the data set's folder, so `data.yaml` must work from any folder.
    described = importlib.import_module("ultralytics.data.utils").check_det_dataset(
        str(tmp_path / "data.yaml")
    )
    categories = {name: number for number, name in described["names"].items()}
    found = {}
    for split in ("train", "val"):
        loaded = loader.YOLODataset(
            img_path=described[split], data=described, task=task, augment=False, imgsz=SIZE[0]
        )
        found |= {int(Path(label["im_file"]).stem): label for label in loaded.labels}
    assert sorted(found) == [0, 1, 2]
    for number, camera in enumerate(cameras):
        label, instance = found[number], truth(camera)
        assert tuple(label["shape"]) == SIZE[::-1]
        things = [item for item in table().objects if item.category and (instance == item.id).any()]
        assert len(label["cls"]) == len(label["bboxes"]) == len(things)
        assert sorted(label["cls"][:, 0]) == sorted(categories[str(item.category)] for item in things)
        if task == "detect":
            boxes = label["bboxes"] * np.tile(SIZE, 2)
            for item in things:
                ys, xs = np.nonzero(instance == item.id)
                low, high = np.array([xs.min(), ys.min()]), np.array([xs.max(), ys.max()]) + 1
                wanted = np.concatenate([(low + high) / 2, high - low])
                assert np.abs(boxes - wanted).max(axis=1).min() < 1e-3
        if task == "segment":
            for item in things:
                mask = instance == item.id
                assert any((inside(polygon * SIZE) == mask).all() for polygon in label["segments"]), item.name
        if task == "pose":
            assert label["keypoints"].shape == (len(things), 1, 3)


def inside(polygon: np.ndarray) -> np.ndarray:
    """Mask of the pixels whose centres are inside a polygon (even-odd rule).

    The polygon's vertices are pixel corners.
    """
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    found = np.zeros(x.shape, dtype=bool)
    for (x0, y0), (x1, y1) in zip(np.round(polygon), np.round(np.roll(polygon, -1, axis=0)), strict=True):
        if y0 != y1:
            found ^= ((y < y0) != (y < y1)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return found


def test_opencv_and_numpy_read_replicators_files(tmp_path: Path) -> None:
    cameras = ring(2)
    write(table(), tmp_path, "replicator", cameras=cameras, samples=1)
    for number, camera in enumerate(cameras):
        instance, end = truth(camera), f"{number:04d}"
        rows = np.load(tmp_path / f"bounding_box_2d_tight_{end}.npy")
        labels = json.loads((tmp_path / f"bounding_box_2d_tight_labels_{end}.json").read_text())
        paths = json.loads((tmp_path / f"bounding_box_2d_tight_prim_paths_{end}.json").read_text())
        objects = {f"/World/{item.name}": item for item in table().objects}
        assert len(rows) == len(paths) > 2
        mapping = json.loads((tmp_path / f"instance_segmentation_mapping_{end}.json").read_text())
        colors = {
            name: tuple(json.loads(key.replace("(", "[").replace(")", "]"))) for key, name in mapping.items()
        }
        segments = cv2.cvtColor(picture(tmp_path / f"instance_segmentation_{end}.png"), cv2.COLOR_BGRA2RGBA)
        for row, path in zip(rows, paths, strict=True):
            assert labels[str(row["semanticId"])] == {"class": objects[path].category}
            mask = (segments == colors[path]).all(axis=-1)
            np.testing.assert_array_equal(mask, instance == objects[path].id)
            ys, xs = np.nonzero(mask)
            corners = [xs.min(), ys.min(), xs.max() + 1, ys.max() + 1]
            assert [row[name] for name in ("x_min", "y_min", "x_max", "y_max")] == corners
        for kind, channel in (("distance_to_camera", "distance"), ("distance_to_image_plane", "depth")):
            found = np.load(tmp_path / f"{kind}_{end}.npy")
            np.testing.assert_array_equal(found, truth(camera, channel))
        params = json.loads((tmp_path / f"camera_params_{end}.json").read_text())
        solid = np.load(tmp_path / f"bounding_box_3d_{end}.npy")
        # With row vectors, the box's centre is transformed to world, camera and clip space, and then to the image.
        view, projection = (
            np.reshape(params[key], (4, 4)) for key in ("cameraViewTransform", "cameraProjection")
        )
        for row in solid:
            center = np.array([0, 0, 0, 1.0]) @ row["transform"].astype(float)
            clip = center @ view @ projection
            x, y = (clip[:2] / clip[3] * [1, -1] + 1) / 2 * SIZE
            np.testing.assert_allclose([x - 0.5, y - 0.5], camera.project(center[:3])[0], atol=1e-4)
        focal = params["cameraFocalLength"] / params["cameraAperture"][0] * SIZE[0]
        assert focal == pytest.approx(camera.K[0, 0])
