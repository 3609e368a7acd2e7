"""The options `--quiet` and `--verbose`, and the printing of notices."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable

from ...errors import Notice

ARGUMENTS_AS_TYPED = {
    r"\bresume=False\b": "--no-resume",
    r"\bretry_failed=True\b": "--retry-failed",
    r"\bshard=\(I, N\)": "--shard I/N",
    r"\bexposure=(-?[\d.]+)": r"--exposure=\1",
    r'\borientation="(\w+)"': r"--orientation \1",
}
"""Arguments of Python functions in messages, and the options to type instead."""

__all__ = [
    "add_verbosity",
    "as_typed",
    "is_verbose",
    "print_detail",
    "print_notice",
    "print_notices",
    "print_result",
    "reset_messages",
    "set_verbosity",
]

PRINTED_NOTICES: set[str] = set()
"""The notices that this command has printed."""
VERBOSITY = {"quiet": False, "verbose": False}
"""The options `--quiet` and `--verbose` of this command."""


def add_verbosity(command: argparse.ArgumentParser) -> None:
    """Adds `--quiet` and `--verbose`."""
    group = command.add_argument_group("messages")
    either = group.add_mutually_exclusive_group()
    either.add_argument("--quiet", action="store_true", help="print only errors and requested results")
    either.add_argument(
        "--verbose", action="store_true", help="print settings and times, and a traceback if an error occurs"
    )


def set_verbosity(quiet: bool, verbose: bool) -> None:
    """Sets the amount of output of this command."""
    from ... import progress

    VERBOSITY.update(quiet=quiet, verbose=verbose)
    progress.SHOWN = not quiet


def reset_messages() -> None:
    """Clears the printed notices and the verbosity of this process's previous command."""
    PRINTED_NOTICES.clear()
    set_verbosity(quiet=False, verbose=False)


def is_verbose() -> bool:
    """True if `--verbose` is given."""
    return VERBOSITY["verbose"]


def print_result(text: str) -> None:
    """Prints the line that names a written file, unless `--quiet` is given."""
    if not VERBOSITY["quiet"]:
        print(text)


def print_detail(text: str) -> None:
    """Prints a line on stderr if `--verbose` is given."""
    if VERBOSITY["verbose"]:
        print(f"raycam: {text}", file=sys.stderr, flush=True)


def print_notices(notices: Iterable[Notice | str]) -> None:
    """Prints notices on stderr, one per line."""
    for notice in notices:
        print_notice(notice)


def print_notice(notice: Notice | str) -> None:
    """Prints a notice on stderr at once, unless this command has printed it before."""
    if str(notice) not in PRINTED_NOTICES:
        PRINTED_NOTICES.add(str(notice))
        if not VERBOSITY["quiet"]:
            print(f"raycam: notice: {as_typed(str(notice))}", file=sys.stderr, flush=True)


def as_typed(message: str) -> str:
    """Returns a message with the options of the command line instead of Python's arguments."""
    for argument, option in ARGUMENTS_AS_TYPED.items():
        message = re.sub(argument, option, message)
    return message
