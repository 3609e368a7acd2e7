"""Backgrounds of randomised worlds, drawn at random from a folder of images."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..camera import Background
from ..camera._background import Fit
from ..errors import CameraError, WorldError
from .draws import RandomStream, check_known_keys

__all__ = ["BackgroundFolder"]

ENDINGS = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")


class BackgroundFolder:
    """A folder of images, from which each camera of each world gets a random background.

    `given` is the value of the key `background` of a recipe that is in `folder`. It is the name of a subfolder of
    `folder`, or a table {folder, fit}. With `fit = "cover"` (default), images are cropped to the frame. Subfolders are
    searched too.

    Raises `WorldError` for unknown keys, a folder outside `folder`, and a folder without images.
    """

    def __init__(self, given: Any, folder: Path) -> None:
        table = {"folder": given} if isinstance(given, str) else given
        if not isinstance(table, Mapping):
            raise WorldError(
                f"background must be the name of a folder or a table, not {given!r}", code="wrong_type"
            )
        check_known_keys("background", table, ("folder", "fit"))
        name = table.get("folder")
        fit: Any = table.get("fit", "cover")
        if not isinstance(name, str):
            raise WorldError(
                f"background.folder must be the name of a folder, not {name!r}", code="wrong_type"
            )
        try:
            Background("", fit=fit)
        except CameraError as fault:
            raise WorldError(f"background.{fault}", code=fault.code) from None
        self.name = name
        """The name of the folder in the recipe."""
        self._fit: Fit = fit
        self._root = (folder / name).resolve()
        if not self._root.is_relative_to(folder.resolve()):
            raise WorldError(
                f"background.folder = {name!r} is not in the recipe's folder; only files in it are opened",
                code="outside_root",
            )
        if not self._root.is_dir():
            raise WorldError(
                f"background.folder = {name!r}: folder not found in {folder}", code="unknown_name"
            )
        paths = (path for path in self._root.rglob("*") if path.suffix.lower() in ENDINGS)
        inside = [
            path for path in paths if path.is_file() and path.resolve().is_relative_to(folder.resolve())
        ]
        self.files = sorted(path.relative_to(self._root).as_posix() for path in inside)
        """The names of the images in the folder, sorted."""
        if not self.files:
            raise WorldError(
                f"background.folder = {name!r} contains no images; expected {', '.join(ENDINGS)}",
                code="missing_value",
            )

    @property
    def stamp(self) -> str:
        """The SHA-256 of the images' names and sizes."""
        sizes = (f"{name} {(self._root / name).stat().st_size}\n" for name in self.files)
        return hashlib.sha256("".join(sizes).encode()).hexdigest()

    def name_of(self, draw: RandomStream) -> str:
        """Returns the name of the image that a random stream selects."""
        return self.files[draw.integer(0, len(self.files) - 1)]

    def background(self, draw: RandomStream) -> Background:
        """Returns the background that a random stream selects."""
        return Background(str(self._root / self.name_of(draw)), fit=self._fit)
