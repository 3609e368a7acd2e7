"""COLMAP data sets, read back by pycolmap."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
import pytest
import raycam
from raycam.dataset import write
from support.box_table import SIZE, ring, table, truth
from support.raises import raises


@pytest.mark.parametrize(
    ("options", "model"),
    [
        ({}, "PINHOLE"),
        ({"distortion": [-0.1, 0.02, 0.001, 0.002]}, "OPENCV"),
        ({"distortion": [-0.1, 0.02, 0.001, 0.002, 0.01, 0.1, 0.02, 0.003]}, "FULL_OPENCV"),
        ({"distortion": [0.01, 0.002, 0, 0], "model": "fisheye"}, "OPENCV_FISHEYE"),
        ({"distortion": [0.4], "model": "fov"}, "FOV"),
        ({"distortion": [-0.05], "model": "division"}, "DIVISION"),
        ({"distortion": [0.6, 1.1], "model": "eucm"}, "EUCM"),
        (
            {"distortion": [0.01, 0.002, 1e-3, 0, 1e-3, 0, 1e-3, -1e-3], "model": "thin_prism_fisheye"},
            "THIN_PRISM_FISHEYE",
        ),
    ],
)
def test_colmap_data_set_is_read_by_pycolmap(tmp_path: Path, options: dict[str, Any], model: str) -> None:
    cameras = ring(3, **options)
    write(table(), tmp_path, "colmap", cameras=cameras, points=300)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert len(read.cameras) == 1
    assert read.cameras[1].model.name == model
    assert read.num_reg_images() == 3
    assert 250 < read.num_points3D() <= 300
    assert read.compute_mean_track_length() > 1
    for number, image in read.images.items():
        assert image.name == f"{number - 1:06d}.png"
        assert (tmp_path / "images" / image.name).exists()
        for point in image.points2D:
            where = read.points3D[point.point3D_id].xyz
            seen = image.project_point(where)
            assert seen is not None
            assert np.abs(seen - point.xy).max() < 1e-6
            pixel, _ = cameras[number - 1].project(where)
            np.testing.assert_allclose(point.xy, pixel + 0.5, atol=1e-9)


def test_colmap_omits_points_behind_a_wide_lens(tmp_path: Path) -> None:
    """COLMAP does not project points behind the camera, although the lens does."""
    k = [[20, 0, 31.5], [0, 20, 23.5], [0, 0, 1]]
    cameras = [
        raycam.Camera(k, camera.R, camera.C, SIZE, distortion=[0.0, 0, 0, 0], model="fisheye")
        for camera in (raycam.Camera.look_at([0, y, 0.5], [3, y, 1.5], size=SIZE, fov=40) for y in (0, 0.3))
    ]
    wide = [(truth(camera, "depth") < 0).sum() for camera in cameras]
    assert min(wide) > 50
    write(table(), tmp_path, "colmap", cameras=cameras, points=1000, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert read.num_points3D() == 1000
    for image in read.images.values():
        assert len(image.points2D) > 300
        for point in image.points2D:
            seen = image.project_point(read.points3D[point.point3D_id].xyz)
            assert seen is not None
            assert np.abs(seen - point.xy).max() < 1e-6


def test_colmap_contains_the_requested_number_of_points(tmp_path: Path) -> None:
    """The number of points does not depend on the views.

    Each observation is listed both with its image and with its point.
    """
    write(table(), tmp_path, "colmap", cameras=ring(7), points=1500, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    assert read.num_points3D() == 1500
    observed = {
        (image, place, point.point3D_id)
        for image, entry in read.images.items()
        for place, point in enumerate(entry.points2D)
    }
    told = {
        (element.image_id, element.point2D_idx, number)
        for number, point in read.points3D.items()
        for element in point.track.elements
    }
    assert observed == told
    assert len(told) > 2 * 1500
    skewed = raycam.Camera([[90, 1, 40], [0, 90, 30], [0, 0, 1]], np.eye(3), [0, 0, 0], SIZE)
    with raises(raycam.CameraError, code="invalid_lens", mentions=["COLMAP"]):
        write(table(), tmp_path / "skew", "colmap", cameras=[*ring(1), skewed])


def test_colmap_omits_observations_of_points_that_moved(tmp_path: Path) -> None:
    cameras, times = ring(4), [0.0, 0.25, 0.5, 0.75]
    write(table(), tmp_path, "colmap", cameras=cameras, times=times, points=800, integrator="flat", samples=1)
    read = pycolmap.Reconstruction(str(tmp_path / "sparse" / "0"))
    gone = 0
    for number, camera in enumerate(cameras):
        world = table().at(times[number])
        image = read.images[number + 1]
        ids = [point.point3D_id for point in image.points2D]
        points = np.array([read.points3D[i].xyz for i in ids])
        np.testing.assert_allclose(world.cast_rays(camera.C, points - camera.C)["t"], 1.0, rtol=2e-4)
        others = np.array([point.xyz for i, point in read.points3D.items() if i not in set(ids)])
        gone += (world.cast_rays(camera.C, others - camera.C)["t"] > 1.01).sum()
    assert gone > 10
    assert read.compute_mean_track_length() > 1.5
