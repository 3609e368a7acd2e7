"""Waiting for events, so that no test depends on the speed of a busy machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PATIENCE = 300.0
"""Seconds after which a test that waits for an event has failed. Nothing but a fault takes so long."""


def until(condition: Callable[[], object], what: str = "it never was so") -> None:
    """Waits until a condition is true."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


def once_at_work(deed: Callable[[], object], seconds: float = 0.3) -> threading.Thread:
    """Calls a function from a new thread after some processor time, and returns the thread.

    `seconds` is processor time of this process, which does not depend on the load of the machine.
    """
    start = time.process_time()

    def wait() -> None:
        until(lambda: time.process_time() - start > seconds, "nothing was computed")
        deed()

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    return thread
