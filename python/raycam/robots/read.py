"""Reading of robot files by their ending."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import FormatError, SettingsError
from .description import RobotDescription
from .resolve import FileResolver, read_bytes
from .urdf import read_urdf
from .xacro import expand_xacro
from .xml_tree import XmlLimits

__all__ = ["SUFFIXES", "read_robot"]

SUFFIXES = (".urdf", ".xacro")
"""Endings of robot files."""


def read_robot(
    path: str | os.PathLike[str], files: FileResolver, xacro_args: Mapping[str, str] | None = None
) -> RobotDescription:
    """Reads a robot file; `xacro_args` are arguments of a xacro file.

    Raises `OSError`, `FormatError` with file and line for a malformed file and for other endings, `SettingsError` for
    `xacro_args` of another file, and the errors of `expand_xacro`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FormatError(
            f"{os.fspath(path)}: unknown kind of robot file; expected {', '.join(SUFFIXES)}",
            code="unknown_format",
        )
    if suffix == ".xacro":
        document, notices = expand_xacro(Path(path), files, xacro_args or {})
        found = read_urdf(document, f"{os.fspath(path)} (expanded)")
        found.notices[:0] = notices
        return found
    if xacro_args:
        raise SettingsError(f"{os.fspath(path)}: xacro_args are for .xacro files", code="conflicting_values")
    return read_urdf(read_bytes(Path(path), XmlLimits().bytes), os.fspath(path))
