"""The time limit of the viewer's tests."""

from __future__ import annotations

import signal
import threading

import pytest
from support.time_limit import TEST_LIMIT_S, time_limit

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="this system has no alarm signal")


def test_wait_without_end_is_interrupted() -> None:
    with pytest.raises(TimeoutError, match=r"0\.05 s"), time_limit(0.05):
        threading.Event().wait()


def test_every_viewer_test_has_a_time_limit() -> None:
    remaining, _ = signal.getitimer(signal.ITIMER_REAL)
    assert 0 < remaining <= TEST_LIMIT_S
