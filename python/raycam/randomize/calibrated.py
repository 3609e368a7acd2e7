"""Cameras of recipes whose size, K and lens come from a calibration file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..calibration import load_cameras
from ..camera import Camera
from ..errors import Error, WorldError

__all__ = ["calibrated"]

INTRINSICS = (
    "K",
    "focal",
    "fov",
    "height",
    "skew",
    "principal_point",
    "distortion",
    "matrix",
    "pixel_center",
    "size",
)
POSE = ("R", "C", "t", "location", "target", "up", "roll", "pitch", "yaw")


def calibrated(row: Mapping[str, Any], path: Path, up: str, what: str) -> dict[str, Any]:
    """Returns a [[camera]] table in which the key `calibration` is replaced by the file's keys.

    A pose in the table replaces the pose in the calibration file. For a file with several cameras, the table's `name`
    selects one camera. `lens` specifies the lens model if the file does not. Raises `WorldError` for keys that the
    file already contains, and for files that cannot be read.
    """
    more = {key: value for key, value in row.items() if key not in ("calibration", "lens")}
    for key in INTRINSICS:
        if key in more:
            raise WorldError(
                f"{what}: {key} cannot be combined with calibration: the file {path.name} already contains it",
                code="duplicate_name",
            )
    try:
        cameras = load_cameras(path, model=row.get("lens"), up="y" if up == "y" else "z")
        name = row.get("name")
        camera: Camera = next(iter(cameras.values())) if len(cameras) == 1 else cameras.find(str(name))
    except (Error, OSError) as fault:
        raise WorldError(f"{what}: calibration: {fault}", code=getattr(fault, "code", None)) from None
    own = camera.to_dict()
    if any(key in more for key in POSE):
        own = {key: value for key, value in own.items() if key not in POSE}
    return own | more
