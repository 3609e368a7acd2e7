"""Data sets read by their own libraries, where these are installed: panopticapi, motmetrics, Ultralytics' parser."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from raycam.dataset import write
from support.box_table import SIZE, picture, ring, table, truth

# The libraries leave files open.
pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


def test_panopticapi_finds_the_set_equal_to_itself(tmp_path: Path) -> None:
    evaluation = pytest.importorskip("panopticapi.evaluation", exc_type=ImportError)
    write(table(), tmp_path, "panoptic", cameras=ring(3), stuff=["box"], samples=1)
    (file,) = tmp_path.glob("annotations/*.json")
    categories = json.loads(file.read_text())["categories"]
    folders = [path for path in tmp_path.rglob("*") if path.is_dir() and "panoptic" in path.name]
    quality = evaluation.pq_compute(str(file), str(file), str(folders[0]), str(folders[0]))
    assert quality["All"]["pq"] == 1.0
    assert quality["All"]["n"] == len(categories)


def test_motmetrics_reads_the_tracks(tmp_path: Path) -> None:
    motmetrics = pytest.importorskip("motmetrics", exc_type=ImportError)
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
                # The library takes one from left and top, which count from 1.
                np.testing.assert_array_equal([row.X, row.Y, row.Width, row.Height], box)
    found = motmetrics.utils.compare_to_groundtruth(rows, rows, "iou", distth=0.5)
    summary = motmetrics.metrics.create().compute(found, metrics=["mota", "num_switches"])
    assert summary.mota.iloc[0] == 1.0
    assert summary.num_switches.iloc[0] == 0


@pytest.mark.parametrize("task", ["detect", "segment", "pose", "obb"])
def test_ultralytics_takes_every_label(tmp_path: Path, task: str) -> None:
    data = pytest.importorskip("ultralytics.data.utils", exc_type=ImportError)
    options: dict[str, Any] = {"task": task}
    if task == "pose":
        options["points"] = {
            name: {"names": ["top"], "points": [[0, 0, 0.25]]} for name in ("box", "ball", "9")
        }
    cameras = ring(3)
    write(table(), tmp_path, "yolo", cameras=cameras, samples=1, **options)
    described = yaml.safe_load((tmp_path / "data.yaml").read_text())
    keypoints, numbers = described.get("kpt_shape", (0, 0))
    for number, camera in enumerate(cameras):
        (image,) = tmp_path.glob(f"images/*/{number:06d}.png")
        (labels,) = tmp_path.glob(f"labels/*/{number:06d}.txt")
        arguments = ((str(image), str(labels)), "", bool(keypoints), len(described["names"]))
        found = data.verify_image_label((*arguments, keypoints, numbers, False))
        name, boxes, shape, segments, _, missing, _, empty, corrupt, message = found
        assert (name, missing, empty, corrupt, message) == (str(image), 0, 0, 0, "")
        assert tuple(shape) == SIZE[::-1]
        assert len(boxes) == len(labels.read_text().splitlines())
        if task == "detect":
            instance = truth(camera)
            centers = boxes[:, 1:3] * SIZE
            assert {int(instance[int(y), int(x)]) for x, y in centers} - {-1}
        if task in ("segment", "obb"):
            assert len(segments) == len(boxes)


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
        # Row vectors: the box's centre to the world, to the camera, to the clip space, to the picture.
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
