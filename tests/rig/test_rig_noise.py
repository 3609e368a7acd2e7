"""Noise of several cameras at one time.

OpenCV's stereo matcher must find the scene, not equal noise in both images.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import raycam
from raycam.dataset import write

SIZE = (160, 120)
DISPARITY = 25
DISTANCE = 4.0


def ground() -> raycam.World:
    """A faintly textured floor under a lamp."""
    rng = np.random.default_rng(1)
    texture = (140 + rng.integers(-6, 7, (160, 240, 1)).repeat(3, axis=2)).astype(np.uint8)
    world = raycam.World()
    world.add_object(plane={"size": [12, 8]}, texture=texture)
    world.add_light("area", position=[0, 0, 6], u=[3, 0, 0], v=[0, -3, 0], radiance=[4, 4, 4])
    return world


def left_camera() -> raycam.Camera:
    """A camera that looks straight down at the floor."""
    return raycam.Camera.look_at([0, 0, DISTANCE], [0, 0, 0], size=SIZE, fov=50, up=[0, 1, 0])


def baseline() -> float:
    return DISPARITY * DISTANCE / float(left_camera().K[0, 0])


def median_disparity(left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8]) -> float:
    """The median disparity of OpenCV's semi-global matcher, in pixels."""
    matcher = cv2.StereoSGBM_create(minDisparity=0, numDisparities=48, blockSize=7, P1=8 * 49, P2=32 * 49)
    grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (left, right)]
    found = matcher.compute(*grey).astype(float) / 16
    inside = found[10:-10, 60:-10]
    return float(np.median(inside[inside >= 0]))


def test_rig_images_have_independent_noise() -> None:
    rig = raycam.Rig.stereo(left_camera(), baseline=baseline())
    world = ground()
    frames = rig.render(world, integrator="path", samples=4, seed=5, channels="color")
    left, right = (frames[name].to_srgb8() for name in ("left", "right"))
    assert abs(median_disparity(left, right) - DISPARITY) < 1
    # If both images had the same seed, the matcher would find the noise, which has disparity 0.
    same = [
        raycam.render(world, rig[name], integrator="path", samples=4, seed=5, channels="color")
        for name in rig
    ]
    assert np.array_equal(same[0]["color"], frames["left"]["color"])
    assert abs(median_disparity(*(frame.to_srgb8() for frame in same))) < 1


def test_kitti_pairs_have_independent_noise(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        write(
            ground(),
            tmp_path,
            "kitti",
            cameras=[left_camera()],
            baseline=baseline(),
            integrator="path",
            samples=4,
        )
    base = tmp_path / "object" / "training"
    left, right = (
        cv2.imread(str(base / folder / "000000.png"))[..., ::-1] for folder in ("image_2", "image_3")
    )
    assert abs(median_disparity(np.ascontiguousarray(left), np.ascontiguousarray(right)) - DISPARITY) < 1
