"""The command `raycam info`."""

from __future__ import annotations

import argparse

from ._options import Command, add_folder, add_known, guessed_up, load_calibration, print_notice

CALIBRATIONS = {".yaml", ".yml", ".json", ".xml", ".txt", ".bin"}


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("world", metavar="FILE", help="a world, a mesh, or a calibration of cameras")
    add_folder(command)
    add_known(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from pathlib import Path

    from ..data import bundled
    from ..info import info, info_cameras
    from ..world.load import load

    path = bundled(options.world) or Path(options.world)
    if path != Path(options.world):
        print_notice(
            f"{options.world}: there is no such file here, so the one that comes with raycam is meant"
        )
    if path.is_dir() or path.suffix.lower() in CALIBRATIONS or options.camera_format is not None:
        cameras = load_calibration(options.world, options)
        print(info_cameras(cameras, cameras.rigs))
    else:
        print(info(load(path, folder=options.folder, up=guessed_up(path))))


COMMAND = Command(
    _add,
    "show what a world or a calibration holds: counts, bounds, cameras",
    [
        "raycam info room.toml",
        "raycam info camchain.yaml",
    ],
)
