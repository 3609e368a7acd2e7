"""Scans as mappings, images, and points in other frames."""

from __future__ import annotations

import numpy as np
import pytest
import raycam


@pytest.fixture(scope="module")
def scan(yard: raycam.World) -> raycam.Scan:
    lidar = raycam.Lidar("vlp16", noise=False).placed([0, 0, 1.8])
    return raycam.scan(yard, lidar.moving(lidar.placed([1, 0, 1.8], yaw=10)))


def test_scan_is_a_read_only_mapping(scan: raycam.Scan) -> None:
    assert "distance" in scan
    assert len(list(scan)) == len(scan)
    assert all(len(array) == scan.count for array in scan.values())
    with pytest.raises(ValueError, match="read-only"):
        scan["distance"][0] = 1
    with pytest.raises(raycam.LidarError) as caught:
        scan["distanse"]
    assert caught.value.code == "unknown_name"
    assert "distance" in str(caught.value)


def test_in_world_applies_the_pose_of_each_point(scan: raycam.Scan) -> None:
    world = np.einsum("nij,nj->ni", scan.poses[:, :3, :3], scan["position"]) + scan.poses[:, :3, 3]
    np.testing.assert_allclose(scan.in_world(), world, atol=1e-12)
    np.testing.assert_allclose(scan.in_world(), scan["true_position"], atol=1e-9)


def test_deskewed_points_refer_to_one_pose(scan: raycam.Scan) -> None:
    lidar = raycam.Lidar("vlp16").placed([0.25, 0, 1.8], yaw=2.5)
    points = scan.deskewed(0.025)
    back = points @ lidar.pose[:3, :3].T + lidar.pose[:3, 3]
    np.testing.assert_allclose(back, scan.in_world(), atol=1e-9)
    np.testing.assert_array_equal(scan.deskewed(), scan.deskewed(0.05))


def test_image_has_a_row_per_laser_from_the_top(scan: raycam.Scan) -> None:
    image = scan.image("ring")
    assert image.shape == (16, 1808)
    for row, values in enumerate(image):
        assert set(np.unique(values)) <= {-1, 15 - row}
    distance = scan.image()
    assert np.isfinite(distance).sum() == scan.count
    assert np.isnan(distance).any()
    assert scan.image("position").shape == (16, 1808, 3)


def test_image_of_an_irregular_pattern_is_refused(yard: raycam.World) -> None:
    scan = raycam.scan(yard, raycam.Lidar("livox-mid40", noise=False).placed([0, 0, 1]))
    with pytest.raises(raycam.LidarError) as caught:
        scan.image()
    assert caught.value.code == "wrong_shape"


def test_destaggering_requires_an_ouster(scan: raycam.Scan) -> None:
    with pytest.raises(raycam.LidarError) as caught:
        scan.image(staggered=False)
    assert caught.value.code == "wrong_device"
