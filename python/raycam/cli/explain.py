"""The command `raycam explain`."""

from __future__ import annotations

import argparse

from ._options import Command, add_camera, add_world, load_world, view


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "--pixel",
        metavar=("U", "V"),
        nargs=2,
        type=int,
        required=True,
        help="column and row, from 0 at the top left",
    )
    command.add_argument("--figure", metavar="FILE", help="draw the explanation too: .svg, .png or .pdf")
    command.add_argument(
        "--of",
        metavar="SUBJECT",
        default="ray",
        help="the ray (default), the light that reaches the pixel, or the tree that is searched",
    )
    add_camera(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..errors import SettingsError
    from ..explanation import SUBJECTS, check_figure, explain

    if options.of not in SUBJECTS:
        raise SettingsError(f"--of {options.of}: expected {', '.join(SUBJECTS)}")
    if options.figure is not None:
        check_figure(options.figure)
    world = load_world(options)
    explanation = explain(world, view(world, options), options.pixel)
    if options.of == "light":
        print(explanation.lighting(), explanation.light_path(), sep="\n\n")
    else:
        print(explanation.tree() if options.of == "tree" else explanation)
    if options.figure is not None:
        explanation.save_figure(options.figure, options.of)
        print(f"\n{options.figure}: the figure")


COMMAND = Command(
    _add,
    "show every step that finds the colour of one pixel",
    [
        "raycam explain room.toml --pixel 320 240",
        "raycam explain room.toml --pixel 320 240 --figure explain.svg",
        "raycam explain room.toml --pixel 320 240 --of light --figure light.svg",
    ],
)
