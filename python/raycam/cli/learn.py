"""The command `raycam learn`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options.command import Command

DEFAULT_FILE = "raycam-lecture.html"


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "file",
        metavar="FILE",
        nargs="?",
        default=DEFAULT_FILE,
        help=f"output page (default: {DEFAULT_FILE})",
    )
    command.add_argument("--no-open", action="store_true", help="write the page without opening a browser")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    import webbrowser

    from ..viewer.web.live_page import lecture_page

    path = Path(options.file)
    path.write_text(lecture_page(), encoding="utf-8")
    print(path)
    if not options.no_open:
        webbrowser.open(path.resolve().as_uri())


COMMAND = Command(
    _add,
    "write the interactive lecture as one page, and open it",
    [
        "raycam learn",
        "raycam learn lecture.html --no-open",
    ],
)
