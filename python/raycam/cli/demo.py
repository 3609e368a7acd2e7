"""The command `raycam demo`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options.command import Command


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "folder", metavar="DIR", nargs="?", default="raycam-demo", help="output folder (default: raycam-demo)"
    )
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..demo import demo

    demo(Path(options.folder), options.main)


COMMAND = Command(
    _add,
    "write a world, images of it and a video",
    [
        "raycam demo demo",
    ],
)
