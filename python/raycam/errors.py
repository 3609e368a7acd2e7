"""Exceptions of raycam, by cause.

A missing file raises `FileNotFoundError`, and other faults of the file system raise their own `OSError`, as
everywhere in Python. All other exceptions are subclasses of `Error`, and most are also subclasses of `ValueError`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

__all__ = [
    "CameraError",
    "Cancelled",
    "Error",
    "FormatError",
    "JobError",
    "LidarError",
    "NetworkError",
    "Notice",
    "SettingsError",
    "WorldError",
    "nearest",
    "with_code",
]


class Error(Exception):
    """Base class of the errors that raycam raises itself.

    `code` is the kind of error as a short name; `raycam.codes.ERRORS` lists the cause and the remedy of each
    code. Programs should use the class and the code, because messages may change.
    """

    code = "internal"

    def __init__(self, *args: object, code: str | None = None) -> None:
        super().__init__(*args)
        if code is not None:
            self.code = code


class Notice(UserWarning):
    """A warning about something that was assumed, changed or omitted.

    The filters of `warnings` apply to notices. `code` is the kind of notice as a short name;
    `raycam.codes.NOTICES` lists the cause and the remedy of each code. Programs should use the code, because messages
    may change. `subjects` lists up to three of the `count` subjects of the notice. `subjects` is empty if the
    message itself names them. `str(notice)` is the whole text.
    """

    def __init__(
        self, message: str, code: str, subjects: Iterable[str] = (), count: int | None = None
    ) -> None:
        self.code = code
        self.message = message
        self.subjects = tuple(subjects)
        self.count = len(self.subjects) if count is None else count
        more = self.count - len(self.subjects)
        others = f" and {more} more" if more > 0 else ""
        super().__init__(f"{', '.join(self.subjects)}{others}: {message}" if self.subjects else message)

    def in_context(self, place: str) -> Notice:
        """Returns the notice with `place` and a colon in front of its first subject.

        Without subjects, `place` and the colon are in front of the message.
        """
        if not self.subjects:
            return Notice(f"{place}: {self.message}", self.code)
        first, *others = self.subjects
        return Notice(self.message, self.code, [f"{place}: {first}", *others], self.count)

    def to_json(self) -> dict[str, Any]:
        """Returns the arguments of `Notice` as JSON values."""
        return {
            "message": self.message,
            "code": self.code,
            "subjects": list(self.subjects),
            "count": self.count,
        }

    def __reduce__(self) -> tuple[type[Notice], tuple[str, str, tuple[str, ...], int]]:
        """Pickles the arguments."""
        return Notice, (self.message, self.code, self.subjects, self.count)

    def __eq__(self, other: object) -> bool:
        """True for a notice with the same code and text."""
        if not isinstance(other, Notice):
            return NotImplemented
        return (self.code, str(self)) == (other.code, str(other))

    def __hash__(self) -> int:
        """Equal notices have equal hashes."""
        return hash((self.code, str(self)))


class Cancelled(Error):
    """A call was cancelled with `Cancel.cancel`."""

    code = "cancelled"


class WorldError(Error, ValueError):
    """An invalid world, or an invalid description of a world in a file or dict.

    The error concerns the world's geometry, colours, materials or lights.
    """

    code = "invalid_world"


class CameraError(Error, ValueError):
    """An invalid camera."""

    code = "invalid_camera"


class LidarError(Error, ValueError):
    """An invalid lidar.

    Causes are an unknown device, an impossible pattern, or a calibration of another device.
    """

    code = "invalid_lidar"


class FormatError(Error, ValueError):
    """A malformed file, a file of an unknown format, or a file that exceeds a limit.

    Limits are, for example, limits of memory or time.
    """

    code = "syntax"


class JobError(Error, RuntimeError):
    """A job that cannot continue, or that has failed frames."""

    code = "invalid_job"


class SettingsError(Error, ValueError):
    """Invalid settings or arrays."""

    code = "invalid_settings"


class NetworkError(Error, OSError):
    """A network connection that cannot be opened, or that was lost.

    `errno` is set if the system reports an error number.
    """

    code = "cluster_unreachable"


def with_code(error: OSError) -> OSError:
    """Sets the `code` of a file's error, and returns the error.

    The code is "file_not_found" or "file_unreadable".
    """
    vars(error)["code"] = "file_not_found" if isinstance(error, FileNotFoundError) else "file_unreadable"
    return error


def nearest(what: str, given: object, valid: list[str]) -> str:
    """Returns the message for an unknown name.

    The message contains the most similar valid name and a list of all valid names.
    """
    import difflib

    from ._core import names_for_foreign_term

    names, typed = {name.lower(): name for name in valid}, str(given).lower()
    meant = names_for_foreign_term(typed, valid)
    meant = meant or [names[name] for name in difflib.get_close_matches(typed, names, n=1)]
    meant = meant or [name for name in valid if typed and name.lower().startswith(typed)]
    guess = f"; did you mean {' or '.join(map(repr, meant))}?" if meant else ""
    return f"unknown {what} {given!r}{guess} (available: {', '.join(valid) or 'none'})"
