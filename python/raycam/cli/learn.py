"""The command `raycam learn`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options.command import Command


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "folder",
        metavar="DIR",
        nargs="?",
        default="raycam-lecture",
        help="folder to write (default: raycam-lecture)",
    )
    command.add_argument("--no-open", action="store_true", help="write the files without opening the browser")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    import webbrowser

    from ..lecture.learn import write_lecture

    written = write_lecture(Path(options.folder))
    for path in written:
        print(path)
    if not options.no_open:
        webbrowser.open(written[0].resolve().as_uri())


COMMAND = Command(
    _add,
    "open the interactive lecture on cameras and ray tracing, with exercises and notebooks",
    [
        "raycam learn",
        "raycam learn course --no-open",
    ],
)
