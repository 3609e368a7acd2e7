"""Waiting for events: no test depends on how fast a busy machine gets to something."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PATIENCE = 300.0
"""Seconds after which a test that waits for an event has failed. Nothing but a fault takes so long."""


def until(condition: Callable[[], object], what: str = "it never was so") -> None:
    """Waits until something is so."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


def once_at_work(deed: Callable[[], object], seconds: float = 0.3) -> threading.Thread:
    """Does something from a thread as soon as this process has computed for so many seconds of processor time, which
    a busy machine does not shorten; returns the thread, which has begun."""
    start = time.process_time()

    def wait() -> None:
        until(lambda: time.process_time() - start > seconds, "nothing was computed")
        deed()

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    return thread
