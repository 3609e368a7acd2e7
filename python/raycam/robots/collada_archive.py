"""Collada archives (.zae): a ZIP archive with a document and its images."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import unquote

from ..errors import FormatError, Notice, SettingsError
from ..io.archive import check_name, unpack
from .resolve import FileResolver, Missing, read_bytes
from .xml_tree import LFS_POINTER, parse_xml

__all__ = ["ARCHIVE_ENDING", "UnpackedDocument", "unpack_collada"]

ARCHIVE_ENDING = ".zae"
DOCUMENT_ENDING = ".dae"
MANIFEST = "manifest.xml"
ENDINGS = (
    DOCUMENT_ENDING,
    ".xml",
    ".png",
    ".jpg",
    ".jpeg",
    ".bmp",
    ".tga",
    ".tif",
    ".tiff",
    ".gif",
    ".webp",
    ".dds",
)
"""Endings of the files that are unpacked."""
MAX_FILES = 1000
MAX_BYTES = 1 << 29
"""Limits of an archive, unpacked."""
MAX_MANIFEST_BYTES = 1 << 16


@dataclass(frozen=True)
class UnpackedDocument:
    """The document of an unpacked archive."""

    folder: Path
    """The folder of the archive's files."""
    name: str
    """The document's name in the archive."""
    notices: list[Notice]

    @property
    def path(self) -> Path:
        """The document's path."""
        return self.folder / self.name

    def find(self, name: str) -> Path:
        """Returns the path of an image of the archive; raises `OSError` for other files."""
        try:
            files = FileResolver(self.path, self.folder)
            return files.find(name if "://" in name else os.fspath(self.path.parent / name))
        except Missing as reason:
            raise FileNotFoundError(str(reason).replace(f"{self.folder}{os.sep}", "")) from None


@contextmanager
def unpack_collada(archive: Path) -> Iterator[UnpackedDocument]:
    """Unpacks an archive to a temporary folder, and returns its document.

    The document is the one named in `manifest.xml`, or else the first one. Raises `OSError`, and `FormatError` for
    damaged archives, names outside of the archive, archives beyond the limits, and archives without a document.
    """
    with archive.open("rb") as file:
        if file.read(len(LFS_POINTER)) == LFS_POINTER:
            raise FormatError(
                f"{archive}: a Git LFS pointer instead of the file; run git lfs pull", code="placeholder_file"
            )
    with TemporaryDirectory(prefix="raycam-collada-") as temporary:
        folder = Path(os.path.realpath(temporary))
        try:
            names = unpack(archive, folder, _check(archive), ENDINGS)
        except SettingsError as error:
            raise FormatError(f"{archive}: {error}", code=error.code) from None
        documents = sorted(name for name in names if name.lower().endswith(DOCUMENT_ENDING))
        if not documents:
            raise FormatError(
                f"{archive}: the archive contains no {DOCUMENT_ENDING} file", code="nothing_visible"
            )
        notices = []
        name = _named_in_manifest(archive, folder) if MANIFEST in names else None
        if name is None and len(documents) > 1:
            text = f"{archive}: showing {documents[0]}; the archive also contains {', '.join(documents[1:6])}"
            notices.append(Notice(text, "ignored_element"))
        if name is not None and name not in documents:
            raise FormatError(
                f"{archive}: {MANIFEST} names {name!r}; the archive contains {', '.join(documents[:5])}",
                code="file_not_found",
            )
        yield UnpackedDocument(folder, name or documents[0], notices)


def _named_in_manifest(archive: Path, folder: Path) -> str | None:
    """The document's name in the manifest, without a fragment; None if the manifest names none."""
    root = parse_xml(read_bytes(folder / MANIFEST, MAX_MANIFEST_BYTES), f"{archive}/{MANIFEST}")
    text = next((each.text.strip() for each in [root, *root.children] if each.tag == "dae_root"), "")
    text = unquote(text.partition("#")[0]).removeprefix("./")
    try:
        return check_name(text) if text else None
    except SettingsError as error:
        raise FormatError(f"{archive}/{MANIFEST}: {error}", code="outside_root") from None


def _check(archive: Path) -> Callable[[str, int], None]:
    """Returns a function that counts the files of an archive; it raises `FormatError` beyond the limits."""
    counts = [0, 0]

    def check(name: str, size: int) -> None:
        counts[0], counts[1] = counts[0] + 1, counts[1] + size
        if counts[0] > MAX_FILES or counts[1] > MAX_BYTES:
            limit = f"{MAX_FILES} files and {MAX_BYTES >> 20} MiB unpacked"
            text = f"{archive}: the archive is too large; the limit is {limit}"
            raise FormatError(text, code="budget_exceeded")

    return check
