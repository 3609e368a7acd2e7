"""USD files as worlds and as objects of worlds."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .. import _core, usd
from ..errors import FormatError, Notice
from ..io import memory_limits
from .description import plain

__all__ = ["add_usd_object", "is_usd", "load_usd", "usd_named"]


def is_usd(name: object) -> bool:
    """True for the name of a USD file."""
    return isinstance(name, str | os.PathLike) and Path(name).suffix.lower() in usd.SUFFIXES


def load_usd(
    path: str | os.PathLike[str],
    texture_memory: int | str | None,
    root: str | os.PathLike[str] | None,
    time: float | None,
) -> _core.World:
    """The world of a USD file."""
    from tempfile import TemporaryDirectory  # imported here: `import raycam` does not wait for it

    with TemporaryDirectory(prefix="raycam-usd-") as folder:
        description = usd.read(path, Path(folder), root=root, time=time)
        said, files = description.pop("notices"), description.pop("files")
        try:
            limit = memory_limits.parse_size("texture_memory", texture_memory)
            core = _core.world_from_dict(plain(description), folder, limit)
        except FormatError as error:
            raise FormatError(_of_usd(str(error), path, folder, files)) from None
        notices = _notices_of_usd(core.notices, path, folder, files)
        core.set_notices(
            [*notices, *(Notice(f"{os.fspath(path)}: {notice}", "ignored_feature") for notice in said)]
        )
    return core


def add_usd_object(core: _core.World, keys: dict[str, Any], root: str | None) -> int:
    """Adds all meshes of a USD file to a world as one object; returns its id.

    The mesh is turned from the file's up axis to the world's, except with `upright` False, or with `matrix` unless
    `upright` is True. `root` is the folder of the world.
    """
    keys = dict(keys)
    path = Path(root or "", keys["mesh"])
    inside = root is not None and path.resolve().is_relative_to(Path(root).resolve())
    keys.setdefault("name", path.stem)
    upright = keys.pop("upright", None)
    up = core.up if (keys.get("matrix") is None if upright is None else upright) else None
    from tempfile import TemporaryDirectory  # imported here: `import raycam` does not wait for it

    with TemporaryDirectory(prefix="raycam-usd-") as folder:
        found = usd.read(path, Path(folder), root=root if inside else None, single=True, up=up)
        said, files = found["notices"], found["files"]
        before = len(core.notices)
        keys["mesh"] = os.path.join(folder, found["object"][0]["mesh"])
        try:
            number = _core.world_add_object(core, plain(keys), None)
        except FormatError as error:
            raise FormatError(_of_usd(str(error), path, folder, files)) from None
        if up is not None and up != found["up"]:
            said.append(f"its up axis, {found['up']}, is turned to {up}: upright = false keeps it")
        if up is None and upright is None and core.up != found["up"]:
            said.append(
                f"its up axis, {found['up']}, is not turned to {core.up}, because matrix applies to the file's own "
                "axes; upright = true turns it before matrix is applied"
            )
        notices = _notices_of_usd(core.notices[before:], path, folder, files)
        core.set_notices(
            [
                *core.notices[:before],
                *notices,
                *(Notice(f"{path}: {notice}", "ignored_feature") for notice in said),
            ]
        )
    return number


@contextlib.contextmanager
def usd_named() -> Iterator[None]:
    """Adds what to do to the error that a description names a USD file, which only Python reads."""
    try:
        yield
    except FormatError as error:
        place, found, _ = str(error).partition(": unknown kind of file")
        if found and place.lower().endswith(usd.SUFFIXES):
            raise FormatError(
                f"{place}: a description cannot name USD files: convert it once,"
                ' raycam.load("x.usd").to_gltf("x.glb"), or use World.add_object(mesh="x.usd")'
            ) from None
        raise


def _notices_of_usd(
    notices: list[Notice], path: str | os.PathLike[str], folder: str, files: dict[str, str]
) -> list[Notice]:
    """The notices of files that the worker wrote, with the stage's names; what alpha does, its materials say."""
    return [
        Notice(_of_usd(str(notice), path, folder, files), notice.code)
        for notice in notices
        if notice.code != "unused_alpha"
    ]


def _of_usd(text: str, path: str | os.PathLike[str], folder: str, files: dict[str, str]) -> str:
    """Replaces the names of temporary files in a message by those of the USD file and its images."""
    shown, made = os.fspath(path), re.compile(re.escape(folder + os.sep) + r"([^/\\:]+)(:\d+)?")
    text = made.sub(lambda found: files.get(found[1], shown), text)
    return text if text.startswith(shown) else f"{shown}: {text}"
