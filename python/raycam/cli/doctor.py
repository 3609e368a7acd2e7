"""The command `raycam doctor`."""

from __future__ import annotations

import argparse

from .options.command import Command


def _add(command: argparse.ArgumentParser) -> None:
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..doctor import doctor

    print(doctor())


COMMAND = Command(
    _add,
    "show versions, processor and threads, and render a test image",
    [
        "raycam doctor",
    ],
)
