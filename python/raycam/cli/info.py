"""`raycam info`."""

from __future__ import annotations

import argparse

from .options import Command, add_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..info import info
    from ..world import load

    print(info(load(options.world)))


COMMAND = Command(
    _add,
    "show what a world holds: counts, bounds, cameras",
    [
        "raycam info room.toml",
    ],
)
