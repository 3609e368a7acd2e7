"""Fixtures of all tests."""

import importlib.util
import signal

import pytest

# A shell that starts the tests in the background ignores Ctrl-C for them and their child processes, but some tests
# send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Hypothesis limits an example to 200 ms, which a busy machine may exceed.
if importlib.util.find_spec("hypothesis") is not None:
    from hypothesis import HealthCheck, settings

    settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("any machine")


def pytest_configure(config: pytest.Config) -> None:
    """Makes warnings errors, except notices: tests that expect notices use `pytest.warns`."""
    if importlib.util.find_spec("raycam") is not None:
        config.addinivalue_line("filterwarnings", "ignore::raycam.Notice")
