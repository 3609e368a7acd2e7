"""Reading of robot files by their ending."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import FormatError
from .description import RobotDescription
from .resolve import FileResolver, read_bytes
from .urdf import read_urdf
from .xml_tree import XmlLimits

__all__ = ["SUFFIXES", "read_robot"]

SUFFIXES = (".urdf",)
"""Endings of robot files."""


def read_robot(path: str | os.PathLike[str], files: FileResolver) -> RobotDescription:
    """Reads a robot file.

    Raises `OSError`, and `FormatError` with file and line for a malformed file and for other endings.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FormatError(
            f"{os.fspath(path)}: unknown kind of robot file; expected {', '.join(SUFFIXES)}",
            code="unknown_format",
        )
    return read_urdf(read_bytes(Path(path), XmlLimits().bytes), os.fspath(path))
