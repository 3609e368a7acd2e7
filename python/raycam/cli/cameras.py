"""`raycam cameras`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..calibration import FORMATS, save_cameras
from .options import Command, add_known, tell
from .rigs import cameras_in

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
        "file", metavar="FILE", help="a calibration, trajectory, COLMAP folder or world file"
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
    from ..errors import SettingsError, nearest
    from ..info import info_cameras
    from ..rig import Rig

    if options.to is not None and options.to not in FORMATS:
        raise SettingsError(f"--to: {nearest('format', options.to, list(FORMATS))}")
    cameras = cameras_in(options.file, options)
    if options.to is None:
        if options.output is not None:
            raise SettingsError("-o goes with --to, the format to write")
        single = {name: item for name, item in cameras.items() if isinstance(item, Camera)}
        print(info_cameras(single, {name: item for name, item in cameras.items() if isinstance(item, Rig)}))
        return
    ending = "" if options.to.startswith("colmap") else ENDINGS.get(options.to, ".json")
    output = Path(options.output or f"{Path(options.file).stem}_{options.to}{ending}")
    tell(save_cameras(output, cameras, options.to))
    count = sum(len(item) if isinstance(item, Rig) else 1 for item in cameras.values())
    print(f"{output}: {count} camera{'' if count == 1 else 's'}, {options.to}")


COMMAND = Command(
    _add,
    "show cameras, and convert calibrations and poses between the formats of other tools",
    [
        "raycam cameras camchain.yaml",
        "raycam cameras room.toml --to colmap -o model",
        "raycam cameras camchain.yaml --to opencv",
        "raycam cameras sparse/0 --to nerf -o transforms.json",
        "raycam cameras poses.txt --intrinsics calib.yaml --to colmap -o model",
    ],
)
