"""Notices as warnings at the caller's line, grouped by cause."""

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

_COLLECTED: ContextVar[list[Notice] | None] = ContextVar("collected", default=None)
MAX_SUBJECTS = 3
"""Maximum number of subjects that a group of notices lists; further subjects are only counted."""
_NUMBER = re.compile(r"(?<![\w.,:/\\-])\d[\d.,]*(?:e[+-]?\d+)?(?![\w/\\-])")
"""Matches a number that is a separate word, such as a count, but not a part of a name."""


@contextmanager
def strict() -> Iterator[None]:
    """Context in which notices are errors: a `raycam.Notice` is raised instead of warned.

        with raycam.strict():
            world = raycam.load("room.toml")  # raises raycam.Notice if anything was omitted or assumed

    Like `warnings.catch_warnings`, this context changes the warning filters of the whole process.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        yield


@contextmanager
def collected() -> Iterator[list[Notice]]:
    """Context that yields a list and collects notices in it, instead of issuing warnings.

    Equal notices are collected once.
    """
    found: list[Notice] = []
    token = _COLLECTED.set(found)
    try:
        yield found
    finally:
        _COLLECTED.reset(token)


def warn_all(notices: Iterable[Notice]) -> None:
    """Issues one warning for each group of notices that differ only in numbers."""
    for notice in distinct(notices):
        warn(notice)


def warn(notice: Notice) -> None:
    """Issues a notice as a warning at the caller's line outside raycam.

    A notice is issued once for each cause and line. Two notices have the same cause if they have the same code and
    their messages differ only in numbers. As for any warning, the filters of `warnings` determine whether the notice
    is shown once, always or never, or raised.
    """
    found = _COLLECTED.get()
    if found is not None:
        if notice not in found:
            found.append(notice)
        return
    frame = _asking_frame()
    registry = frame.f_globals.setdefault("__warningregistry__", {})
    line = frame.f_lineno
    key, mark = (str(notice), Notice, line), ("raycam", notice.code, cause(str(notice)), line)
    if registry.get(mark):
        registry[key] = 1  # `warnings` clears the registry when its filters change
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


def distinct(notices: Iterable[Notice]) -> list[Notice]:
    """Returns one notice for each group of notices that differ only in numbers.

    The notices of a group have the same code. Groups are in the order of their first notices. A group's notice has the
    first message, the first three subjects and the total number of subjects.
    """
    groups: dict[tuple[str, str, bool], list[Notice]] = {}
    for notice in notices:
        group = groups.setdefault((notice.code, cause(notice.message), bool(notice.subjects)), [])
        if notice not in group:
            group.append(notice)
    return [_merged(group) for group in groups.values()]


def _merged(group: list[Notice]) -> Notice:
    first = group[0]
    if len(group) == 1 or not first.subjects:
        return first
    subjects = [subject for notice in group for subject in notice.subjects]
    return Notice(first.message, first.code, subjects[:MAX_SUBJECTS], sum(notice.count for notice in group))


def cause(text: str) -> str:
    """Returns the text with every number replaced by "#"."""
    return _NUMBER.sub("#", text)


def _asking_frame() -> FrameType:
    """The innermost stack frame outside of this package, or otherwise the outermost frame."""
    passed = {__name__.partition(".")[0], "contextlib"}  # raycam's own decorators and context managers
    frame = sys._getframe(1)
    while frame.f_back is not None:
        name = frame.f_globals.get("__name__") or ""
        if name.partition(".")[0] not in passed:
            break
        frame = frame.f_back
    return frame
