"""Forks wait while worlds are built, so that the child process has no incomplete world and no locked mutex."""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["no_fork"]

_changed = threading.Condition()
_inside: Counter[int] = Counter()
"""The depth of `no_fork` by thread."""


@contextmanager
def no_fork() -> Iterator[None]:
    """Context in which `os.fork` of other threads waits."""
    me = threading.get_ident()
    with _changed:
        _inside[me] += 1
    try:
        yield
    finally:
        with _changed:
            _inside[me] -= 1
            if not _inside[me]:
                del _inside[me]
            _changed.notify_all()


def _before() -> None:
    me = threading.get_ident()
    _changed.acquire()
    while any(thread != me for thread in _inside):
        _changed.wait()


def _in_parent() -> None:
    _changed.release()


def _in_child() -> None:
    global _changed
    _changed = threading.Condition()  # the other threads are gone
    me = threading.get_ident()
    for thread in [thread for thread in _inside if thread != me]:
        del _inside[thread]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before, after_in_parent=_in_parent, after_in_child=_in_child)
