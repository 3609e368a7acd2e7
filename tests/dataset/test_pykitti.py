"""SemanticKITTI sets, read by pykitti.

`make proof` installs pykitti.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from dataset.test_lidar_rigs import lidar_drive
from dataset.test_semantickitti import drive, street
from raycam.dataset import write

pykitti = pytest.importorskip("pykitti", reason="pykitti is not installed")


def read(path: Path, *, cameras: bool) -> Any:
    rigs, times = drive() if cameras else lidar_drive()
    write(street(), path, "semantickitti", cameras=rigs, times=times, samples=1)
    return pykitti.odometry(str(path), "00")


@pytest.mark.filterwarnings("ignore:.*fromstring:DeprecationWarning")
@pytest.mark.parametrize("cameras", [True, False])
def test_scans_lie_on_the_surfaces(cameras: bool, tmp_path: Path) -> None:
    """world_from_camera0 at the start · pose · T_cam0_velo converts the points to the world."""
    found, world = read(tmp_path, cameras=cameras), street()
    rigs = drive()[0] if cameras else lidar_drive()[0]
    assert len(found) == len(found.poses) == 3
    assert [time.total_seconds() for time in found.timestamps] == pytest.approx([0.0, 0.1, 0.2])
    start = np.eye(4)
    if cameras:
        first = rigs[0]["camera"]
        start[:3, :3], start[:3, 3] = first.R.T, first.C
        np.testing.assert_allclose(found.calib.K_cam2[:2, :2], first.K[:2, :2])
    else:
        start = rigs[0].sensors["top"].pose @ np.linalg.inv(found.calib.T_cam0_velo)
    for pose, points in zip(found.poses, found.velo, strict=True):
        world_from_points = start @ pose @ found.calib.T_cam0_velo
        at = points[:, :3] @ world_from_points[:3, :3].T + world_from_points[:3, 3]
        assert len(points) > 5000
        assert world.closest_points(at.astype(float))["distance"].max() < 1e-4
        assert points[:, 3].min() >= 0.0
        assert points[:, 3].max() <= 1.0


@pytest.mark.filterwarnings("ignore:.*fromstring:DeprecationWarning")
def test_points_project_onto_the_pixels_of_their_surfaces(tmp_path: Path) -> None:
    """K_cam2 · T_cam2_velo projects the car's points onto the car's pixels."""
    found = read(tmp_path, cameras=True)
    for number, points in enumerate(found.velo):
        label = np.fromfile(tmp_path / "sequences/00/labels" / f"{number:06d}.label", np.uint32)
        car = points[label >> 16 == 2, :3]
        local = car @ found.calib.T_cam2_velo[:3, :3].T + found.calib.T_cam2_velo[:3, 3]
        u, v = np.rint((local @ found.calib.K_cam2.T)[:, :2] / local[:, 2:]).astype(int).T
        with found.get_cam2(number) as image:
            inside = (u >= 0) & (v >= 0) & (u < image.width) & (v < image.height)
        instance = raycam.render(street(), drive()[0][number]["camera"], channels=["instance"])["instance"]
        assert inside.sum() > 20
        assert (instance[v[inside], u[inside]] == 1).mean() > 0.8
