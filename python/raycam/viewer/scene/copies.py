"""Cameras as the text of other tools' files, by the writers of `raycam.save_cameras`."""

from __future__ import annotations

from ..._core import Record, write_cameras
from ...camera import Camera

__all__ = ["FILES", "camera_text"]

FILES = {"opencv": ("camera.yaml", [""]), "colmap": ("colmap", ["cameras.txt", "images.txt"])}
"""The name that a format is written under, and its files that hold a camera."""


def camera_text(camera: Camera, format: str) -> tuple[str, list[str]]:
    """The text of a camera in a format, and notices. Raises `FormatError` where the format does not hold it."""
    path, names = FILES[format]
    made, notices = write_cameras([Record.of("camera", camera._core, None, None, None)], path, format)
    files = dict(made)
    parts = [(f"# {name}\n" if name else "") + files[name].decode() for name in names]
    return "\n".join(parts), notices
