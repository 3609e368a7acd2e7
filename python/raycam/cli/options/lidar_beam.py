"""Options of `raycam explain` that select a lidar's pulse."""

from __future__ import annotations

import argparse

from ...errors import SettingsError
from .lidars import add_lidar_pose, chosen_lidar
from .messages import print_notices
from .worlds import load_world

__all__ = ["add_lidar_beam", "explain_lidar_beam"]


def add_lidar_beam(command: argparse.ArgumentParser) -> None:
    """Adds `--lidar`, `--firing`, `--frame`, `--beam-samples`, `--at`, and the lidar's pose."""
    lidar = command.add_argument_group("lidar")
    lidar.add_argument(
        "--lidar",
        metavar="NAME|FILE",
        help="explain a pulse of this lidar: a lidar's name in the world file, a device, or a calibration file",
    )
    lidar.add_argument("--firing", metavar="N", type=int, help="number of the pulse in the frame, from 0")
    lidar.add_argument(
        "--frame",
        metavar="N",
        type=int,
        default=0,
        help="number of the frame, for a scan pattern that does not repeat (default: 0); use --at for the time",
    )
    lidar.add_argument(
        "--beam-samples",
        metavar="N",
        type=int,
        help="rays per pulse: 1, 7, 19 or 37 (default: the lidar's setting)",
    )
    lidar.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="time of the world's video or animation, in seconds (default: no motion)",
    )
    add_lidar_pose(command)


def explain_lidar_beam(options: argparse.Namespace) -> bool:
    """Prints and draws the explanation of a pulse; returns False without `--lidar`.

    Raises `SettingsError` if `--firing` is missing or `--pixel` is also given, and the errors of `explain_beam`.
    """
    if options.lidar is None:
        if options.firing is not None:
            raise SettingsError("--firing requires --lidar NAME", code="missing_value")
        return False
    from ...explanation.lidar_beam import check_beam_figure, explain_beam
    from ...notices import collected

    if options.pixel is not None or options.of != "ray":
        raise SettingsError("--lidar cannot be combined with --pixel or --of", code="conflicting_values")
    if options.firing is None:
        raise SettingsError("--lidar requires --firing N", code="missing_value")
    if options.figure is not None:
        check_beam_figure(options.figure)
    world = load_world(options)
    if options.at is not None:
        world = world.at(options.at)
    settings = {} if options.beam_samples is None else {"beam_samples": options.beam_samples}
    with collected() as notices:
        explained = explain_beam(
            world, chosen_lidar(world, options, settings), options.firing, frame=options.frame
        )
    print_notices(notices)
    print(explained)
    if options.figure is not None:
        explained.save_figure(options.figure)
        print(f"\n{options.figure}: figure")
    return True
