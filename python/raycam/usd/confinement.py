"""Confinement of a stage: its layers and images are read only from one folder.

OpenUSD opens every file that a layer names. Therefore every layer is opened first, and an asset path that leads out of
the folder, or to no layer, is removed from the layer in memory. The stage is then composed without this file, as
OpenUSD composes a stage with a missing layer.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, NamedTuple

from pxr import Ar, Sdf, Tf

from .notices import StageNotice

__all__ = ["Confinement", "UsdRejected"]

HTML = "the file is an HTML page instead of USD data; download the file itself"
SERVER = "the file is a server's error message instead of USD data; download the file itself"
PACKED = "the file is compressed (gzip, bzip2, XZ, 7-Zip or Zstandard); decompress it first"
FIRST_BYTES = (
    (b"version https://git-lfs.github.com", "the file is a Git LFS pointer; run git lfs pull"),
    (b"/annex/objects/", "the file is a git-annex pointer; run git annex get"),
    (b"<!doctype html", HTML),
    (b"<html", HTML),
    (b"404: not found", SERVER),
    (b'{"error":', SERVER),
    (b'{"message":', SERVER),
)
"""First bytes, in lower case, of files whose contents do not match their names."""

ZIP = b"pk\x03\x04"
OTHER_KINDS = (
    (
        b"<?xml",
        "the file is an XML document (a server's error page or another kind of model), not a USD file",
    ),
    (b"\x1f\x8b", PACKED),
    (b"bzh", PACKED),
    (b"\xfd7zxz", PACKED),
    (b"7z\xbc\xaf", PACKED),
    (b"\x28\xb5\x2f\xfd", PACKED),
    (ZIP, "the file is a ZIP archive; unpack it first, or rename it to .usdz if it is a USD package"),
    (b"gltf", "the file is a GLB file; rename it to .glb"),
    (b"ply\n", "the file is a PLY file; rename it to .ply"),
    (b"\x89png", "the file is a PNG image, not a USD file"),
    (b"\xff\xd8\xff", "the file is a JPEG image, not a USD file"),
)
"""First bytes, in lower case, of files that are not USD stages."""


class Fault(NamedTuple):
    """The reason why a file is rejected, and the code of the error."""

    code: str
    text: str


def notice_code(code: str) -> str:
    """Returns the code of the notice about a file that is ignored because of an error.

    `code` is the code of the error.
    """
    return {"file_not_found": "missing_file", "outside_root": "outside_root"}.get(code, "unreadable_file")


class UsdRejected(Exception):
    """Error with a code and the reason why the file is rejected."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


