"""Delays forks while worlds are built.

Otherwise, the child process could have an incomplete world or a locked mutex.
"""

from __future__ import annotations

import os
import threading
from collections import Counter

__all__ = ["no_fork"]

_lock = threading.RLock()
_changed = threading.Condition(_lock)
_inside: Counter[int] = Counter()
"""The depth of `no_fork` by thread."""


class no_fork:
    """Context in which `os.fork` of other threads waits."""

    __slots__ = ()

    def __enter__(self) -> None:
        """Registers the thread."""
        with _lock:
            _inside[threading.get_ident()] += 1

    def __exit__(self, *raised: object) -> None:
        """Lets waiting forks continue when the thread has left all of its contexts."""
        me = threading.get_ident()
        with _lock:
            _inside[me] -= 1
            if not _inside[me]:
                del _inside[me]
            _changed.notify_all()


def _before() -> None:
    me = threading.get_ident()
    _lock.acquire()
    while any(thread != me for thread in _inside):
        _changed.wait()


def _in_parent() -> None:
    _lock.release()


def _in_child() -> None:
    global _lock, _changed
    _lock = threading.RLock()  # threads that hold the old lock do not exist here
    _changed = threading.Condition(_lock)
    me = threading.get_ident()
    for thread in [thread for thread in _inside if thread != me]:
        del _inside[thread]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before, after_in_parent=_in_parent, after_in_child=_in_child)
