"""The command `raycam doctor`."""

from __future__ import annotations

import argparse

from ._options import Command


def _add(command: argparse.ArgumentParser) -> None:
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..doctor import doctor

    print(doctor())


COMMAND = Command(
    _add,
    "show versions, processor and threads, and test a picture",
    [
        "raycam doctor",
    ],
)
