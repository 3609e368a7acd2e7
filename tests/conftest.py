"""Fixtures of all tests."""

import importlib.util
import signal

import pytest

# A shell that starts the tests in the background has Ctrl-C ignored, by them and by all that they start. Some of them
# press it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Hypothesis counts 200 ms for an example, and a busy machine may take longer for any of them.
if importlib.util.find_spec("hypothesis") is not None:
    from hypothesis import HealthCheck, settings

    settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("any machine")


def pytest_configure(config: pytest.Config) -> None:
    """Warnings are errors, but notices are not: tests that mean them ask for them by `pytest.warns`."""
    if importlib.util.find_spec("raycam") is not None:
        config.addinivalue_line("filterwarnings", "ignore::raycam.Notice")
