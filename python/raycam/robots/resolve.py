"""Search for the files that a robot description names, in root folders.

Files are named by `package://`, `model://`, `file://` or a relative path.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import unquote

from ..errors import FormatError, Notice, SettingsError

__all__ = ["FileResolver", "Missing", "find_root", "list_faults", "read_bytes"]

MAX_LEVELS = 8
"""Number of parent folders in which package.xml is searched."""
SHOWN_FAULTS = 20
"""Maximum number of missing files that a message lists."""
DESCRIPTION_FOLDERS = ("urdf", "robots", "robot", "xacro", "sdf", "mjcf")
"""Names of folders that contain only descriptions; the package is then the parent folder."""


class Missing(Exception):
    """A file that was not found or must not be read, with the reason."""


class FileResolver:
    """Finds the files named in a robot description.

    Files are read only from `root`, from packages next to it, and from the folders `packages`. Without `folder`, the
    root is the nearest parent folder that contains package.xml, or else the description's folder (its parent, if the
    folder is called urdf, robots, robot, xacro, sdf or mjcf). If `folder` is given, no file outside `folder` is read.
    """

    def __init__(
        self,
        path: Path,
        folder: str | os.PathLike[str] | None = None,
        packages: Iterable[str | os.PathLike[str]] = (),
    ) -> None:
        self.own = Path(os.path.abspath(path)).parent
        self.notices: list[Notice] = []
        self.folder = None if folder is None else os.path.abspath(folder)
        self._confined = folder is not None
        self.root = find_root(self.own) if folder is None else Path(os.path.abspath(folder))
        if isinstance(packages, str | os.PathLike):
            raise SettingsError(
                f"packages must be a list of folders, got {os.fspath(packages)!r}", code="wrong_type"
            )
        self.packages = [Path(os.path.abspath(package)) for package in packages]
        for package in self.packages:
            if not package.is_dir():
                raise SettingsError(f"packages: folder {package} not found", code="file_not_found")
            if self._confined and not self._inside(package, self.root):
                raise SettingsError(
                    f"packages: folder {package} is outside {self.root}; pass a folder= that contains it",
                    code="outside_root",
                )

    def find(self, name: str) -> Path:
        """Returns the path of a file; raises `Missing` with the reason and the searched folders."""
        with _impossible_paths():
            return self._find(name)

    def _find(self, name: str) -> Path:
        text = name.strip().replace("\\", "/")
        scheme, found, rest = text.partition("://")
        if not found:
            scheme, found, rest = (
                text.partition(":/") if text.lower().startswith("file:/") else ("", "", text)
            )
            rest = "/" + rest if found else rest
        scheme = scheme.lower()
        if scheme in ("package", "model"):
            package, _, inner = rest.lstrip("/").partition("/")
            return self._in_package(package, unquote(inner))
        if scheme == "file":
            return self._checked(Path(unquote(rest)), [self.root])
        if scheme:
            raise Missing(
                f"{scheme}:// names are not supported; download the file and use a path relative to the robot's file"
            )
        if text.startswith("$("):
            raise Missing("the name contains a xacro expression; rename the robot's file to .xacro")
        return self._checked(self.own / text, [self.root, *self.packages])

    def package_folder(self, package: str) -> Path:
        """Returns the folder of a package; raises `Missing` with the searched folders."""
        with _impossible_paths():
            folders = self._package_folders(package)
        if not folders:
            raise Missing(f"package {package!r} not found; searched {', '.join(map(str, self._searched()))}")
        return folders[0]

    def _in_package(self, package: str, inner: str) -> Path:
        if not package or package in (".", ".."):
            raise Missing("the package name is missing; expected package://NAME/PATH")
        folders = self._package_folders(package)
        if not folders:
            raise Missing(f"package {package!r} not found; searched {', '.join(map(str, self._searched()))}")
        for folder in folders[:-1]:
            try:
                return self._checked(folder / inner, [folder])
            except Missing:
                continue
        return self._checked(folders[-1] / inner, [folders[-1]])

    def _package_folders(self, package: str) -> list[Path]:
        """The folders with the package's name: searched folders, and folders directly inside them."""
        found = []
        for folder in self._searched():
            found += [folder] if folder.name == package else []
            found += [folder / package] if (folder / package).is_dir() else []
        for folder in found:
            if self._confined and not self._inside(folder, self.root):
                raise Missing(
                    f"package {package!r} was found in {folder}, outside {self.root}; pass a folder= that contains it"
                )
        return found

    def _searched(self) -> list[Path]:
        """The folders in which packages are searched, the nearest first."""
        above = [self.own, *self.own.parents]
        inside = [folder for folder in above if folder.is_relative_to(self.root)]
        beside = [] if self._confined or self.root.parent == Path(self.root.anchor) else [self.root.parent]
        return list(dict.fromkeys([*self.packages, *inside, *beside]))

    def _checked(self, path: Path, roots: list[Path]) -> Path:
        """Returns the path if it exists inside a root folder.

        The returned path may have different upper and lower case letters. Raises `Missing` if no file is
        found.
        """
        normal = Path(os.path.normpath(path))
        if not any(self._inside(normal, root) for root in roots):
            raise Missing(f"{normal} is outside {roots[0]}; pass a folder= that contains it")
        if normal.is_file():
            return normal
        other = _other_case(normal)
        if other is None or not other.is_file() or not any(self._inside(other, root) for root in roots):
            raise Missing(f"no such file: {normal}")
        self.notices.append(
            Notice(
                f"{normal}: file not found; using {other.name}, which differs in upper and lower case",
                "substituted_file",
            )
        )
        return other

    @staticmethod
    def _inside(path: Path, root: Path) -> bool:
        return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root))


