"""Exceptions of raycam, by cause.

A missing file is a `FileNotFoundError`, and every other fault of the file system is its own `OSError`, as
everywhere in Python. The rest are subclasses of `Error`, and of `ValueError`.
"""

from __future__ import annotations

__all__ = [
    "CameraError",
    "Cancelled",
    "Error",
    "FormatError",
    "JobError",
    "LidarError",
    "Notice",
    "SettingsError",
    "WorldError",
    "nearest",
]


class Error(Exception):
    """Base class of the errors that raycam raises itself."""


class Notice(UserWarning):
    """The category of what raycam has to say without stopping; the filters of `warnings` apply."""


class Cancelled(Error):
    """A call that `Cancel.cancel` has ended."""


class WorldError(Error, ValueError):
    """An invalid world: its geometry, colours, materials or lights, or their description in a file or dict."""


class CameraError(Error, ValueError):
    """An invalid camera."""


class LidarError(Error, ValueError):
    """An invalid lidar: an unknown device, an impossible pattern, or a calibration of another device."""


class FormatError(Error, ValueError):
    """A malformed file, one that exceeds the budget, or one of an unknown format."""


class JobError(Error, RuntimeError):
    """A job that cannot continue, or that has failed frames."""


class SettingsError(Error, ValueError):
    """Invalid settings or arrays."""


def nearest(what: str, given: object, valid: list[str]) -> str:
    """Returns the message for an unknown name: the valid name that it means or resembles, and all valid names."""
    import difflib

    from ._core import names_for_foreign_term

    names, typed = {name.lower(): name for name in valid}, str(given).lower()
    meant = names_for_foreign_term(typed, valid)
    meant = meant or [names[name] for name in difflib.get_close_matches(typed, names, n=1)]
    meant = meant or [name for name in valid if typed and name.lower().startswith(typed)]
    guess = f"; did you mean {' or '.join(map(repr, meant))}?" if meant else ""
    return f"unknown {what} {given!r}{guess} (there are: {', '.join(valid) or 'none'})"
