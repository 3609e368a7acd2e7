"""Notices as warnings: what raycam has to say without stopping reaches the line that asked for it."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType

from .errors import Notice

__all__ = ["collected", "distinct", "strict", "warn", "warn_all"]

_COLLECTED: ContextVar[list[str] | None] = ContextVar("collected", default=None)
_NUMBER = re.compile(r"(?<![\w.,:/\\-])\d[\d.,]*(?:e[+-]?\d+)?(?![\w/\\-])")
"""A number that stands as a word of its own: a count, not a part of a name."""


@contextmanager
def strict() -> Iterator[None]:
    """Context in which notices are errors: a `raycam.Notice` is raised where it would have been warned.

        with raycam.strict():
            world = raycam.load("room.toml")  # raises raycam.Notice if anything was left out or assumed

    It sets the filters of `warnings`, so it is for the whole process while it lasts, like `warnings.catch_warnings`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        yield


@contextmanager
def collected() -> Iterator[list[str]]:
    """Context in which notices are not warned but added to the list that it yields, to be passed on."""
    found: list[str] = []
    token = _COLLECTED.set(found)
    try:
        yield found
    finally:
        _COLLECTED.reset(token)


def warn_all(notices: Iterable[str]) -> None:
    """Warns of each distinct notice."""
    for notice in distinct(notices):
        warn(notice)


def warn(notice: str) -> None:
    """Warns of a notice, at the line outside of raycam that led here, once for each cause and line.

    Two notices have the same cause if they differ in counts alone. The filters of `warnings` decide, as for any
    warning: shown once, always, never, or raised.
    """
    found = _COLLECTED.get()
    if found is not None:
        found.append(notice)
        return
    frame = _asking_frame()
    registry = frame.f_globals.setdefault("__warningregistry__", {})
    line = frame.f_lineno
    key, mark = (notice, Notice, line), ("raycam", cause(notice), line)
    if registry.get(mark):
        registry[key] = 1  # warnings forgets both when the filters change
    warnings.warn_explicit(
        notice,
        Notice,
        frame.f_code.co_filename,
        line,
        module=frame.f_globals.get("__name__") or "<unknown>",
        registry=registry,
    )
    if registry.get(key):
        registry[mark] = 1


def distinct(notices: Iterable[str]) -> list[str]:
    """The first notice of each cause, in order."""
    found: dict[str, str] = {}
    for notice in notices:
        found.setdefault(cause(notice), notice)
    return list(found.values())


def cause(notice: str) -> str:
    """The notice without its counts."""
    return _NUMBER.sub("#", notice)


def _asking_frame() -> FrameType:
    """The innermost frame outside of this package, or else the outermost."""
    passed = {__name__.partition(".")[0], "contextlib"}  # decorators and context managers of ours
    frame = sys._getframe(1)
    while frame.f_back is not None:
        name = frame.f_globals.get("__name__") or ""
        if name.partition(".")[0] not in passed:
            break
        frame = frame.f_back
    return frame
