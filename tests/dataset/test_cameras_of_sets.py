"""The cameras of a data set, read from its folder."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.dataset import write
from support.box_table import ring, table
from support.raises import notice_codes, raises

POINTS = np.random.default_rng(1).uniform(-0.4, 0.4, (20, 3))


@pytest.mark.parametrize("format", ["coco", "bop", "kitti", "colmap", "nerf", "tum", "scannet", "replicator"])
@pytest.mark.filterwarnings("ignore:replicator")
def test_cameras_of_a_data_set_are_read_back(tmp_path: Path, format: str) -> None:
    lens: dict[str, Any] = (
        {"distortion": [-0.2, 0.05, 0.001, 0.0]} if format in ("coco", "colmap", "nerf", "replicator") else {}
    )
    cameras = ring(3, **lens)
    write(table(), tmp_path, format, cameras=cameras, samples=1, integrator="flat")
    found = raycam.load_cameras(tmp_path)
    assert len(found) == 3
    for own, given in zip(found.values(), cameras, strict=True):
        assert own.size == given.size
        shift = (0.5 if own.pixel_center == "half" else 0.0) - (0.5 if given.pixel_center == "half" else 0.0)
        np.testing.assert_allclose(own.project(POINTS)[0] - shift, given.project(POINTS)[0], atol=1e-6)


def test_nerf_stores_complete_panoramas_only(tmp_path: Path) -> None:
    places = [[0.1, 0.2, 0.3], [1.0, 0.0, 0.5]]
    cameras = [raycam.Camera.equirectangular(place, 10, 20, 30, size=(64, 32)) for place in places]
    write(table(), tmp_path, "nerf", cameras=cameras, samples=1, integrator="flat")
    document = json.loads((tmp_path / "transforms.json").read_text())
    # nerfstudio expects fx = width / 2 (horizontal angle) and fy = height (vertical angle).
    assert document["camera_model"] == "EQUIRECTANGULAR"
    assert [document[key] for key in ("fl_x", "fl_y", "cx", "cy", "w", "h")] == [32, 32, 32, 16, 64, 32]
    for own, given in zip(raycam.load_cameras(tmp_path).values(), cameras, strict=True):
        np.testing.assert_allclose(own.project(POINTS)[0] - 0.5, given.project(POINTS)[0], atol=1e-6)
    part = raycam.Camera.look_at([1, 1, 1], [0, 0, 0], size=(64, 32), model="equirectangular")
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["K is"]):
        write(table(), tmp_path / "part", "nerf", cameras=[part])
    high = raycam.Camera.equirectangular(places[0], size=(64, 30))
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["64 x 30"]):
        write(table(), tmp_path / "high", "nerf", cameras=[high])


@pytest.mark.parametrize(
    ("K", "lens", "notices"),
    [
        ([[70, 0, 31], [0, 65, 23], [0, 0, 1]], {}, 0),
        ([[70, 2, 31], [0, 65, 23], [0, 0, 1]], {}, 1),
        ([[70, 0, 31], [0, 65, 23], [0, 0, 1]], {"distortion": [-0.2, 0.05, 0, 0]}, 1),
        ([[30, 0, 31], [0, 30, 23], [0, 0, 1]], {"model": "fisheye", "distortion": [0, 0, 0, 0]}, 1),
    ],
)
def test_replicator_reports_lenses_that_its_keys_cannot_represent(
    tmp_path: Path, K: Any, lens: dict[str, Any], notices: int
) -> None:
    camera = raycam.Camera.look_at([3, 1, 2], [0, 0, 0.3], size=(64, 48), K=K, **lens)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        write(table(), tmp_path, "replicator", cameras=[camera], samples=1, integrator="flat")
    assert notice_codes(one.message for one in caught) == ["not_written"] * notices
    (found,) = raycam.load_cameras(tmp_path).values()
    np.testing.assert_allclose(found.project(POINTS)[0] - camera.project(POINTS)[0], 0, atol=1e-6)


def test_replicator_camera_is_read_without_raycams_own_key(tmp_path: Path) -> None:
    camera = raycam.Camera.look_at(
        [3, 1, 2], [0, 0, 0.3], size=(64, 48), K=[[70, 0, 30], [0, 65, 25], [0, 0, 1]]
    )
    write(table(), tmp_path, "replicator", cameras=[camera], samples=1, integrator="flat")
    path = tmp_path / "camera_params_0000.json"
    params = json.loads(path.read_text())
    del params["raycam"]
    path.write_text(json.dumps(params))
    (found,) = raycam.load_cameras(path).values()
    np.testing.assert_allclose(found.project(POINTS)[0] - 0.5, camera.project(POINTS)[0], atol=1e-6)
    path.write_text(json.dumps({**params, "cameraModel": "fisheyePolynomial"}))
    with raises(raycam.errors.FormatError, code="unsupported_feature", mentions=["fisheyePolynomial"]):
        raycam.load_cameras(tmp_path)
