"""TUM and ScanNet data sets, read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from raycam.dataset import views, write
from support.box_table import picture, ring, table, truth
from support.raises import raises


def test_tum_data_set_contains_images_and_poses(tmp_path: Path) -> None:
    from scipy.spatial.transform import Rotation

    world = table()
    world.add_camera(ring(1)[0])
    write(world, tmp_path, "tum")  # without cameras, the data set contains every frame of the world's video
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
        inside = expected < 13  # the depths that fit into 16 bits
        assert inside.any()
        assert np.abs(depth[inside] / 5000 - expected[inside]).max() < 1.01e-4
        assert picture(tmp_path / pair[1]).shape == (*depth.shape, 3)


def test_tum_refuses_two_images_at_the_same_time(tmp_path: Path) -> None:
    cameras = ring(3)
    with raises(raycam.SettingsError, code="duplicate_name", mentions=["0.500000"]):
        write(table(), tmp_path / "tum", "tum", cameras=cameras, times=[0.5, 0.6, 0.5000001])
    assert not (tmp_path / "tum").exists()


def test_scannet_data_set_contains_poses_and_labels(tmp_path: Path) -> None:
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
