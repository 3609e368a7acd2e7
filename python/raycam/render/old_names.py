"""Names that render options had before 0.1, understood until 0.2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import Notice, SettingsError
from ..notices import warn

__all__ = ["ELSEWHERE", "OLD_NAMES", "current_names"]

OLD_NAMES = {"noise": "noise_threshold", "time": "time_limit", "transparent": "transparent_background"}

SIZE = "the size is the camera's: world.default_camera((640, 480)), world.view_from(size=...), camera.resized(...)"
ELSEWHERE = {
    **dict.fromkeys(("size", "resolution", "width", "height"), SIZE),
    **dict.fromkeys(("spp", "sample_count", "num_samples"), "the number of rays per pixel is samples"),
    **dict.fromkeys(("light", "lights"), "lights are the world's: world.add_light(...)"),
    "background_color": "background=color",
    "output": "frame.save(path) writes the picture",
}
"""Options of rendering in other programs, and their place here."""


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
        warn(Notice(f"{old} is called {new} now; the old name is understood until 0.2", "foreign_name"))
        renamed[new] = value
    return renamed
