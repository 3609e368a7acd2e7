"""Unpacks ZIP archives within limits, and never outside of their folder."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from ..errors import Error, SettingsError

__all__ = ["MAX_DEPTH", "check_name", "unpack"]

MAX_DEPTH = 16
"""The largest number of parts of a path."""
MAX_PART_BYTES = 255
"""The longest name of a file or folder in a path, as UTF-8."""


def check_name(name: str) -> str:
    """Returns a name as a relative path.

    Raises `SettingsError` for a name that could leave its folder.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    is_bad = (
        not parts
        or len(parts) > MAX_DEPTH
        or any(part in ("..", "/") or ":" in part for part in parts)
        or any(len(part.encode("utf-8", "surrogatepass")) > MAX_PART_BYTES for part in parts)
        or any(not letter.isprintable() for letter in name)
    )
    if is_bad:
        raise SettingsError(
            f"{name[:80]!r} cannot be used as a file name; expected a relative path without .., colons and control "
            f"characters, with at most {MAX_DEPTH} parts of at most {MAX_PART_BYTES} bytes",
            code="invalid_value",
        )
    return "/".join(parts)


def unpack(
    archive: Path, folder: Path, check: Callable[[str, int], None], endings: tuple[str, ...]
) -> list[str]:
    """Unpacks the files of an archive with known endings to a folder; returns their names.

    `check` is called with the name and size of each file before anything is written. Raises its errors, and
    `SettingsError` for a damaged archive.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            entries = [
                (check_name(each.filename), each)
                for each in opened.infolist()
                if not each.is_dir() and each.filename.lower().endswith(endings)
            ]
            for name, entry in entries:
                check(name, entry.file_size)
            for name, entry in entries:
                path = folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                with opened.open(entry) as packed, path.open("wb") as file:
                    file.write(packed.read(entry.file_size + 1)[: entry.file_size])
    except Error:
        raise
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError, OSError) as error:
        raise SettingsError(
            f"{archive.name}: cannot unpack this archive ({error})", code="file_unreadable"
        ) from None
    return [name for name, _ in entries]
