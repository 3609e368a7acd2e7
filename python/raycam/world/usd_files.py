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

__all__ = ["add_usd_object", "is_usd", "load_usd"]


def is_usd(name: object) -> bool:
    """Returns True for the name of a USD file."""
    return isinstance(name, str | os.PathLike) and Path(name).suffix.lower() in usd.SUFFIXES


def load_usd(
    path: str | os.PathLike[str],
    texture_memory: int | str | None,
    root: str | os.PathLike[str] | None,
    time: float | None,
    variant: str | None,
) -> tuple[_core.World, list[str]]:
    """Returns the world of a USD file, and its variants as "SET=NAME"."""
    from tempfile import TemporaryDirectory  # imported here, so that `import raycam` is fast

    with TemporaryDirectory(prefix="raycam-usd-") as folder:
        stage = usd.read(path, Path(folder), root=root, time=time, variant=variant)
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        with _original_names(path, folder, stage.files):
            core = _core.world_from_polygons(plain(stage.world), stage.polygons, folder, limit)
        _set_notices(core, 0, path, folder, stage)
    return core, stage.variants


def add_usd_object(core: _core.World, keys: dict[str, Any], root: str | None) -> int:
    """Adds all meshes of a USD file to a world as one object; returns its id.

    The mesh is rotated from the file's up axis to the world's, unless `upright` is False, or a `matrix` is given and
    `upright` is not True. `root` is the folder of the world.
    """
    keys = dict(keys)
    path = Path(root or "", keys["mesh"])
    inside = root is not None and path.resolve().is_relative_to(Path(root).resolve())
    keys.setdefault("name", path.stem)
    upright = keys.pop("upright", None)
    up = core.up if (keys.get("matrix") is None if upright is None else upright) else None
    from tempfile import TemporaryDirectory  # imported here, so that `import raycam` is fast

    with TemporaryDirectory(prefix="raycam-usd-") as folder:
        stage = usd.read(path, Path(folder), root=root if inside else None, single=True, up=up)
        before = len(core.notices)
        with _original_names(path, folder, stage.files):
            number = _core.world_add_polygons(core, plain(keys), stage.polygons, folder)
        own = stage.world["up"]
        if up is not None and up != own:
            text = (
                f"the file's up axis, {own}, is rotated to {up}; upright=False keeps the axis, for example if poses "
                "from a physics engine are applied later"
            )
            stage.notices.append(("converted_up_axis", text))
        if up is None and upright is None and core.up != own:
            text = (
                f"the file's up axis, {own}, is not rotated to {core.up}, because matrix applies to the file's axes; "
                "upright=True rotates the axis before matrix is applied"
            )
            stage.notices.append(("converted_up_axis", text))
        _set_notices(core, before, path, folder, stage)
    return number


def _set_notices(
    core: _core.World, first: int, path: str | os.PathLike[str], folder: str, stage: usd.StageContents
) -> None:
    """Replaces names of temporary files in the world's notices, and adds the stage's notices.

    The names are replaced in the notices from `first` on.
    """
    own = [
        Notice(_name_originals(str(notice), path, folder, stage.files), notice.code)
        for notice in core.notices[first:]
    ]
    stage_notices = [Notice(f"{os.fspath(path)}: {text}", code) for code, text in stage.notices]
    core.set_notices([*core.notices[:first], *own, *stage_notices])


@contextlib.contextmanager
def _original_names(path: str | os.PathLike[str], folder: str, files: dict[str, str]) -> Iterator[None]:
    """Replaces the names of temporary files in an error."""
    try:
        yield
    except FormatError as error:
        raise FormatError(_name_originals(str(error), path, folder, files), code=error.code) from None


def _name_originals(text: str, path: str | os.PathLike[str], folder: str, files: dict[str, str]) -> str:
    """Replaces the names of temporary files in a text by the names of the original files.

    The original files are the USD file and its images.
    """
    shown, temporary = os.fspath(path), re.compile(re.escape(folder) + r"(?:[/\\]+([^/\\:]+)(:\d+)?)?")
    text = temporary.sub(lambda match: files.get(match[1], shown), text)
    return text if text.startswith(shown) else f"{shown}: {text}"
