"""Errors with remedies for missing files, and for recipes passed as worlds.

The remedy for a missing file contains the nearest names.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
from collections.abc import Iterator
from pathlib import Path

from ..errors import WorldError, with_code
from ..io.text_files import decode_text
from .endings import MODEL_ENDINGS

__all__ = ["check_exists", "nearest_names", "recipe_named"]

SHOWN = 3
ADDRESS = re.compile(r"[a-z][a-z0-9+.-]+:/", re.I)
"""The start of an address, such as `https://`; pathlib removes one of the slashes."""
DRAWS = re.compile(r"^\s*(see|on|gap|count|see\.\w+)\s*=|\{\s*(uniform|log_uniform|integer|choice)\s*=", re.M)
"""Keys and random draws that occur in recipes but not in worlds."""


def check_exists(path: str | os.PathLike[str]) -> None:
    """Raises `FileNotFoundError` for a missing file, `IsADirectoryError` for a folder.

    The error for a missing file contains the nearest names of models in its folder; the error for a folder contains the
    names of models in the folder.
    """
    if os.path.isdir(path):
        raise with_code(
            IsADirectoryError(
                errno.EISDIR, f"a folder, expected a world or model{_hint(Path(path, '-'))}", os.fspath(path)
            )
        )
    if os.path.exists(path):
        return
    if os.path.islink(path):
        target = os.readlink(path)
        way = "; to download it, run git annex get" if "annex/objects" in target else ""
        raise with_code(
            FileNotFoundError(
                errno.ENOENT, f"a symbolic link to {target}, which does not exist{way}", os.fspath(path)
            )
        )
    if ADDRESS.match(os.fspath(path)):
        text = "addresses are not supported; download the file if necessary, and use its path"
        raise with_code(FileNotFoundError(errno.ENOENT, text, os.fspath(path)))
    raise with_code(
        FileNotFoundError(errno.ENOENT, f"No such file or directory{_hint(Path(path))}", os.fspath(path))
    )


def nearest_names(path: str | os.PathLike[str]) -> str:
    """Returns the end of a message with names that resemble a missing file's name.

    The names are from the missing file's folder.
    """
    folder = Path(path).parent
    try:
        names = os.listdir(folder)
    except OSError:
        return ""
    close = _close(Path(path).name, names, cutoff=0.6)
    return _did_you_mean(folder, close) if close else ""


@contextlib.contextmanager
def recipe_named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Context that adds a remedy to the error of a world file that is a recipe."""
    try:
        yield
    except WorldError as error:
        if Path(path).suffix.lower() != ".toml" or not DRAWS.search(
            decode_text(Path(path).read_bytes(), "replace")
        ):
            raise
        raise WorldError(
            f"{error}; the file looks like a recipe for many worlds; use raycam.sample({os.fspath(path)!r}, 0), which "
            "returns one world, or, on the command line: raycam dataset RECIPE --sample 10 --format coco -o DIR",
            code=error.code,
        ) from None


def _hint(path: Path) -> str:
    """The nearest names of models, or the nearest existing folder, as the end of a message."""
    folder = path.parent
    if not folder.is_dir():
        there = next((parent for parent in folder.parents if parent.is_dir()), None)
        return "" if there is None else f"; there is no folder {folder}, only {there.absolute()}"
    try:
        names = sorted(name for name in os.listdir(folder) if Path(name).suffix.lower() in MODEL_ENDINGS)
    except OSError:
        return ""
    close = _close(path.name, names, cutoff=0.5)
    same = [name for name in names if Path(name).stem.lower() == path.stem.lower() and name not in close]
    found = [*same, *close][:SHOWN]
    if found:
        return _did_you_mean(folder, found)
    if names:
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        return f"; models and worlds in {folder.absolute()}: {', '.join(names[:SHOWN])}{more}"
    return f"; there are no models or worlds in {folder.absolute()}"


def _close(name: str, names: list[str], cutoff: float) -> list[str]:
    """The most similar names, ignoring case."""
    import difflib

    by_name = {each.lower(): each for each in names}
    return [
        by_name[each] for each in difflib.get_close_matches(name.lower(), by_name, n=SHOWN, cutoff=cutoff)
    ]


def _did_you_mean(folder: Path, names: list[str]) -> str:
    *first, last = (str(folder / name) for name in names)
    return f"; did you mean {', '.join(first)}{' or ' if first else ''}{last}?"
