"""Delays forks while worlds are built.

Otherwise, the child process could have an incomplete world or a locked mutex.
"""

from __future__ import annotations

import os
import threading

__all__ = ["no_fork"]

_lock = threading.RLock()
_changed = threading.Condition(_lock)
_inside: list[int] = []
"""The ids of the threads in `no_fork`; a thread in nested contexts is listed once for each."""
_waits = False
"""True while a fork waits for other threads."""


class no_fork:
    """Context in which `os.fork` of other threads waits."""

    __slots__ = ()

    def __enter__(self) -> None:
        """Registers the thread."""
        with _lock:
            _inside.append(threading.get_ident())

    def __exit__(self, *raised: object) -> None:
        """Lets waiting forks continue when the thread has left all of its contexts."""
        _inside.remove(threading.get_ident())
        if _waits:
            with _lock:
                _changed.notify_all()


def _before() -> None:
    global _waits
    me = threading.get_ident()
    _lock.acquire()
    _waits = True
    while any(thread != me for thread in _inside):
        _changed.wait()
    _waits = False


def _in_parent() -> None:
    _lock.release()


def _in_child() -> None:
    global _lock, _changed
    _lock = threading.RLock()  # the child has no thread that could release the old lock
    _changed = threading.Condition(_lock)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_before, after_in_parent=_in_parent, after_in_child=_in_child)
