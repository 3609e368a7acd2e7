"""Virtual worlds made of triangles, seen through any camera matrix.

world = raycam.load("room.toml")
frame = raycam.render(world)
frame.save("room.png")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._core import __version__
from .calibration import FORMATS, Cameras, load_cameras, save_cameras
from .camera import Camera
from .errors import CameraError, Error, FormatError, JobError, SettingsError, WorldError
from .flow import disparity, flow
from .frame import Frame
from .interop_open3d import from_open3d
from .interop_trimesh import from_trimesh
from .keypoints import Keypoints, keypoints
from .labels import Box3D, Label, box3d, label
from .render import render
from .rig import Rig
from .texture import Texture
from .world import Animation, Object, Video, World
from .world_load import load

if TYPE_CHECKING:
    from .explain_pixel import Explanation, explain
    from .sample_world import Recipe, sample
    from .selfcheck_camera import SelfCheck, selfcheck
    from .viewer.viewer import Viewer, view

__all__ = [
    "FORMATS",
    "Animation",
    "Box3D",
    "Camera",
    "CameraError",
    "Cameras",
    "Error",
    "Explanation",
    "FormatError",
    "Frame",
    "JobError",
    "Keypoints",
    "Label",
    "Object",
    "Recipe",
    "Rig",
    "SelfCheck",
    "SettingsError",
    "Texture",
    "Video",
    "Viewer",
    "World",
    "WorldError",
    "__version__",
    "box3d",
    "disparity",
    "explain",
    "flow",
    "from_open3d",
    "from_trimesh",
    "keypoints",
    "label",
    "load",
    "load_cameras",
    "render",
    "sample",
    "save_cameras",
    "selfcheck",
    "view",
]


LATE = {
    "Explanation": "explain_pixel",
    "explain": "explain_pixel",
    "Recipe": "sample_world",
    "sample": "sample_world",
    "SelfCheck": "selfcheck_camera",
    "selfcheck": "selfcheck_camera",
    "Viewer": "viewer.viewer",
    "view": "viewer.viewer",
}


def __getattr__(name: str) -> Any:
    """Imports what most pictures do not need when it is first asked for."""
    if name in LATE:
        import importlib

        return getattr(importlib.import_module(f".{LATE[name]}", __name__), name)
    raise AttributeError(f"module 'raycam' has no attribute {name!r}")
