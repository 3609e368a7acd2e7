"""The command `raycam lidars`."""

from __future__ import annotations

import argparse

from .options.command import Command
from .options.lidars import find_lidar


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "lidar",
        metavar="NAME|FILE",
        nargs="?",
        help="device to describe, or the calibration file of an individual device (default: list all devices)",
    )
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..lidar import Lidar, device_names
    from ..lidar.description import describe_lidar

    if options.lidar is not None:
        print(describe_lidar(find_lidar(options.lidar, {})))
        return
    width = max(len(name) for name in device_names())
    for name in device_names():
        lidar = Lidar(name)
        print(f"{name:{width}}  {lidar.title}, {lidar.rate:g} Hz, {len(lidar.pattern())} pulses per frame")


COMMAND = Command(
    _add,
    "list raycam's lidars, or describe one of them",
    ["raycam lidars", "raycam lidars vlp16", "raycam lidars os1-128.json"],
)
