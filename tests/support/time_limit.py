"""A time limit for tests, so that a test which waits for an event cannot run for ever."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType

from .patience import PATIENCE

TEST_LIMIT_S = PATIENCE + 60.0
"""Time limit of a test in seconds: more than `PATIENCE`, so that a condition that never holds is reported first."""


@contextlib.contextmanager
def time_limit(seconds: float = TEST_LIMIT_S) -> Iterator[None]:
    """Raises `TimeoutError` in the main thread after `seconds`; has no effect on Windows."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def fail(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"the test took more than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