@contextmanager
def _impossible_paths() -> Iterator[None]:
    """Context that raises `Missing` for paths that the system rejects.

    Examples are names that are too long or contain a null character, and folders without read permission.
    """
    try:
        yield
    except OSError as error:
        raise Missing(error.strerror or str(error)) from None
    except ValueError as error:
        raise Missing(f"invalid name: {error}") from None


def find_root(folder: Path) -> Path:
    """Returns the root folder of a description in `folder` if the user specifies no root folder."""
    for above in [folder, *folder.parents][:MAX_LEVELS]:
        if (above / "package.xml").is_file():
            return above
    outer = folder.parent
    return outer if folder.name in DESCRIPTION_FOLDERS and outer != Path(outer.anchor) else folder


def list_faults(faults: Collection[str]) -> str:
    """Returns the faults as one text; of many faults, the first ones and their number."""
    more = len(faults) - SHOWN_FAULTS
    return "; ".join(list(faults)[:SHOWN_FAULTS]) + (f"; and {more} more" if more > 0 else "")


def read_bytes(path: Path, limit: int) -> bytes:
    """Returns the bytes of a regular file; raises `OSError`, and `FormatError` beyond the limit."""
    with path.open("rb") as file:
        if not path.is_file():
            raise FormatError(
                f"{path}: a device, pipe or socket, expected a regular file", code="unknown_format"
            )
        # `read` allocates the requested size, even if the file is smaller.
        data = file.read(min(limit, os.fstat(file.fileno()).st_size) + 1)
    if len(data) > limit:
        raise FormatError(f"{path}: file too large; the limit is {limit} bytes", code="budget_exceeded")
    return data


def _other_case(path: Path) -> Path | None:
    """Returns a file whose path differs only in upper and lower case; None if not found.

    `path` is the path of a missing file.
    """
    parent = path.parent
    if not parent.is_dir():
        found = _other_case(parent) if parent != path else None
        if found is None or not found.is_dir():
            return None
        parent = found
    try:
        names = sorted(os.listdir(parent))
    except OSError:
        return None
    return next((parent / name for name in names if name.lower() == path.name.lower()), None)
