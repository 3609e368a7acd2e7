"""`raycam cameras`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options import Command, add_known, load_calibration, tell

ENDINGS = {
    "opencv": ".yaml",
    "ros": ".yaml",
    "kalibr": ".yaml",
    "kitti": ".txt",
    "kitti-poses": ".txt",
    "tum": ".txt",
}


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("file", metavar="FILE", help="a calibration, trajectory or COLMAP folder")
    command.add_argument(
        "--to", metavar="FORMAT", required=True, help="the format to write, as raycam.FORMATS"
    )
    command.add_argument(
        "-o", "--output", metavar="OUT", help="(default: the name of FILE and the format, here)"
    )
    add_known(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..calibration import save_cameras

    cameras = load_calibration(options.file, options)
    ending = "" if options.to.startswith("colmap") else ENDINGS.get(options.to, ".json")
    output = Path(options.output or f"{Path(options.file).stem}_{options.to}{ending}")
    tell(save_cameras(output, cameras, options.to))
    print(f"{output}: {len(cameras)} camera{'' if len(cameras) == 1 else 's'}, {options.to}")


COMMAND = Command(
    _add,
    "convert calibrations and poses between the formats of other tools",
    [
        "raycam cameras camchain.yaml --to opencv",
        "raycam cameras sparse/0 --to nerf -o transforms.json",
        "raycam cameras poses.txt --intrinsics calib.yaml --to colmap -o model",
    ],
)
