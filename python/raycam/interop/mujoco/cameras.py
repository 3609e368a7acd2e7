"""The cameras of a MuJoCo model."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...camera import Camera

__all__ = ["model_camera"]

DEFAULT_SIZE = (640, 480)
"""Size of cameras without a resolution."""


def model_camera(model: Any, camera: int, data: Any) -> Camera:
    """Returns a camera of the model at its pose in `data`.

    The camera's calibration is used if the model specifies a sensor.
    """
    width, height = (int(side) for side in model.cam_resolution[camera])
    if width < 2 or height < 2:
        width, height = DEFAULT_SIZE
    focal = height / 2 / np.tan(np.radians(float(model.cam_fovy[camera])) / 2)
    k = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    sensor = np.asarray(model.cam_sensorsize[camera], np.float64)
    if sensor[0] > 0 and sensor[1] > 0:
        per_metre = np.array([width, height]) / sensor
        intrinsic = np.asarray(model.cam_intrinsic[camera], np.float64)
        k[[0, 1], [0, 1]] = intrinsic[:2] * per_metre
        k[:2, 2] = [width / 2, height / 2] + intrinsic[2:4] * per_metre * [-1, 1]
    pose = np.eye(4)
    pose[:3, :3] = np.asarray(data.cam_xmat[camera]).reshape(3, 3)
    pose[:3, 3] = data.cam_xpos[camera]
    return Camera.from_opengl(k, pose, (width, height), pixel_center="half")
