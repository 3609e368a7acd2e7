"""Cameras of SDF links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import CameraError, FormatError
from .sdf_frames import read_numbers, read_pose
from .xml_tree import Element

__all__ = ["SdfCamera", "read_sensor"]

TYPES = (
    "camera",
    "depth",
    "depth_camera",
    "rgbd",
    "rgbd_camera",
    "wideanglecamera",
    "thermal",
    "segmentation",
)
CAMERA_FROM_SENSOR = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Rotation from axes x forward, y left, z up to axes x right, y down, z forward."""


@dataclass(frozen=True)
class SdfCamera:
    """A camera on a link."""

    name: str
    link: str
    camera: Camera
    """The camera with its pose relative to the link."""


def read_sensor(
    sensor: Element, link: str, fail: Callable[[Element, str, str], FormatError]
) -> SdfCamera | None:
    """Returns the camera of a `<sensor>`; None for a sensor of another type.

    K comes from `<lens><intrinsics>`, or else from the horizontal field of view with square pixels; the coefficients
    k1, k2, k3, p1, p2 of `<distortion>` are those of OpenCV. Raises `FormatError` for invalid values.
    """
    element = sensor.find("camera")
    if sensor.attributes.get("type", "").strip() not in TYPES or element is None:
        return None

    def number(owner: Element | None, tag: str, default: float) -> float:
        found = None if owner is None else owner.find(tag)
        return default if found is None else read_numbers(found, 1, fail)[0]

    image, lens = element.find("image"), element.find("lens")
    width, height = (number(image, tag, default) for tag, default in (("width", 320), ("height", 240)))
    if width < 1 or height < 1 or width % 1 or height % 1:
        raise fail(
            element, f"the image must have whole numbers of pixels, got {width:g} x {height:g}", "wrong_type"
        )
    fov = number(element, "horizontal_fov", 1.047)
    if not 0 < fov < np.pi:
        raise fail(element, f"horizontal_fov must be between 0 and pi, got {fov:g}", "out_of_range")
    focal = width / 2 / np.tan(fov / 2)
    inner = None if lens is None else lens.find("intrinsics")
    K = np.array(
        [
            [number(inner, "fx", focal), number(inner, "s", 0.0), number(inner, "cx", width / 2)],
            [0.0, number(inner, "fy", focal), number(inner, "cy", height / 2)],
            [0.0, 0.0, 1.0],
        ]
    )
    distortion = element.find("distortion")
    k = [number(distortion, tag, 0.0) for tag in ("k1", "k2", "p1", "p2", "k3")]
    sensor_pose, _ = read_pose(sensor, fail)
    link_from_sensor: Floats = sensor_pose @ read_pose(element, fail)[0]
    R = CAMERA_FROM_SENSOR @ link_from_sensor[:3, :3].T
    try:
        camera = Camera(
            K,
            R,
            link_from_sensor[:3, 3],
            (int(width), int(height)),
            distortion=k if any(k) else None,
            pixel_center="half",
        )
    except CameraError as error:
        raise fail(element, str(error), error.code) from None
    name = sensor.attributes.get("name", "camera").strip()
    return SdfCamera(name, link, camera)
