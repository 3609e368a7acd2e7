"""What can go wrong, by whose fault it is.

A missing file is a `FileNotFoundError`, and every other fault of the file system is its own `OSError`, as
everywhere in Python. The rest are subclasses of `Error`, and of `ValueError`.
"""

from __future__ import annotations

__all__ = ["CameraError", "Error", "FormatError", "JobError", "SettingsError", "WorldError", "nearest"]


class Error(Exception):
    """Anything that raycam itself complains about."""


class WorldError(Error, ValueError):
    """A world that cannot be: its geometry, colours, materials, lights, or its description in a file or dict."""


class CameraError(Error, ValueError):
    """A camera that cannot be."""


class FormatError(Error, ValueError):
    """A file that does not follow its format, asks for more than the budget allows, or is of an unknown kind."""


class JobError(Error, RuntimeError):
    """A job that cannot go on, or some of whose frames failed."""


class SettingsError(Error, ValueError):
    """Settings or arrays that no picture can be made from."""


def nearest(what: str, given: str, valid: list[str]) -> str:
    """The message for a name that does not exist: the nearest one that does, and all of them."""
    import difflib

    names = {name.lower(): name for name in valid}
    close = difflib.get_close_matches(given.lower(), names, n=1)
    guess = f"; did you mean {names[close[0]]!r}?" if close else ""
    return f"unknown {what} {given!r}{guess} (there are: {', '.join(valid) or 'none'})"
