"""Reading of photographs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import Notice, SettingsError, with_code
from ..io.oriented_photo import Orientation, StoredPixels, read_oriented
from ..notices import distinct, warn
from ..one_line import counted
from ..srgb import linear_from_srgb

__all__ = ["PhotoSource", "Photos"]

Photos = str | os.PathLike[str] | Mapping[str, Any]
"""A folder with the photographs, or a mapping from their names to paths or arrays."""
LISTED_NAMES = 3
"""Maximum number of photographs listed in an error; further photographs are only counted."""


class PhotoSource:
    """Photographs by name, read when they are used; each notice about their files is given once."""

    def __init__(self, photos: Photos, names: Iterable[str], orientation: Orientation = "auto") -> None:
        """Checks that each photograph is present and in the folder, before anything is computed.

        Raises `FileNotFoundError` for missing files, and `SettingsError` for missing keys and for names outside of
        the folder.
        """
        self.photos, self.orientation = photos, orientation
        self._given: set[Notice] = set()
        wanted = list(names)
        if isinstance(photos, Mapping):
            # `name in photos` may load a photograph, because `Mapping` implements it by access.
            present = set(photos)
            absent = [name for name in wanted if name not in present]
            if absent:
                raise SettingsError(
                    f"photos: {_counted(absent, wanted)} missing from the mapping; its keys must be the photographs' "
                    "names",
                    code="missing_photograph",
                )
        else:
            root = Path(photos).resolve()
            for name in wanted:
                if not (root / name).resolve().is_relative_to(root):
                    raise SettingsError(
                        f"photograph {name!r} is outside the folder {os.fspath(photos)}; "
                        "pass photos as a mapping from names to paths",
                        code="outside_root",
                    )
        # Mappings other than dict are not checked, because they may load photographs on access.
        checked = wanted if not isinstance(photos, Mapping) or isinstance(photos, dict) else []
        paths = {name: path for name in checked if isinstance(path := self._path_or_array(name), Path)}
        lost = [
            os.fspath(path) if isinstance(photos, Mapping) else name
            for name, path in paths.items()
            if not path.is_file()
        ]
        if lost:
            place = "the mapping's paths" if isinstance(photos, Mapping) else os.fspath(photos)
            raise with_code(
                FileNotFoundError(
                    f"{place}: {_counted(lost, wanted)} missing; remove their cameras, or correct the paths"
                )
            )

    def _path_or_array(self, name: str) -> Any:
        """The photograph's file as a `Path`, or its array; a mapping may load the photograph for this."""
        given = self.photos[name] if isinstance(self.photos, Mapping) else Path(self.photos) / name
        return Path(given) if isinstance(given, str | os.PathLike) else given

    def read(self, name: str, camera: Camera) -> StoredPixels:
        """The photograph of this name [h, w, 4] with opacity: sRGB if uint8, linear if float32.

        Raises `SettingsError` if its size is not the camera's, for values that are not finite and for arrays of another
        shape; `FormatError` and `OSError` for its file.
        """
        given = self._path_or_array(name)
        if not isinstance(given, Path):
            found: StoredPixels = linear_photo(name, given)
        else:
            found, notices = read_oriented(given, camera.size, self.orientation)
            for notice in distinct(notices):
                if notice not in self._given:
                    self._given.add(notice)
                    warn(notice)
        height, width = found.shape[:2]
        if (width, height) != camera.size:
            turned = (height, width) == camera.size
            remedy = (
                "the pixels are rotated by 90 degrees; rotate the photograph or the camera"
                if turned
                else "resize the camera: load_cameras(..., size=) or --size"
            )
            raise SettingsError(
                f"photograph {name!r} has {width} x {height} pixels, but its camera has {camera.size[0]} x "
                f"{camera.size[1]}; {remedy}",
                code="photograph_size",
            )
        if found.dtype != np.uint8 and not np.isfinite(found).all():
            count = int((~np.isfinite(found)).any(axis=2).sum())
            raise SettingsError(
                f"photograph {name!r} has {counted(count, 'pixel')} with NaN or infinite values; mask them with an "
                "alpha channel of 0",
                code="invalid_value",
            )
        return found


def linear_photo(name: str, given: Any) -> npt.NDArray[np.float32]:
    """An array as linear float32 [h, w, 4].

    Arrays are [h, w] or [h, w, 1] (grey), [h, w, 2] (grey and opacity), [h, w, 3] or [h, w, 4]; uint8 and uint16 are
    sRGB, floats are linear, bool is black and white. Raises `SettingsError` for other arrays.
    """
    expected = f"photograph {name!r} must be an array [h, w], or [h, w, 1 to 4]"
    try:
        pixels = np.asarray(given)
    except ValueError:
        raise SettingsError(f"{expected}, got rows of different lengths", code="wrong_shape") from None
    shape = list(pixels.shape)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 2, 3, 4) or 0 in shape:
        raise SettingsError(f"{expected}, got {shape}", code="wrong_shape")
    if pixels.dtype == np.bool_:
        values = pixels.astype(np.float32)
    elif pixels.dtype in (np.uint8, np.uint16):
        values = (pixels / np.iinfo(pixels.dtype).max).astype(np.float32)
        colors = values.shape[2] - (values.shape[2] in (2, 4))
        if pixels.dtype == np.uint8 and colors == 3:
            values[..., :3] = _core.linear_from_srgb8(np.ascontiguousarray(pixels[..., :3]))
        else:
            values[..., :colors] = linear_from_srgb(values[..., :colors].astype(np.float64))
    elif pixels.dtype.kind == "f":
        values = pixels.astype(np.float32)
    else:
        raise SettingsError(
            f"photograph {name!r} must be uint8, uint16 or float, got {pixels.dtype}", code="wrong_type"
        )
    opaque = values[..., -1:] if values.shape[2] in (2, 4) else np.ones((*values.shape[:2], 1), np.float32)
    color = values[..., :3] if values.shape[2] >= 3 else np.repeat(values[..., :1], 3, axis=2)
    return np.concatenate([color, opaque], axis=2)


def _counted(names: list[str], wanted: list[str]) -> str:
    """Returns the first names and the number of names as text, for the subject of a sentence."""
    listed = ", ".join(repr(name) for name in names[:LISTED_NAMES])
    more = f" and {len(names) - LISTED_NAMES} more" if len(names) > LISTED_NAMES else ""
    return f"{len(names)} of {len(wanted)} photographs ({listed}{more}) {'is' if len(names) == 1 else 'are'}"
