"""Rigs at the poses of trajectory files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import raycam
from raycam.dataset.trajectory import load_rigs, times_of
from support.raises import raises

TUM = "0.0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0.6 0.8\n0.2 2 0.5 0 0 0 0.8 0.6\n"


def car() -> raycam.Rig:
    forward = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
    camera = raycam.Camera([[20, 0, 16], [0, 20, 12], [0, 0, 1]], forward, [0.5, 0, 1], (32, 24))
    return raycam.Rig({"CAM_FRONT": camera, "LIDAR_TOP": raycam.Lidar("vlp16").placed([0, 0, 2])})


def test_rig_is_placed_at_each_pose_of_the_trajectory(tmp_path: Path) -> None:
    (tmp_path / "body.tum").write_text(TUM)
    rigs, poses = load_rigs(car(), tmp_path / "body.tum")
    assert times_of(poses) == [0.0, 0.1, 0.2]
    assert not poses.notices
    second = list(rigs.values())[1]
    np.testing.assert_allclose(second.C, [1, 0, 0])
    # A quaternion (0, 0, 0.6, 0.8) turns x to (0.28, 0.96).
    np.testing.assert_allclose(second.R.T @ [1, 0, 0], [0.28, 0.96, 0], atol=1e-12)


def test_data_set_of_a_trajectory_has_its_poses_and_times(tmp_path: Path) -> None:
    (tmp_path / "body.tum").write_text(TUM)
    world = raycam.World()
    world.add_object(plane={"size": [40, 40]}, name="road", category="road", color=[0.5] * 3)
    world.add_light("sky", radiance=1)
    raycam.dataset.write(
        world, tmp_path / "drive", "nuscenes", cameras=car(), poses=tmp_path / "body.tum", samples=1
    )
    tables = tmp_path / "drive" / "v1.0-mini"
    ego = json.loads((tables / "ego_pose.json").read_text())
    assert sorted({pose["timestamp"] for pose in ego}) == [0, 100_000, 200_000]
    assert [2.0, 0.5, 0.0] in [pose["translation"] for pose in ego]


def test_poses_of_something_that_is_not_a_rig_are_refused(tmp_path: Path) -> None:
    (tmp_path / "body.tum").write_text(TUM)
    with raises(raycam.SettingsError, code="wrong_type", mentions=["Rig"]):
        raycam.dataset.write(raycam.World(), tmp_path / "x", "coco", poses=tmp_path / "body.tum")
