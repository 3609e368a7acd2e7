"""Registration: an object rendered into its own photograph covers its original pixels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam

SIZE = (96, 72)
LENSES: list[dict[str, Any]] = [
    {"distortion": [-0.28, 0.09, 0.001, -0.0015, -0.01]},
    {"distortion": [0.02, -0.01, 0.003, -0.001], "model": "fisheye"},
    {"distortion": [0.05, -0.02]},
]


def taken(lens: dict[str, Any]) -> raycam.Camera:
    given = dict(lens)
    if len(given["distortion"]) == 2:
        given["distortion"] = [*given["distortion"], 0.0, 0.0]
    pose = raycam.Camera.look_at([3, -4, 2.5], [0.2, 0, 0.5], fov=48, size=SIZE)
    return pose.replace(**given)


def scene(*, thing: bool, catcher: bool) -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": 30}, color=[0.4, 0.5, 0.35], shadow_catcher=catcher, name="ground")
    if thing:
        world.add_object(box={"size": 1}, location=[0.3, 0.1, 0.5], yaw=25, color="tomato", name="box")
    world.add_light("sun", direction=[1, 1, -2], irradiance=2.5, angular_diameter=0)
    world.add_light("sky", radiance=0.3)
    return world


@pytest.mark.parametrize("lens", LENSES)
def test_mask_and_depth_align_with_the_photo(lens: dict[str, Any], tmp_path: Path) -> None:
    # As in photogrammetry: the cameras are read from a COLMAP model.
    raycam.save_cameras(tmp_path / "sparse", {"photo.png": taken(lens)}, "colmap")
    camera = next(iter(raycam.load_cameras(tmp_path / "sparse").values()))
    assert camera.model != "pinhole"
    original = raycam.render(scene(thing=True, catcher=False), taken(lens), samples=64)
    raycam.render(scene(thing=False, catcher=False), taken(lens), samples=64).save(tmp_path / "removed.png")
    world = scene(thing=True, catcher=True)
    channels = ["color", "depth", "instance", "position", "distance", "alpha"]
    again = raycam.render(
        world, camera.with_background(tmp_path / "removed.png"), samples=64, channels=channels
    )

    difference = np.abs(again.to_srgb8().astype(int) - original.to_srgb8())
    # The photograph is rounded to bytes before the shadow is applied.
    assert difference.max() <= 3, difference.max()
    box = again["instance"] == 1
    assert box.sum() > 250
    truth = raycam.render(
        scene(thing=True, catcher=False), taken(lens), samples=64, channels=["instance", "depth", "coverage"]
    )
    # Sums of opacities along rows and columns give the positions of edges to a fraction of a pixel.
    alone = scene(thing=True, catcher=False)
    alone.remove_object("ground")
    other = raycam.render(alone, taken(lens), samples=256, seed=9, transparent_background=True)["alpha"]
    edge = (again["alpha"] > 0) & (again["alpha"] < 1)
    for axis in (0, 1):
        off = np.abs(other.sum(axis=axis) - again["alpha"].sum(axis=axis))
        assert (off <= 0.1 * np.maximum(edge.sum(axis=axis), 1)).all(), off.max()
    channels = ["instance", "depth"]
    truth = raycam.render(scene(thing=True, catcher=False), taken(lens), samples=1, channels=channels)
    np.testing.assert_array_equal(box, truth["instance"] == 1)
    np.testing.assert_allclose(again["depth"][box], truth["depth"][box], rtol=1e-6)
    assert again.reprojection_error() < 1e-6

    cv2 = pytest.importorskip("cv2")
    points = again["position"][box]
    in_camera = (taken(lens).R @ (points - taken(lens).C).T).T
    coefficients, K = taken(lens).distortion, taken(lens).K
    assert coefficients is not None
    nothing = np.zeros(3)
    if taken(lens).model == "fisheye":
        pixels, _ = cv2.fisheye.projectPoints(in_camera[:, None], nothing, nothing, K, coefficients)
    else:
        pixels, _ = cv2.projectPoints(in_camera[:, None], nothing, nothing, K, coefficients)
    v, u = np.nonzero(box)
    assert np.abs(pixels.reshape(-1, 2) - np.stack([u, v], axis=1)).max() < 0.1
