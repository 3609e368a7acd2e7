"""Callbacks of scripts: functions, and coroutine functions in the script's event loop."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable
from typing import Any

from ..errors import SettingsError

__all__ = ["callback"]


def callback(function: Callable[..., object]) -> Callable[..., object]:
    """Returns a function that calls `function` from any thread, and waits for its result.

    A coroutine function runs in the event loop that is running when `callback` is called. An ordinary
    function must not return a coroutine: otherwise, the returned function raises `SettingsError`.

    Raises `SettingsError` for a coroutine function if no event loop is running.
    """
    if not inspect.iscoroutinefunction(function):
        return lambda *values: _without_coroutine(function(*values))
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        raise SettingsError(
            f"callback {_name_of(function)} is a coroutine function, but no event loop is running; add the callback "
            "within a coroutine that asyncio.run executes, or use a function without async",
            code="missing_value",
        ) from None
    return lambda *values: asyncio.run_coroutine_threadsafe(function(*values), loop).result()


def _without_coroutine(result: object) -> object:
    """Returns a function's result.

    Raises `SettingsError` for a coroutine, which would never be awaited.
    """
    if inspect.iscoroutine(result):
        result.close()
        raise SettingsError(
            f"the callback returned the coroutine {result.__name__}, which was not executed; use the coroutine "
            "function itself as the callback",
            code="wrong_type",
        )
    return result


def _name_of(function: Callable[..., object]) -> str:
    """The function's name, for messages."""
    name: Any = getattr(function, "__name__", None)
    return str(name or function)
