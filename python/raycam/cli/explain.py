"""The command `raycam explain`."""

from __future__ import annotations

import argparse

from .options.cameras import add_camera
from .options.command import Command
from .options.framing import find_camera
from .options.lidar_beam import add_lidar_beam, explain_lidar_beam
from .options.worlds import add_world, load_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "--pixel",
        metavar=("U", "V"),
        nargs=2,
        type=int,
        help="column and row of the pixel; 0 0 is at the top left",
    )
    command.add_argument(
        "--figure",
        metavar="FILE",
        help="also draw the explanation: .svg, .html (a page whose figures can be rotated), .png or .pdf",
    )
    command.add_argument(
        "--of",
        metavar="SUBJECT",
        default="ray",
        help="subject: ray (default), light (the light that reaches the pixel) or tree (the search tree)",
    )
    add_camera(command)
    add_lidar_beam(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..errors import SettingsError
    from ..explanation import SUBJECTS, check_figure, explain

    if explain_lidar_beam(options):
        return
    if options.pixel is None:
        raise SettingsError("expected --pixel U V, or --lidar NAME --firing N", code="missing_value")
    if options.of not in SUBJECTS:
        raise SettingsError(f"--of {options.of}: expected {', '.join(SUBJECTS)}", code="invalid_value")
    if options.figure is not None:
        check_figure(options.figure)
    world = load_world(options)
    explanation = explain(world, find_camera(world, options), options.pixel)
    if options.of == "light":
        print(explanation.lighting(), explanation.light_path(), sep="\n\n")
    else:
        print(explanation.tree() if options.of == "tree" else explanation)
    if options.figure is not None:
        explanation.save_figure(options.figure, options.of)
        print(f"\n{options.figure}: figure")


COMMAND = Command(
    _add,
    "explain step by step how the colour of a pixel, or the points of a lidar's pulse, are computed",
    [
        "raycam explain room.toml --pixel 320 240",
        "raycam explain room.toml --pixel 320 240 --figure explain.svg",
        "raycam explain room.toml --pixel 320 240 --figure explain.html",
        "raycam explain room.toml --pixel 320 240 --of light --figure light.svg",
        "raycam explain drive.toml --lidar top --firing 1234 --figure beam.svg",
    ],
)
