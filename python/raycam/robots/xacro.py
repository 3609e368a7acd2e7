"""Xacro files (.xacro) as URDF documents.

ROS's `xacro` expands them; this requires the `raycam[robots]` extra.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from ..errors import FormatError, Notice, SettingsError
from ..io.limited_process import describe_status, run_limited
from .resolve import FileResolver, read_bytes
from .xml_tree import XmlLimits, check_xml

__all__ = ["XacroLimits", "expand_xacro"]


@dataclass(frozen=True)
class XacroLimits:
    """Limits for the expansion of a single file."""

    seconds: float = 60.0
    """Maximum time in seconds."""
    memory: int = 2 << 30
    """Maximum address space of the process in bytes."""
    bytes: int = 64 << 20
    """Maximum size of the document in bytes."""


def expand_xacro(
    path: Path, files: FileResolver, arguments: Mapping[str, str], limits: XacroLimits | None = None
) -> tuple[bytes, list[Notice]]:
    """Returns the URDF document of a xacro file, and notices.

    xacro evaluates Python expressions. It therefore runs under `limits` in a separate process, which can read only
    the folders of `files`, can write only its result, cannot start processes and has no environment variables.
    `arguments` are values of `<xacro:arg>` by name. Raises `OSError`, `FormatError` for a file that cannot be
    expanded within the limits, and `SettingsError` without the extra `raycam[robots]` or for arguments that are not
    strings.
    """
    limits = limits or XacroLimits()
    for key, value in arguments.items():
        if not isinstance(key, str) or not isinstance(value, str):
            raise SettingsError(
                f"xacro_args must map strings to strings, got {key!r}: {value!r}", code="wrong_type"
            )
    check_xml(read_bytes(path, XmlLimits().bytes), os.fspath(path))
    if importlib.util.find_spec("xacro") is None:
        raise SettingsError(
            f"{path}: reading xacro files requires xacro: pip install 'raycam[robots]'; or expand the file "
            "where it is installed: xacro FILE.xacro > FILE.urdf",
            code="missing_dependency",
        )
    with TemporaryDirectory(prefix="raycam-xacro-") as folder:
        request = {
            "path": os.path.abspath(path),
            "folder": files.folder,
            "packages": [os.fspath(package) for package in files.packages],
            "arguments": dict(arguments),
            "answer": os.path.join(folder, "answer"),
            "limits": asdict(limits),
        }
        # -I is not used: raycam may be installed through PYTHONPATH. The process empties its environment itself.
        command = [sys.executable, "-m", "raycam.robots.xacro_worker", json.dumps(request)]
        status, output = run_limited(command, limits.seconds, path, "xacro", os.environ)
        answer = Path(folder, "answer")
        if status != 0 or not answer.is_file():
            last = output.splitlines()[-1] if output else "xacro printed no reason"
            raise FormatError(
                f"{path}: the process that expands xacro failed ({describe_status(status)}): {last}",
                code="budget_exceeded" if status < 0 else "failed_process",
            )
        kind, _, rest = read_bytes(answer, limits.bytes).partition(b"\n")
    if kind != b"ok":
        raise FormatError(f"{path}: {rest.decode('utf-8', 'replace')}", code=kind.decode("ascii"))
    warnings, _, document = rest.partition(b"\0")
    texts = dict.fromkeys(warnings.decode("utf-8", "replace").splitlines())
    return document, [Notice(f"{path}: {text}", "xacro_warning") for text in texts]
