"""Virtual worlds made of triangles, seen through any camera matrix.

world = raycam.load("room.toml")
frame = raycam.render(world)
frame.save("room.png")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._core import __version__
from .annotations.flow import disparity, flow
from .annotations.keypoints import Keypoints, keypoints
from .annotations.labels import Box3D, Label, box3d, label
from .calibration import FORMATS, Cameras, load_cameras, save_cameras
from .camera import Background, Camera
from .errors import (
    CameraError,
    Cancelled,
    Error,
    FormatError,
    JobError,
    LidarError,
    Notice,
    SettingsError,
    WorldError,
)
from .interop.mujoco import from_mujoco
from .interop.newton import from_newton
from .interop.open3d import from_open3d
from .interop.trimesh import from_trimesh
from .notices import strict
from .render import render
from .render.frame import Frame
from .render.many import Frames, render_many
from .render.progressive import Cancel, Progressive, progressive
from .rig import Rig
from .sensors import Sensor
from .world import Animation, Object, Topology, Video, World
from .world.load import load
from .world.texture import Texture

if TYPE_CHECKING:
    from .annotations.refinement import Refined, refine
    from .baking import BakedMaps, bake
    from .calibration_check import SelfCheck, selfcheck
    from .explanation import BeamExplanation, Explanation, explain, explain_beam
    from .lidar import Lidar, Scan, load_lidar, scan, scan_many
    from .photos import (
        PhotoTexture,
        SurfaceSamples,
        SurfaceVisibility,
        photo_truth,
        sample_surface,
        surface_visibility,
        texture_from_photos,
    )
    from .randomize import Recipe, sample
    from .viewer.view import view
    from .viewer.viewer import Viewer
    from .world.settle import Settled, settle

__all__ = [
    "FORMATS",
    "Animation",
    "Background",
    "BakedMaps",
    "BeamExplanation",
    "Box3D",
    "Camera",
    "CameraError",
    "Cameras",
    "Cancel",
    "Cancelled",
    "Error",
    "Explanation",
    "FormatError",
    "Frame",
    "Frames",
    "JobError",
    "Keypoints",
    "Label",
    "Lidar",
    "LidarError",
    "Notice",
    "Object",
    "PhotoTexture",
    "Progressive",
    "Recipe",
    "Refined",
    "Rig",
    "Scan",
    "SelfCheck",
    "Sensor",
    "SettingsError",
    "Settled",
    "SurfaceSamples",
    "SurfaceVisibility",
    "Texture",
    "Topology",
    "Video",
    "Viewer",
    "World",
    "WorldError",
    "__version__",
    "bake",
    "box3d",
    "disparity",
    "explain",
    "explain_beam",
    "flow",
    "from_mujoco",
    "from_newton",
    "from_open3d",
    "from_trimesh",
    "keypoints",
    "label",
    "load",
    "load_cameras",
    "load_lidar",
    "photo_truth",
    "progressive",
    "refine",
    "render",
    "render_many",
    "sample",
    "sample_surface",
    "save_cameras",
    "scan",
    "scan_many",
    "selfcheck",
    "settle",
    "strict",
    "surface_visibility",
    "texture_from_photos",
    "view",
]


_LAZY_IMPORTS = {
    "Refined": "annotations.refinement",
    "refine": "annotations.refinement",
    "Explanation": "explanation",
    "BeamExplanation": "explanation",
    "explain": "explanation",
    "explain_beam": "explanation",
    "Recipe": "randomize",
    "sample": "randomize",
    "BakedMaps": "baking",
    "bake": "baking",
    "photo_truth": "photos",
    "PhotoTexture": "photos",
    "texture_from_photos": "photos",
    "SurfaceSamples": "photos",
    "sample_surface": "photos",
    "SurfaceVisibility": "photos",
    "surface_visibility": "photos",
    "Settled": "world.settle",
    "settle": "world.settle",
    "Lidar": "lidar",
    "Scan": "lidar",
    "load_lidar": "lidar",
    "scan": "lidar",
    "scan_many": "lidar",
    "SelfCheck": "calibration_check",
    "selfcheck": "calibration_check",
    "Viewer": "viewer.viewer",
    "view": "viewer.view",
}


_MODULES = ("codes", "data", "dataset", "jobs", "photos", "video")
"""Modules that are part of the public interface, `raycam.dataset.write` for example."""


def __getattr__(name: str) -> Any:
    """Imports a name of `_LAZY_IMPORTS` or `_MODULES` on first use.

    Most programs need none of these names.
    """
    import importlib
    import sys

    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if name in _LAZY_IMPORTS:
        return getattr(importlib.import_module(f".{_LAZY_IMPORTS[name]}", __name__), name)
    from .io.other_names import no_attribute

    raise no_attribute(sys.modules[__name__], name)


def __dir__() -> list[str]:
    """The public names, including names that are imported on first use."""
    return sorted({*__all__, *_MODULES, "__doc__", "__name__", "__path__"})
