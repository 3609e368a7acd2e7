"""Images of a stage, copied from its folder or package.

Images are converted if an MTL file requires it.
"""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf

from .. import _core
from ..errors import FormatError, SettingsError
from .confinement import Confinement, UsdRejected, notice_code
from .image_search import found_elsewhere
from .image_values import Texels, level_values, look_up
from .notices import StageNotice

__all__ = ["Images", "bake_opacity", "bake_wrap"]

MOST_PIXELS = 1 << 26
"""Maximum number of pixels of a converted image."""


class Images:
    """The images of a stage, each copied into the folder once."""

    def __init__(self, confinement: Confinement, folder: Path) -> None:
        self.folder = folder
        self.files: dict[str, str] = {}
        """Original names of the images."""
        self.sizes: dict[str, tuple[int, int]] = {}
        """Width and height of the images whose pixels were read."""
        self.notices: list[StageNotice] = []
        self._confinement = confinement
        self._known: dict[Any, str | None] = {}

    def file(self, asset: Sdf.AssetPath) -> str | None:
        """Returns the name of the copied image; None for an image that cannot be used.

        A notice reports such an image.
        """
        key = place = asset.resolvedPath or asset.path
        if key not in self._known:
            self._known[key] = None
            try:
                if "<UDIM>" in place:
                    raise UsdRejected("unsupported_feature", "UDIM tiles are not supported")
                if not asset.resolvedPath:
                    other = found_elsewhere(asset.path, self._confinement.stage_folder)
                    if other is None or self._confinement.fault(other):
                        raise UsdRejected(
                            "file_not_found", "no such file; URLs and asset databases are not supported"
                        )
                    self._note("substituted_file", asset.path, f"file not found; {other} is used")
                    place = str(other)
                self._known[key] = name = self._copied(place)
                self.files[name] = asset.path
            except (OSError, KeyError, ValueError, zipfile.BadZipFile, UsdRejected) as error:
                code = error.code if isinstance(error, UsdRejected) else "file_unreadable"
                self._note(notice_code(code), asset.path, f"ignored: {error}")
        return self._known[key]

    def environment(self, asset: Sdf.AssetPath) -> str | None:
        """Same as `file`, for an image that must be readable because the world requires it."""
        name = self.file(asset)
        if name is not None:
            try:
                _core.read_texels(self.folder / name)
            except SettingsError:
                pass  # an image of floats
            except FormatError as error:
                reason = str(error).rpartition(f"{name}: ")[2]
                self._note(notice_code(error.code), asset.path, f"ignored: {reason}")
                return None
        return name

    def _note(self, code: str, path: str, text: str) -> None:
        self.notices.append(StageNotice(code, text, f"image {path!r}"))

    def baked(self, file: str, how: str, bake: Callable[[Texels], Texels | None]) -> str | None:
        """Returns the name of the image that `bake` creates from an image's pixels.

        Returns None if `bake` creates no image. If the pixels cannot be decoded, returns the name of the original
        image, with a notice. The image's size is stored in `sizes`.
        """
        key = (file, how)
        if key not in self._known:
            self._known[key] = file
            try:
                pixels = _pixels(self.folder / file)
                self.sizes[file] = (pixels.shape[1], pixels.shape[0])
                made = bake(pixels)
            except Exception as error:  # any error, because the decoder is a third-party library
                self._note("ignored_feature", self.files[file], f"{how} is not applied: {error}")
                return file
            self._known[key] = None
            if made is not None:
                self._known[key] = name = f"image{len(self._known)}.png"
                (self.folder / name).write_bytes(_core.encode_png(np.ascontiguousarray(made), fast=True))
                self.files[name] = self.files[file]
        return self._known[key]

    def _copied(self, place: str) -> str:
        name = f"image{len(self._known)}{Path(place.rstrip(']')).suffix.lower()}"
        outer, inner = Ar.SplitPackageRelativePathOuter(place)
        if fault := self._confinement.fault(Path(outer)):
            raise UsdRejected(*fault)
        with Path(outer).open("rb") as source, (self.folder / name).open("wb") as copy:
            self._copy(source, inner, copy)
        return name

    def _copy(self, source: Any, inner: str, copy: Any) -> None:
        """Copies a file, or a file at the path `inner` of a package, which may be nested."""
        if not inner:
            self._confinement.charge(source.seek(0, io.SEEK_END))
            source.seek(0)
            shutil.copyfileobj(source, copy)
            return
        name, rest = Ar.SplitPackageRelativePathOuter(inner)
        with zipfile.ZipFile(source) as package, package.open(entry := package.getinfo(name)) as part:
            if rest:
                self._confinement.charge(entry.file_size)
                self._copy(io.BytesIO(part.read()), rest, copy)
            else:
                self._copy(part, "", copy)


def bake_opacity(pixels: Texels, channel: str, scale: float, bias: float, threshold: float) -> Texels | None:
    """Returns the opacities in one channel of an image as grey values; None if all are 1.

    With a threshold, the values are 0 or 1.
    """
    alphas = level_values(pixels) * np.float32(scale) + np.float32(bias)
    if threshold > 0:
        alphas = (alphas >= threshold).astype(np.float32)
    made = look_up(pixels, ["rgba".index(channel)], np.clip(alphas, 0, 1)[:, None])
    return None if made.min() == np.iinfo(made.dtype).max else made


def bake_wrap(pixels: Texels, wraps: Sequence[str], tiles: Sequence[tuple[int, int]]) -> Texels:
    """Returns an image that covers ranges of tiles in u and v, according to wrap modes.

    Other modes than "black" and "clamp" repeat or mirror the image over the tiles. "clamp" leaves an axis unchanged,
    and "black" adds a black texel at both ends.
    """
    height, width = pixels.shape[:2]
    # Rows of the image run downwards, but v runs upwards.
    low, high = tiles[1]
    columns = _wrapped(width, wraps[0], *tiles[0])
    lines = _wrapped(height, wraps[1], 1 - high, 1 - low)
    if len(columns) * len(lines) > MOST_PIXELS:
        raise UsdRejected(
            "too_large",
            f"the image would need {len(columns)} x {len(lines)} pixels; the limit is {MOST_PIXELS} in total",
        )
    if (pixels[..., 3] == np.iinfo(pixels.dtype).max).all():
        pixels = pixels[..., :3]  # pixels outside of the image are black, not transparent
    made: Texels = pixels[lines][:, columns]
    made[lines < 0] = 0
    made[:, columns < 0] = 0
    return made


def _wrapped(size: int, wrap: str, low: int, high: int) -> Any:
    """The texel index at each position from tile `low` to tile `high`; -1 for black."""
    if wrap == "black":
        return np.concatenate([[-1], np.arange(size), [-1]])
    if wrap == "clamp":
        return np.arange(size)
    places = np.arange(low * size, high * size)
    if wrap == "mirror":
        places = places % (2 * size)
        return np.where(places < size, places, 2 * size - 1 - places)
    return places % size


def _pixels(file: Path) -> Texels:
    """Values [height, width, 4] of an image of integers."""
    if file.suffix in (".exr", ".hdr"):
        raise UsdRejected(
            "unsupported_feature",
            f"the image is a {file.suffix} file of floats; expected integers, as in a .png file",
        )
    texels: Texels = _core.read_texels(file)
    return texels
