"""The process that expands a xacro file: `python -m raycam.robots.xacro_worker REQUEST`.

The process writes its answer to the file `answer` of the request. The answer is "ok", xacro's warnings and the
document, or the code and text of an error.
"""

from __future__ import annotations

import json
import os
import sys
import xml.dom.expatbuilder  # noqa: F401  (imported late by xacro, like yaml)
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import xacro
import xacro.substitution_args
import yaml  # noqa: F401

from ..errors import FormatError
from ..io.limited_process import apply_rlimits
from .resolve import FileResolver, Missing, read_bytes
from .xml_tree import XmlLimits, check_xml

__all__: list[str] = []

FORBIDDEN = (
    "ctypes.", "ftplib.", "http.", "import", "os.", "pty.", "shutil.", "signal.", "smtplib.", "socket.", "sqlite3.",
    "subprocess.", "tempfile.", "urllib.", "winreg.",
)  # fmt: skip
"""Beginnings of the `sys.addaudithook` events that are forbidden while a file is expanded."""
HARMLESS = ("os.listdir", "os.scandir")


class Refused(BaseException):
    """Raised for a forbidden action of a description.

    It is not an `Exception`, so that xacro does not catch it.
    """


class MissingPackage(xacro.substitution_args.SubstitutionException):  # type: ignore[misc]
    """A package of `$(find NAME)` that was not found, with the searched folders."""


class Guard:
    """Confines this process to reading files in folders, from `start` on."""

    def __init__(self, roots: list[Path]) -> None:
        self.roots = [os.path.realpath(root) for root in roots]
        self._is_active = False
        sys.addaudithook(self._check)

    def start(self) -> None:
        """From now on, raises `Refused` for other files, processes, connections and imports."""
        self._is_active = True

    def stop(self) -> None:
        """Ends the confinement, so that the answer can be written."""
        self._is_active = False

    def _check(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._is_active:
            return
        if event == "open":
            path, mode, flags = arguments
            flags_write = os.O_WRONLY | os.O_RDWR | os.O_CREAT
            writes = bool(set(mode) & set("wax+")) if mode else bool(int(flags or 0) & flags_write)
            real = os.path.realpath(os.fsdecode(path)) if isinstance(path, str | bytes) else str(path)
            if writes or not any(Path(real).is_relative_to(root) for root in self.roots):
                self._refuse(f"opening {real} is not allowed; only files in {', '.join(self.roots)} are read")
        elif event.startswith(FORBIDDEN) and event not in HARMLESS:
            self._refuse(f"{event} {arguments[:1]} is not allowed in a robot description")

    def _refuse(self, text: str) -> None:
        self._is_active = False  # no further checks: only the answer is written after this
        raise Refused(text)


class Arguments(dict[str, str]):
    """Arguments of a description; records the names that the description declares or reads."""

    def __init__(self, values: dict[str, str]) -> None:
        super().__init__(values)
        self.used: set[object] = set()

    def __contains__(self, name: object) -> bool:
        """Records the name."""
        self.used.add(name)
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        """Records the name."""
        self.used.add(name)
        return super().__getitem__(name)


def expand(request: dict[str, Any]) -> tuple[str, list[str]]:
    """Returns the document of the request, and the warnings."""
    path = Path(request["path"])
    files = FileResolver(path, request["folder"], request["packages"])
    guard = Guard([files.root, *files.packages])
    found: dict[str, Path] = {}

    def find(package: str) -> str:
        try:
            found[package] = files.package_folder(package)
        except Missing as reason:
            raise MissingPackage(str(reason)) from None
        guard.roots.append(os.path.realpath(found[package]))
        return os.fspath(found[package])

    warnings: list[str] = []
    _replace_messages(warnings)
    parse = xacro.parse

    def checked(text: Any, filename: str | None = None) -> Any:
        """Checks a document before xacro reads it; xacro reports missing files."""
        if text is None:
            with suppress(OSError):
                check_xml(
                    read_bytes(Path(xacro.root_dir or "", str(filename)), XmlLimits().bytes), str(filename)
                )
        return parse(text, filename)

    xacro.parse = checked
    xacro.substitution_args._eval_find = find
    os.environ.clear()
    arguments = Arguments(request["arguments"])
    guard.start()
    try:
        document: str = xacro.process_file(os.fspath(path), mappings=arguments).toprettyxml(indent="  ")
    finally:
        guard.stop()
    unused = sorted(set(request["arguments"]) - arguments.used)
    if unused:
        known = ", ".join(sorted(set(arguments) - set(unused))) or "none"
        warnings.append(f"arguments without effect: {', '.join(unused)}; arguments of the file: {known}")
    # Paths in folders that $(find) returned become package:// names again, so that meshes are found as in URDF files.
    for package, folder in found.items():
        for prefix in (f"file://{folder}/", f"{folder}/"):
            document = document.replace(f'"{escape(prefix)}', f'"package://{package}/')
    return document, warnings


def _replace_messages(warnings: list[str]) -> None:
    """Collects xacro's warnings instead of printing the warnings."""

    def collect(*parts: object, **_: object) -> None:
        warnings.append(" ".join(map(str, parts)).replace("\n", " "))

    ignore: Callable[..., None] = lambda *parts, **_: None  # noqa: E731
    for module in (xacro, getattr(xacro, "color", xacro)):
        module.warning, module.error = collect, collect
        module.message = ignore


def _location() -> str:
    """The files that are being read, innermost first."""
    stack = [str(name) for name in reversed(xacro.filestack or []) if name]
    return f" (in {', included from '.join(stack)})" if stack else ""


def _error_code(cause: BaseException) -> str:
    if isinstance(cause, FormatError):
        return cause.code
    if isinstance(cause, Refused):
        return "outside_root"
    return "file_not_found" if isinstance(cause, FileNotFoundError | MissingPackage) else "syntax"


def _error_text(cause: BaseException, error: BaseException) -> str:
    """The reason for an error; `error` is xacro's exception, which contains the `cause`."""
    if isinstance(cause, FileNotFoundError):
        return f"no such file: {cause.filename}"
    if isinstance(cause, MissingPackage | FormatError):
        return str(cause)
    return f"{type(cause).__name__}: {' '.join(str(error).split())}"


def main(request: dict[str, Any]) -> None:
    """Expands the file of a request, and writes the document or the error to the answer file."""
    limits = request["limits"]
    apply_rlimits(limits["memory"], limits["seconds"], limits["bytes"])
    try:
        document, warnings = expand(request)
        answer = "ok\n" + "\n".join(warnings) + "\0" + document
    except MemoryError:
        answer = f"budget_exceeded\nthe expansion needs more than {limits['memory']} bytes of memory"
    except (Refused, Exception) as error:
        cause = getattr(error, "exc", None) or error
        if isinstance(cause, MemoryError):
            answer = f"budget_exceeded\nthe expansion needs more than {limits['memory']} bytes of memory{_location()}"
        else:
            answer = f"{_error_code(cause)}\n{_error_text(cause, error)}{_location()}"
    data = answer.encode("utf-8", "replace")
    if len(data) > limits["bytes"]:
        data = (
            f"budget_exceeded\nthe expanded file is too large; the limit is {limits['bytes']} bytes".encode()
        )
    Path(request["answer"]).write_bytes(data)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