class Confinement:
    """The folder of a stage, and the number of bytes that may be read from it."""

    def __init__(self, path: Path, folder: Path, most: int) -> None:
        self.notices: list[StageNotice] = []
        self.has_lost = False
        """True if an ignored layer may contain something visible: any layer except MaterialX."""
        self.folder = Path(os.path.realpath(folder))
        self._own = Path(os.path.realpath(path))
        self._path = path
        self._most = self._left = most
        self._layers: dict[str, Sdf.Layer | Fault] = {}  # the layer, or the reason why it is missing

    @property
    def stage_folder(self) -> Path:
        """The folder of the stage's file."""
        return self._own.parent

    def fault(self, file: Path) -> Fault | None:
        """Returns the reason why a file must not be read; None if the file may be read."""
        real = Path(os.path.realpath(file))
        if real != self._own and not real.is_relative_to(self.folder):
            leads = f"the file is a symbolic link to {real}" if os.path.islink(file) else "the file is"
            wider = os.path.commonpath([self.folder, real])
            return Fault(
                "outside_root",
                f"{leads} outside {self.folder}; to allow it, load with folder={wider!r} (--folder on the"
                " command line)",
            )
        if not real.exists():
            return Fault("file_not_found", "no such file")
        if not real.is_file():
            return Fault("file_unreadable", "the path is not a regular file")
        if real.stat().st_size == 0:
            return Fault("empty_file", "the file is empty")
        found = _find_kind(FIRST_BYTES, real)
        return Fault("placeholder_file", found[1]) if found else None

    def charge(self, size: int) -> None:
        """Counts bytes that are read; raises `UsdRejected` beyond the limit."""
        self._left -= size
        if self._left < 0:
            raise UsdRejected(
                "budget_exceeded", f"the stage's files are too large; the limit is {self._most} bytes"
            )

    def open_layers(self) -> list[Sdf.Layer]:
        """Opens and returns all layers of the stage, and removes their forbidden asset paths.

        The root layer is opened first.
        """
        if fault := self.fault(self._path):
            raise UsdRejected(*fault)
        kind = _find_kind(OTHER_KINDS, self._own)
        if kind and not (kind[0] == ZIP and self._path.suffix.lower() == ".usdz"):
            raise UsdRejected("wrong_format", kind[1])
        self.charge(self._own.stat().st_size)
        first = Sdf.Layer.FindOrOpen(str(self._path))
        if first is None:
            raise UsdRejected("syntax", "Pixar's library cannot read the file as a USD layer")
        self._layers[first.identifier] = first
        waiting: list[tuple[Sdf.Layer, dict[str, Any]]] = [(first, _variables(first))]
        while waiting:
            waiting.extend(self._confine(*waiting.pop()))
        return [layer for layer in self._layers.values() if isinstance(layer, Sdf.Layer)]

    def check_loaded(self) -> None:
        """Raises `UsdRejected` if OpenUSD has opened a layer of another folder.

        OpenUSD opens further layers, for example, for value clips.
        """
        for layer in Sdf.Layer.GetLoadedLayers():
            place = Ar.SplitPackageRelativePathOuter(layer.realPath)[0] if layer.realPath else ""
            real = Path(os.path.realpath(place))
            if place and real != self._own and not real.is_relative_to(self.folder):
                raise UsdRejected(
                    "outside_root",
                    f"the value clip {real} is outside {self.folder}; copy it there, or load with a wider folder=",
                )

    def _confine(self, layer: Sdf.Layer, variables: dict[str, Any]) -> list[tuple[Sdf.Layer, dict[str, Any]]]:
        """Removes forbidden asset paths from a layer, and returns newly named layers."""
        replaced: dict[str, str] = {}
        found = []
        # An empty asset path means the layer itself.
        for asset in filter(None, layer.GetCompositionAssetDependencies()):
            named = asset
            reason: Fault | None = None
            if Sdf.VariableExpression.IsExpression(asset):
                value = Sdf.VariableExpression(asset).Evaluate(variables)
                named = value.value if isinstance(value.value, str) else ""
                if not named:
                    errors = "; ".join(value.errors) or "the value is not a string"
                    reason = Fault(
                        "file_unreadable", f"the expression in the layer's path cannot be evaluated: {errors}"
                    )
            known = len(self._layers)
            opened = reason or (self._opened(layer, named) if named else None)
            if isinstance(opened, Fault):
                text = f"layer {asset!r} is ignored: {opened.text}"
                self.notices.append(
                    StageNotice(notice_code(opened.code), text, f"layer {self._shown(layer)}")
                )
                self.has_lost = self.has_lost or not named.endswith(".mtlx")
                replaced[asset] = ""
                continue
            if named != asset:
                replaced[asset] = named
            if opened is not None and len(self._layers) > known:
                own = {} if asset in layer.subLayerPaths else _variables(opened)
                found.append((opened, own | variables))
        if replaced:
            layer.SetPermissionToEdit(True)
            for asset, other in replaced.items():
                layer.UpdateCompositionAssetDependency(asset, other)
        return found

    def _opened(self, layer: Sdf.Layer, asset: str) -> Sdf.Layer | Fault:
        """The layer named by another layer, or the reason why it cannot be opened."""
        if re.match(r"[A-Za-z][\w+.-]+:", asset) and ":SDF_FORMAT_ARGS:" not in asset:
            text = "URLs and asset databases are not supported; download the layer into the folder"
            return Fault("file_not_found", text)
        place = layer.ComputeAbsolutePath(asset)
        if place in self._layers:
            return self._layers[place]
        self._layers[place] = found = self._open(Sdf.Layer.SplitIdentifier(place)[0], place)
        if isinstance(found, Sdf.Layer):
            self._layers[found.identifier] = found
        return found

    def _open(self, file: str, identifier: str) -> Sdf.Layer | Fault:
        outer, inner = Ar.SplitPackageRelativePathOuter(file)
        if not os.path.isabs(outer):
            return Fault("file_not_found", "no such file")
        if fault := self.fault(Path(outer)):
            return fault
        suffix = os.path.splitext(inner or outer)[1].lstrip(".")
        if Sdf.FileFormat.FindByExtension(suffix) is None:
            text = f"the installed version of Pixar's library cannot read .{suffix} files"
            return Fault("unknown_format", text)
        if not inner:
            self.charge(Path(outer).stat().st_size)
        try:
            found = Sdf.Layer.FindOrOpen(identifier)
        except Tf.ErrorException as error:
            return Fault("syntax", "; ".join(part.commentary.strip() for part in error.args))
        return Fault("syntax", "Pixar's library cannot read the file as a layer") if found is None else found

    def _shown(self, layer: Sdf.Layer) -> str:
        """The layer's path, relative to the folder of the stage."""
        return os.path.relpath(layer.realPath or layer.identifier, self._own.parent)


def _find_kind(kinds: tuple[tuple[bytes, str], ...], file: Path) -> tuple[bytes, str] | None:
    """The file kind that the first bytes indicate; None for unknown first bytes."""
    with file.open("rb") as stream:
        first = stream.read(64).removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    return next((kind for kind in kinds if first.startswith(kind[0])), None)


def _variables(layer: Sdf.Layer) -> dict[str, Any]:
    """The variables for expressions in asset paths."""
    root = layer.pseudoRoot
    return dict(root.GetInfo("expressionVariables")) if root.HasInfo("expressionVariables") else {}
