"""The command `raycam cameras`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..calibration import FORMATS, Cameras, save_cameras
from ._options import Command, add_known, calibration_file, print_notices
from .options.rigs import cameras_in

ENDINGS = {
    "opencv": ".yaml",
    "ros": ".yaml",
    "kalibr": ".yaml",
    "kitti": ".txt",
    "kitti-poses": ".txt",
    "tum": ".txt",
}


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "file",
        metavar="FILE[:NAME]",
        help="a calibration, trajectory, COLMAP folder or world file; one camera of it",
    )
    command.add_argument(
        "--to",
        metavar="FORMAT",
        help=f"the format to write: {', '.join(FORMATS)} (default: show what there is)",
    )
    command.add_argument(
        "-o", "--output", metavar="OUT", help="(default: the name of FILE and the format, here)"
    )
    add_known(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..camera import Camera
    from ..errors import CameraError, SettingsError, nearest
    from ..info import info_cameras
    from ..rig import Rig

    if options.to is not None and options.to not in FORMATS:
        raise SettingsError(f"--to: {nearest('format', options.to, list(FORMATS))}")
    file, name = calibration_file(options.file) or (options.file, "")
    cameras = cameras_in(file, options)
    images, times = {}, {}
    if name:
        if name not in cameras:
            raise CameraError(nearest("camera", name, list(cameras)))
        if isinstance(cameras, Cameras):
            images, times = cameras.images, cameras.times
        cameras = {name: cameras[name]}
    if options.to is None:
        if options.output is not None:
            raise SettingsError("-o goes with --to, the format to write")
        single = {name: item for name, item in cameras.items() if isinstance(item, Camera)}
        print(info_cameras(single, {name: item for name, item in cameras.items() if isinstance(item, Rig)}))
        return
    ending = "" if options.to.startswith("colmap") else ENDINGS.get(options.to, ".json")
    output = Path(
        options.output or f"{Path(file).stem}{'_' if name else ''}{Path(name).name}_{options.to}{ending}"
    )
    print_notices(save_cameras(output, cameras, options.to, images=images, times=times))
    count = sum(len(item) if isinstance(item, Rig) else 1 for item in cameras.values())
    print(f"{output}: {count} camera{'' if count == 1 else 's'}, {options.to}")


COMMAND = Command(
    _add,
    "show cameras, and convert calibrations and poses between the formats of other tools",
    [
        "raycam cameras camchain.yaml",
        "raycam cameras room.toml --to colmap -o model",
        "raycam cameras camchain.yaml --to opencv",
        "raycam cameras camchain.yaml:cam1 --to ros",
        "raycam cameras sparse/0 --to nerf -o transforms.json",
        "raycam cameras poses.txt --intrinsics calib.yaml --to colmap -o model",
    ],
)
