"""Short texts: one-line reprs of objects that contain arrays, and counted nouns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

__all__ = ["counted", "one_line"]

T = TypeVar("T", bound=type)
MAX_NUMBERS = 4
"""Largest array that is shown with its numbers."""
MAX_TEXT = 80
"""Maximum number of characters for values other than arrays."""


def one_line(cls: T) -> T:
    """Gives a dataclass a `repr` in one line.

    Arrays appear as their dtype and shape; fields with their default value are omitted.
    """
    cls.__repr__ = _describe  # type: ignore[assignment]
    return cls


def counted(number: int, noun: str) -> str:
    """The number and its noun, such as "1 camera" or "0 cameras"; plurals end with s."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _describe(holder: Any) -> str:
    shown = []
    for field in fields(holder):
        value = getattr(holder, field.name)
        if field.name.startswith("_") or not field.repr or (value is field.default):
            continue
        shown.append(f"{field.name}={_shorten(value)}")
    return f"{type(holder).__name__}({', '.join(shown)})"


def _shorten(value: Any) -> str:
    """The value in a few words, without line breaks."""
    if isinstance(value, np.ndarray):
        if value.size <= MAX_NUMBERS and value.ndim <= 1:
            return "[" + ", ".join(f"{number:.6g}" for number in value.tolist()) + "]"
        return f"{value.dtype}{list(value.shape)}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_shorten(one)}" for key, one in value.items()) + "}"
    if isinstance(value, tuple | list) and len(value) > MAX_NUMBERS:
        return f"{len(value)} items"
    text = " ".join(repr(value).split())
    return text if len(text) <= MAX_TEXT else f"{text[: MAX_TEXT - 3]}..."
