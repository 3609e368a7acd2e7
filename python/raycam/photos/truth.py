"""Depth, normals and masks for photographs, as a data set with the photographs' names."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..calibration import Cameras
from ..camera import Camera
from ..dataset import DatasetResult, write
from ..errors import SettingsError
from ..lidar import Lidar
from ..notices import warn_all
from ..render.arguments import world_of
from ..world import World
from .placement import placement_notices

__all__ = ["named_photographs", "named_viewpoints", "photo_truth"]


def photo_truth(
    world: World | str | os.PathLike[str],
    cameras: Mapping[str, Camera] | Sequence[Camera],
    folder: str | os.PathLike[str],
    *,
    channels: Sequence[str] = ("depth",),
    layout: str = "plain",
    images: Mapping[str, str] | None = None,
    **options: Any,
) -> DatasetResult:
    """Writes depth, normals, masks and other channels for photographs.

    Images have the lens models of the cameras. `world` contains the mesh in the cameras' coordinates; `cameras` are
    posed cameras, for example from `load_cameras`. The files have the photographs' names (`cameras.images`, or `images`
    by camera name, or else the cameras' names), in one folder per channel: depth/IMG_0001.png. Every value belongs to
    the exact ray through the pixel's centre. Channels:

    ========== ===================================================================================================
    depth      along the principal axis; uint16 PNG in steps of `depth_scale` millimetres (1), 0 without a surface
               and beyond the range; `depth_format` "exr" or "npy": float32 metres, 0 without a surface
    distance   along the ray; the same file formats as for depth
    normal     unit normal in camera axes, PNG of `normal_bits` (8 or 16): 0..max is -1..1, 0 without a surface;
               `normal_axes` "opencv" (x right, y down, z forward) or "opengl" (x right, y up, z backward)
    mask       255 for pixels with a surface
    instance   uint16 PNG: object id + 1, 0 without a surface
    position   the point in the world, EXR with float32, NaN without a surface
    valid      255 for pixels with a ray
    confidence 255 times the cosine of incidence; 0 without a surface and for mixed pixels, whose neighbours show
               no surface, or one off the tangent plane by more than 2 % of the depth
    ========== ===================================================================================================

    `error.json` contains each photograph's share of pixels without a surface. The default `layout` is "plain". Other
    layouts have fixed files:

    * "scannetpp": render_depth/NAME.png, uint16 millimetres
    * "mvsnet": Depths/depth_map_0000.pfm, depth_visual_0000.png and Cameras/00000000_cam.txt; pinhole cameras
    * "colmap": stereo/depth_maps/NAME.JPG.geometric.bin, stereo/normal_maps and sparse/; pinhole cameras
    * "blendedmvs": rendered_depth_maps/00000000.pfm and cams/00000000_cam.txt; pinhole cameras

    Numbered layouts have the photographs' names in `photographs.json`. `facing="front"` ignores surfaces seen from
    behind. `options` also include `workers`, `shard`, `resume` and `progress` of `raycam.dataset.write`; the same call
    resumes an interrupted job. A notice is issued if fewer than half of the cameras show the world.

    Returns a `raycam.dataset.DatasetResult`. Raises `SettingsError`, `CameraError`, `JobError` and `OSError` as
    `raycam.dataset.write`.
    """
    found = world_of(world)
    named = named_photographs(cameras, images)
    lost = placement_notices(found, named)
    warn_all(lost)
    written = write(found, folder, "photos", cameras=named, channels=list(channels), layout=layout, **options)
    return replace(written, notices=(*lost, *written.notices))


def named_photographs(
    cameras: Mapping[str, Camera] | Sequence[Camera], images: Mapping[str, str] | None = None
) -> dict[str, Camera]:
    """Returns cameras by the names of their photographs, or by their own names or numbers.

    `images` maps camera names to names of photographs (default: `cameras.images`). Raises `SettingsError` for objects
    other than cameras, and for two cameras with the same photograph.
    """
    return _named(cameras, images, Camera, "raycam.Camera")


def named_viewpoints(
    cameras: Mapping[str, Camera | Lidar] | Sequence[Camera | Lidar],
    images: Mapping[str, str] | None = None,
) -> dict[str, Camera | Lidar]:
    """Returns cameras and lidars by name, with the names and errors of `named_photographs`."""
    return _named(cameras, images, (Camera, Lidar), "raycam.Camera or raycam.Lidar")


def _named(cameras: Any, images: Mapping[str, str] | None, kinds: Any, expected: str) -> dict[str, Any]:
    if isinstance(cameras, Camera | Lidar | str | os.PathLike):
        raise SettingsError(
            f"cameras must be a list or mapping of cameras, got {cameras!r}; "
            "pass [camera] or raycam.load_cameras(FILE)",
            code="wrong_type",
        )
    known = cameras.images if isinstance(cameras, Cameras) else {}
    known = {**known, **(images or {})}
    given = cameras if isinstance(cameras, Mapping) else {f"{i:06d}": one for i, one in enumerate(cameras)}
    if not given:
        raise SettingsError("cameras is empty; pass at least one camera", code="missing_value")
    found: dict[str, Any] = {}
    for name in given:
        camera, photograph = given[name], known.get(name, name)
        if not isinstance(camera, kinds):
            remedy = (
                "; for lidars, use surface_visibility or raycam.scan" if isinstance(camera, Lidar) else ""
            )
            raise SettingsError(
                f"cameras[{name!r}] must be a {expected}, not {type(camera).__name__}{remedy}",
                code="wrong_type",
            )
        if photograph in found:
            raise SettingsError(
                f"photograph {photograph!r} belongs to two cameras; specify one photograph per camera with images=",
                code="duplicate_name",
            )
        found[photograph] = camera
    return found
