"""Lidars of world files: the tables `[[lidar]]` and `[[rig.lidar]]`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from ..arguments import product
from ..errors import Error, LidarError, Notice
from ..notices import warn
from .files.calibrations import load_lidar
from .lidar import Lidar
from .pose import Track

if TYPE_CHECKING:
    from ..calibration import Cameras

__all__ = ["read_lidar_table"]

Files = Mapping[str, tuple[str, bytes]]
"""Names and contents of files by the key that refers to them."""


def read_lidar_table(
    name: str,
    table: Mapping[str, Any],
    pose: tuple[Sequence[Sequence[float]], Sequence[float]],
    files: Files,
    up: str,
    time: float | None,
) -> Lidar:
    """Returns the lidar in a world file's table.

    The lidar is in world coordinates, or in the coordinates of the body of its rig. `pose` is the rotation
    sensor_from_parent and the position; with a trajectory, the parent is the body that moves along it. `time` is the
    frame's start in seconds; None means a static world with the trajectory's first pose. Raises `LidarError`,
    `FormatError` and `CameraError`, each with the sensor's name.
    """
    settings = dict(table)
    device = settings.pop("device", None)
    settings.pop("calibration", None)
    settings.pop("trajectory", None)
    axis = cast(Literal["z", "y"], up)
    try:
        if "calibration" in files:
            with _written(*files["calibration"]) as path:
                lidar = load_lidar(path, device, up=axis, **settings)
        else:
            lidar = Lidar(device, up=axis, **settings)
        lidar = lidar.at_pose(pose[0], pose[1])
        if "trajectory" in files:
            lidar = _along(lidar, *files["trajectory"], time)
    except Error as fault:
        raise type(fault)(f"lidar {name!r}: {fault}", code=fault.code) from None
    return lidar


@contextmanager
def _written(name: str, contents: bytes) -> Iterator[Path]:
    """Context with a temporary file with this name and contents.

    Error messages contain the name from the world file instead of the temporary path.
    """
    with TemporaryDirectory(prefix="raycam-") as folder:
        path = Path(folder, Path(name).name)
        path.write_bytes(contents)
        try:
            yield path
        except Error as fault:
            raise type(fault)(str(fault).replace(os.fspath(path), name), code=fault.code) from None


def _along(lidar: Lidar, name: str, contents: bytes, time: float | None) -> Lidar:
    """Returns the lidar on a body that moves along a trajectory.

    The lidar moves during the frame that starts at `time`. If `time` is None, the lidar stays at the first
    pose.
    """
    from ..calibration import load_cameras
    from ..camera import Camera

    body = Camera.from_pose([0, 0, 0], focal=1.0, size=(1, 1))
    with _written(name, contents) as path:
        poses = load_cameras(path, intrinsics=body)
    times = np.array([poses.times.get(key, np.nan) for key in poses])
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise LidarError(
            f"{name}: each pose of a trajectory requires a time, later than the previous pose's time",
            code="unordered_times",
        )
    if time is None:
        return _placed(lidar, poses, times[:1] * 0.0, np.zeros(1, int))
    end = time + 1.0 / lidar.rate
    if time < times[0] - 1e-9 or end > times[-1] + 1e-9:
        text = (
            f"{name}: the frame from {time:g} to {end:g} s is outside the trajectory ({times[0]:g} to "
            f"{times[-1]:g} s); before and after the trajectory, the lidar keeps the first or last pose"
        )
        warn(Notice(text, "outside_times"))
    first = max(0, int(np.searchsorted(times, time, side="right")) - 1)
    last = min(len(times) - 1, int(np.searchsorted(times, end, side="left")))
    chosen = np.arange(first, max(first, last) + 1)
    return _placed(lidar, poses, times[chosen] - time, chosen)


def _placed(lidar: Lidar, poses: Cameras, times: Any, chosen: Any) -> Lidar:
    """Returns the lidar moving with its body.

    At `times[i]`, the body is at the pose with the number `chosen[i]` of the trajectory.
    """
    keys = list(poses)
    own = lidar.pose
    turns, places = [], []
    for number in chosen.tolist():
        body = poses[keys[number]]
        turns.append(product(body.R.T, own[:3, :3]))
        places.append(body.location + product(body.R.T, own[:3, 3]))
    return lidar.on_track(Track(np.asarray(times, float), np.stack(turns), np.stack(places)))
