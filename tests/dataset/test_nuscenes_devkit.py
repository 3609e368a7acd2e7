"""nuScenes sets, opened and projected by nuscenes-devkit.

`make proof` installs the devkit.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from dataset.test_lidar_rigs import lidar_drive
from dataset.test_nuscenes import drive
from dataset.test_semantickitti import street
from numpy.lib.stride_tricks import sliding_window_view
from raycam.dataset import write

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    devkit = pytest.importorskip("nuscenes.nuscenes", reason="nuscenes-devkit is not installed")
    data_classes = pytest.importorskip("nuscenes.utils.data_classes")
    geometry = pytest.importorskip("nuscenes.utils.geometry_utils")


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("nuscenes")
    poses, times = drive()
    write(street(), path, "nuscenes", cameras=poses, times=times, samples=1, key_every=2)
    return devkit.NuScenes("v1.0-mini", str(path), verbose=False)


def scan_of(opened: Any, sample: Any) -> Any:
    row = opened.get("sample_data", sample["data"]["LIDAR_TOP"])
    return row, data_classes.LidarPointCloud.from_file(str(Path(opened.dataroot) / row["filename"]))


def test_devkit_opens_scenes_and_samples(opened: Any) -> None:
    assert len(opened.scene) == 1
    assert len(opened.sample) == 3
    for sample in opened.sample:
        assert set(sample["data"]) == {"CAM_FRONT", "CAM_FRONT_LEFT", "LIDAR_TOP"}
        assert len(sample["anns"]) == 2
    tokens = {row["token"] for row in opened.sample_data}
    for sample in opened.sample:
        assert set(sample["data"].values()) <= tokens
        assert all(opened.get("sample_data", token)["is_key_frame"] for token in sample["data"].values())


def test_sweeps_of_a_moving_lidar_lie_on_the_surfaces(opened: Any) -> None:
    """`from_file_multisweep` moves the sweeps before a key frame into its axes, with their time lags."""
    sample = opened.sample[2]
    cloud, times = data_classes.LidarPointCloud.from_file_multisweep(
        opened, sample, "LIDAR_TOP", "LIDAR_TOP", nsweeps=5, min_distance=0.0
    )
    assert sorted({round(float(value), 6) for value in times[0]}) == [0, 0.05, 0.1, 0.15, 0.2]
    assert cloud.points.shape == (4, times.shape[1])
    row = opened.get("sample_data", sample["data"]["LIDAR_TOP"])
    for table in ("calibrated_sensor", "ego_pose"):
        pose = opened.get(table, row[f"{table}_token"])
        cloud.rotate(devkit.Quaternion(pose["rotation"]).rotation_matrix)
        cloud.translate(np.array(pose["translation"]))
    assert street().closest_points(cloud.points[:3].T.astype(float))["distance"].max() < 1e-4


def test_boxes_contain_their_points(opened: Any) -> None:
    """`get_sample_data` returns the boxes in the axes of the lidar."""
    for sample in opened.sample:
        row, cloud = scan_of(opened, sample)
        _, boxes, _ = opened.get_sample_data(row["token"], box_vis_level=geometry.BoxVisibility.NONE)
        (box,) = [box for box in boxes if box.name == "car"]
        np.testing.assert_allclose(box.wlh, [2, 4, 1.5], atol=1e-9)
        inside = geometry.points_in_box(box, cloud.points[:3], wlh_factor=1.001)
        count = opened.get("sample_annotation", box.token)["num_lidar_pts"]
        assert 20 < count <= inside.sum()
        assert inside.sum() - count <= 30  # points on the road at the car's lower edge


def test_points_project_onto_the_pixels_of_their_surfaces(opened: Any) -> None:
    """`map_pointcloud_to_image`: a point's depth is between the least and greatest depth of the 3 x 3 pixels around it.

    The only exceptions are points that are hidden from the camera.
    """
    for number, sample in enumerate(opened.sample):
        points, depths, image = opened.explorer.map_pointcloud_to_image(
            sample["data"]["LIDAR_TOP"], sample["data"]["CAM_FRONT"], min_dist=0.5
        )
        camera = drive()[0][2 * number]["CAM_FRONT"]
        with image:
            assert image.size == camera.size
        depth = raycam.render(street(), camera, channels=["depth"])["depth"]
        around = sliding_window_view(np.pad(depth, 1, mode="edge"), (3, 3))
        u, v = np.rint(points[:2]).astype(int)
        u, v = np.clip(u, 0, camera.size[0] - 1), np.clip(v, 0, camera.size[1] - 1)
        nearest, farthest = around.min(axis=(2, 3))[v, u], around.max(axis=(2, 3))[v, u]
        assert len(depths) > 300
        assert (depths > nearest * 0.999).all()
        assert (depths < farthest * 1.001).mean() > 0.97


def test_boxes_of_the_camera_are_those_in_its_image(opened: Any) -> None:
    for number, sample in enumerate(opened.sample):
        _, boxes, intrinsic = opened.get_sample_data(
            sample["data"]["CAM_FRONT"], box_vis_level=geometry.BoxVisibility.ANY
        )
        (car,) = [box for box in boxes if box.name == "car"]
        corners = geometry.view_points(car.corners(), intrinsic, normalize=True)[:2]
        camera = drive()[0][2 * number]["CAM_FRONT"]
        rows, columns = np.nonzero(raycam.render(street(), camera, channels=["instance"])["instance"] == 1)
        assert columns.min() >= np.floor(corners[0].min()) - 1
        assert columns.max() <= np.ceil(corners[0].max()) + 1
        assert rows.min() >= np.floor(corners[1].min()) - 1
        assert rows.max() <= np.ceil(corners[1].max()) + 1


def test_devkit_opens_a_set_without_cameras(tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    write(street(), tmp_path, "nuscenes", cameras=rigs, times=times)
    opened = devkit.NuScenes("v1.0-mini", str(tmp_path), verbose=False)
    assert [set(sample["data"]) for sample in opened.sample] == [{"top"}] * 3
    _, boxes, _ = opened.get_sample_data(opened.sample[0]["data"]["top"])
    assert {box.name for box in boxes} == {"car", "road"}
