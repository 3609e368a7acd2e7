"""The command `raycam cameras`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ..calibration import WRITTEN_FORMATS, Cameras, save_cameras
from .options.cameras import add_known, find_calibration
from .options.command import Command
from .options.copies import add_copies, derive_cameras, has_copies
from .options.messages import print_notices
from .options.rigs import cameras_in

FORMAT_ENDINGS = {
    "opencv": ".yaml",
    "ros": ".yaml",
    "kalibr": ".yaml",
    "orb-slam": ".yaml",
    "camodocal": ".yaml",
    "kitti": ".txt",
    "kitti-poses": ".txt",
    "tum": ".txt",
    "tum-intrinsics": ".txt",
    "poses": ".txt",
    "euroc": ".csv",
}
FOLDER_FORMATS = ("colmap", "colmap-binary", "blender-splits")


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "file",
        metavar="FILE[:NAME]",
        help="calibration, trajectory, world file or folder; with :NAME, only that camera",
    )
    command.add_argument(
        "--to",
        metavar="FORMAT",
        help=f"write this format: {', '.join(WRITTEN_FORMATS)} (default: show the cameras)",
    )
    command.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help="output file or folder (default: FILE's name with the format's ending, in the current folder)",
    )
    add_known(command)
    add_copies(command)
    command.add_argument(
        "--time-offset",
        metavar="SECONDS",
        help="time in seconds to subtract from the cameras' times, or first for the earliest time (default: 0)",
    )
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..camera import Camera
    from ..errors import CameraError, SettingsError, nearest
    from ..info import info_cameras
    from ..rig import Rig

    if options.to is not None and options.to not in WRITTEN_FORMATS:
        raise SettingsError(
            f"--to: {nearest('format', options.to, list(WRITTEN_FORMATS))}", code="unknown_name"
        )
    file, name = find_calibration(options.file) or (options.file, "")
    cameras = cameras_in(file, options)
    images, times = {}, {}
    if isinstance(cameras, Cameras):
        images, times = cameras.images, _times(cameras.times, options.time_offset)
    elif options.time_offset is not None:
        raise SettingsError(
            f"--time-offset requires a trajectory; {options.file} is a world", code="missing_value"
        )
    if name:
        if name not in cameras:
            raise CameraError(nearest("camera", name, list(cameras)), code="unknown_name")
        cameras = {name: cameras[name]}
    cameras = derive_cameras(cameras, options)
    if options.to is None:
        if options.output is not None:
            raise SettingsError("-o requires --to FORMAT", code="missing_value")
        single = {name: item for name, item in cameras.items() if isinstance(item, Camera)}
        print(info_cameras(single, {name: item for name, item in cameras.items() if isinstance(item, Rig)}))
        return
    ending = "" if options.to in FOLDER_FORMATS else FORMAT_ENDINGS.get(options.to, ".json")
    output = Path(
        options.output or f"{Path(file).stem}{'_' if name else ''}{Path(name).name}_{options.to}{ending}"
    )
    if not (name or options.time_offset or has_copies(options)):
        images, times = {}, {}  # `cameras` itself contains both
    print_notices(save_cameras(output, cameras, options.to, images=images, times=times))
    loaded = isinstance(cameras, Cameras)
    count = len(cameras) if loaded else sum(len(x) if isinstance(x, Rig) else 1 for x in cameras.values())
    print(f"{output}: {count} camera{'' if count == 1 else 's'}, {options.to}")


def _times(times: Mapping[str, float], offset: str | None) -> dict[str, float]:
    """The times minus `--time-offset`."""
    from ..errors import SettingsError

    if offset is None:
        return dict(times)
    if not times:
        raise SettingsError("--time-offset requires a trajectory with times", code="missing_value")
    try:
        start = min(times.values()) if offset == "first" else float(offset)
    except ValueError:
        raise SettingsError(
            f"--time-offset {offset}: expected a number of seconds, or the word first", code="invalid_value"
        ) from None
    return {name: time - start for name, time in times.items()}


COMMAND = Command(
    _add,
    "show cameras, and convert calibrations and poses between formats",
    [
        "raycam cameras camchain.yaml",
        "raycam cameras room.toml --to colmap -o model",
        "raycam cameras camchain.yaml --to opencv",
        "raycam cameras camchain.yaml:cam1 --to ros",
        "raycam cameras sparse/0 --to nerf -o transforms.json",
        "raycam cameras poses.txt --intrinsics calib.yaml --to colmap -o model",
        "raycam cameras calib.yaml --undistort 0 --maps maps.npz --to opencv -o undistorted.yaml",
        "raycam cameras stereo.yaml --rectify --maps maps.npz --to kalibr -o rectified.yaml",
    ],
)
