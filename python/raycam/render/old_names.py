"""Names that render options had before 0.1, understood until 0.2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import SettingsError
from ..notices import warn

__all__ = ["OLD_NAMES", "current_names"]

OLD_NAMES = {"noise": "noise_threshold", "time": "time_limit", "transparent": "transparent_background"}


def current_names(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The settings under the names of today, with a `Notice` for each old name.

    Raises `SettingsError` for an option given under both names.
    """
    renamed = dict(settings)
    for old, new in OLD_NAMES.items():
        if old not in renamed:
            continue
        value = renamed.pop(old)
        if renamed.get(new) is not None:
            raise SettingsError(f"{old} and {new} are given, two names of one option: give {new}")
        warn(f"{old} is called {new} now; the old name is understood until 0.2")
        renamed[new] = value
    return renamed
