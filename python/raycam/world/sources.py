"""Sources of worlds: bytes and file objects, their kind, and the unit of mesh files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..arguments import real
from ..errors import SettingsError
from .endings import MESH_ENDINGS, MODEL_ENDINGS

if TYPE_CHECKING:
    from _typeshed import SupportsRead

__all__ = [
    "HEAD_BYTES",
    "assumed_up_axis",
    "check_scalable",
    "has_up_axis",
    "is_model_file",
    "kind_suffix",
    "path_suffix",
    "read_bytes",
    "scale_factor",
]

METRES = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""Lengths of units in metres."""
MARKS = ((b"PXR-USDC", ".usdc"), (b"#usda", ".usda"), (b"glTF", ".glb"))
"""First bytes of GLB and USD files, and their endings."""
ZIP_MARK = b"PK\x03\x04"
HEAD_BYTES = 512
"""Bytes that determine a file's kind."""


def read_bytes(source: bytes | bytearray | memoryview | SupportsRead[bytes]) -> bytes:
    """The bytes of a source that is not a path.

    A file object is read to its end. Raises `SettingsError` for other objects.
    """
    data = source.read() if hasattr(source, "read") else source
    if isinstance(data, str):
        raise SettingsError(
            "source is a text file; open it in binary mode: open(path, 'rb')", code="wrong_type"
        )
    if not isinstance(data, bytes | bytearray | memoryview):
        raise SettingsError(
            "source must be the path of a world or model, bytes or a binary file object, "
            f"not {type(source).__name__}",
            code="wrong_type",
        )
    return bytes(data)


def kind_suffix(kind: str | None, data: bytes) -> str:
    """The extension for these bytes, such as ".glb"; empty if unknown.

    It is determined by the content, or else by `kind`. Raises `SettingsError` for an unknown `kind`.
    """
    named = "" if kind is None else f".{kind.lower().lstrip('.')}" if isinstance(kind, str) else "."
    if named and named not in MODEL_ENDINGS:
        options = ", ".join(each.lstrip(".") for each in MODEL_ENDINGS)
        raise SettingsError(f"kind is {kind!r}; options: {options}", code="unknown_name")
    return _content_suffix(data) or named


def assumed_up_axis(path: str | os.PathLike[str]) -> Literal["y"] | None:
    """Returns the up axis that the command line and views pass to `load` for the file `path`.

    The result is "y" for OBJ files, whose format does not specify an up axis, as in Blender and F3D. For all other
    files, the result is None, and `load` determines the axis.
    """
    return "y" if Path(path).suffix.lower() == ".obj" else None


def has_up_axis(path: str | os.PathLike[str]) -> bool:
    """False for mesh files (OBJ, PLY, STL, OFF), whose formats do not specify an up axis; True for other files."""
    return Path(path).suffix.lower() not in MESH_ENDINGS


def is_model_file(path: str | os.PathLike[str]) -> bool:
    """False for the name of a world file, which specifies its own light; True for other files."""
    return Path(path).suffix.lower() != ".toml"


def path_suffix(path: str | os.PathLike[str]) -> str:
    """The extension of a file, such as ".usd".

    A known extension in the name is used, or else the extension for the content.
    """
    suffix = Path(path).suffix.lower()
    if suffix in MODEL_ENDINGS:
        return suffix
    with open(path, "rb") as file:
        return _content_suffix(file.read(HEAD_BYTES)) or suffix


def _content_suffix(head: bytes) -> str:
    """The ending of a GLB or USD file, determined by its first bytes; empty for other files."""
    # The first file in a USDZ archive is a USD file, whose name is in the archive's first bytes.
    if head.startswith(ZIP_MARK) and b".usd" in head[:HEAD_BYTES]:
        return ".usdz"
    return next((suffix for mark, suffix in MARKS if head.startswith(mark)), "")


def scale_factor(scale: float | None, units: str | None) -> float | None:
    """Returns the factor for a mesh file's coordinates; None if neither argument is given.

    Raises `SettingsError` if both arguments are given, for an unknown unit, and for a scale that is not positive.
    """
    if scale is not None and units is not None:
        raise SettingsError(
            f"scale={scale!r} and units={units!r} cannot be combined; use only one of them",
            code="conflicting_values",
        )
    if units is not None:
        if units not in METRES:
            raise SettingsError(f"units is {units!r}; options: {', '.join(METRES)}", code="unknown_name")
        return METRES[units]
    return None if scale is None else real("scale", scale, 0.0, above=True)


def check_scalable(name: str, suffix: str, head: bytes) -> None:
    """Raises `SettingsError` for `scale` or `units` of a file that is not a mesh file."""
    is_scene = suffix in MODEL_ENDINGS and suffix not in MESH_ENDINGS
    if is_scene or _content_suffix(head) or head.lstrip()[:1] == b"{":
        raise SettingsError(
            f"{name}: scale= and units= require a mesh file ({', '.join(MESH_ENDINGS)}); other formats specify "
            "their unit; add the file to a world instead: world.add_object(mesh=..., scale=...)",
            code="conflicting_values",
        )
