"""Callbacks of scripts: functions and coroutine functions."""

from __future__ import annotations

import asyncio
import threading

import pytest
import raycam
from raycam.viewer.callbacks import callback
from support.raises import raises


def test_function_is_called_with_its_arguments() -> None:
    called: list[tuple[int, str]] = []
    callback(lambda number, text: called.append((number, text)))(1, "a")
    assert called == [(1, "a")]


def test_coroutine_function_runs_in_the_loop_of_its_registration() -> None:
    async def main() -> int:
        async def identify() -> int:
            return threading.get_ident()

        thread = await asyncio.to_thread(callback(identify))
        assert isinstance(thread, int)
        return thread

    assert asyncio.run(main()) == threading.get_ident()


def test_coroutine_function_without_a_loop_is_refused_with_its_name() -> None:
    async def measure() -> None:
        """Does nothing."""

    with raises(raycam.SettingsError, code="missing_value", mentions=["measure", "asyncio.run"]):
        callback(measure)


@pytest.mark.filterwarnings("error")
def test_function_that_returns_a_coroutine_is_refused_when_it_is_called() -> None:
    async def measure() -> None:
        """Does nothing."""

    with raises(raycam.SettingsError, code="wrong_type", mentions=["measure"]):
        callback(lambda: measure())()
