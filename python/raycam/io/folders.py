"""The folder that contains all files which a file may refer to."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import SettingsError

__all__ = ["check_folder"]


def check_folder(path: str | os.PathLike[str], folder: str | os.PathLike[str]) -> None:
    """Raises `SettingsError` for a file outside a folder.

    A file is in the folder if its path, or the target of its links, is in the folder.
    """
    file, root = Path(path), Path(folder)
    if not any(resolved(file).is_relative_to(resolved(root)) for resolved in (Path.resolve, Path.absolute)):
        raise SettingsError(
            f"{path} is outside {os.fspath(folder)}; pass a folder= that contains it", code="outside_root"
        )
