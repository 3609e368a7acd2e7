"""Virtual worlds made of triangles, seen through any camera matrix.

world = raycam.load("room.toml")
frame = raycam.render(world)
frame.save("room.png")
"""

from __future__ import annotations

from ._core import __version__
from .camera import Camera
from .errors import CameraError, Error, FormatError, SettingsError, WorldError
from .explain import explain
from .frame import Frame
from .render import render
from .world import Object, Video, World, load

__all__ = [
    "Camera",
    "CameraError",
    "Error",
    "FormatError",
    "Frame",
    "Object",
    "SettingsError",
    "Video",
    "World",
    "WorldError",
    "__version__",
    "explain",
    "load",
    "render",
]
