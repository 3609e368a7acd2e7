"""The type of commands, and parsers of option values that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import NamedTuple

__all__ = ["Command", "option_names", "parse_region", "parse_seconds", "parse_size"]

SECONDS_PER_UNIT = {"s": 1.0, "m": 60.0, "h": 3600.0}


class Command(NamedTuple):
    """One command: a row of `COMMANDS`."""

    add: Callable[[argparse.ArgumentParser], None]
    """Adds the command's options, and its function as the default of `run`."""
    help: str
    """One line of help."""
    examples: Sequence[str]
    """Example command lines, with their results."""


def option_names(command: argparse.ArgumentParser) -> list[str]:
    """Returns the options of a command, as they are typed."""
    return [option for action in command._actions for option in action.option_strings]


def parse_size(text: str) -> tuple[int, int]:
    """Parses "640x480" or "640,480" as (width, height)."""
    width, _, height = text.lower().replace(",", "x").partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, as in 640x480, got {text!r}") from None


def parse_seconds(text: str) -> float:
    """Parses "30", "30s", "5m" or "1h" as seconds."""
    factor = SECONDS_PER_UNIT.get(text[-1:])
    try:
        return float(text) if factor is None else float(text[:-1]) * factor
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a time, as in 30s or 5m, got {text!r}") from None


def parse_region(text: str) -> tuple[int, ...]:
    """Parses "0,0,320,240" as whole numbers."""
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected X,Y,WIDTH,HEIGHT, as in 0,0,320,240, got {text!r}"
        ) from None
