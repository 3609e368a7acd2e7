"""Cameras as text in other tools' formats, and the command that renders the image.

The formats are those of `raycam.save_cameras`.
"""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..._core import Record, write_cameras
from ...camera import Camera
from ...errors import Notice

__all__ = ["FILES", "camera_table", "camera_text", "render_command"]

FILES = {"opencv": ("camera.yaml", [""]), "colmap": ("colmap", ["cameras.txt", "images.txt"])}
"""For each format, the path that is written, and the files below it that contain the camera ("": the path itself)."""


def camera_text(camera: Camera, format: str) -> tuple[str, list[Notice]]:
    """Returns the text of a camera in a format, and notices.

    Raises `FormatError` if the format does not support the camera.
    """
    path, names = FILES[format]
    made, notices = write_cameras([Record.of("camera", camera._core, None, None, None)], path, format)
    files = dict(made)
    parts = [(f"# {name}\n" if name else "") + files[name].decode() for name in names]
    return "\n".join(parts), notices


def camera_table(camera: Camera) -> str:
    """A camera as the `[camera]` table of a world file, with all digits."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in camera.to_dict().items()]
    return "\n".join(["[camera]", *lines])


def render_command(file: Path | str, camera: Camera | str | None, options: Mapping[str, Any]) -> str:
    """Returns shell commands that render `file` with a camera.

    A camera of the world is given by its name; any other camera is written to a file first. `options` are those of
    `raycam render` by name; None is omitted, True is an option without a value. Without a camera, `raycam render`
    frames the world. A file below this process's current folder gets a path relative to it.
    """
    if isinstance(file, Path):
        below = os.path.relpath(file) if file.drive == Path.cwd().drive else ".."
        file = str(file) if below.startswith("..") else below
    first, name = "", camera
    if isinstance(camera, Camera):
        first, name = f"cat > camera.toml <<'EOF'\n{camera_table(camera)}\nEOF\n", "camera.toml"
    given = {**options, "camera": name}
    words = ["raycam", "render", file, "-o", "picture.png"]
    for name, value in given.items():
        # A value that begins with a minus sign is joined to its option by =, because argparse would read it as an
        # option.
        if isinstance(value, tuple):
            words += [f"--{name}", *map(str, value)]
        elif value is True:
            words.append(f"--{name}")
        elif value is not None:
            words += [f"--{name}={value}"] if str(value).startswith("-") else [f"--{name}", str(value)]
    return first + shlex.join(words)
