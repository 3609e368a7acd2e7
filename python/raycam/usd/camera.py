"""Cameras of USD as descriptions of a world file. Source: the schema `UsdGeomCamera`."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom

__all__ = ["camera_spec"]

COLUMNS = 960
"""The image width in pixels; a USD camera has no pixels. The height follows from the aperture."""


def camera_spec(source: UsdGeom.Camera, world_from_local: Gf.Matrix4d, time: Usd.TimeCode) -> dict[str, Any]:
    """Returns the description of a USD camera for a world file.

    The image covers the film. For an orthographic camera, the size of the film is the extent of the view.
    """

    def value(attribute: Usd.Attribute) -> Any:
        return attribute.Get(time)

    film = np.array(
        [value(source.GetHorizontalApertureAttr()), value(source.GetVerticalApertureAttr())], float
    )
    offset = np.array(
        [value(source.GetHorizontalApertureOffsetAttr()), value(source.GetVerticalApertureOffsetAttr())],
        float,
    )
    if not (np.isfinite(film).all() and (film > 0).all()):
        raise ValueError(f"the camera's apertures are {film[0]:g} x {film[1]:g}, expected positive numbers")
    size = [COLUMNS, max(1, round(COLUMNS * film[1] / film[0]))]
    per_film = np.array(size) / film
    center = np.array(size) / 2 + offset * per_film * [-1, 1]
    pose = world_from_local.RemoveScaleShear()
    world_from_camera = np.array(pose).T[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    rotation = world_from_camera.T
    if not np.allclose(rotation @ world_from_camera, np.eye(3), atol=1e-6):
        raise ValueError("the camera's transform has no rotation: a scale is 0, or a number is not finite")
    location = np.array(pose).T[:3, 3]
    spec: dict[str, Any] = {"name": source.GetPrim().GetName(), "size": size, "pixel_center": "half"}
    if value(source.GetProjectionAttr()) == UsdGeom.Tokens.orthographic:
        spec["projection"] = "orthographic"
        focal = per_film / Gf.Camera.APERTURE_UNIT
    else:
        focal = value(source.GetFocalLengthAttr()) * per_film
    if not (np.isfinite(focal).all() and (np.array(focal) > 0).all() and np.isfinite(center).all()):
        raise ValueError(
            f"the camera's K has focal lengths {focal[0]:g} and {focal[1]:g} and principal point {center[0]:g}, "
            f"{center[1]:g} in pixels; expected finite numbers and focal lengths above 0"
        )
    if aperture := _aperture(source, time):
        spec["aperture"] = aperture
    intrinsics = [[focal[0], 0.0, center[0]], [0.0, focal[1], center[1]], [0.0, 0.0, 1.0]]
    return spec | {"K": intrinsics, "R": rotation.tolist(), "C": location.tolist()}


def _aperture(source: UsdGeom.Camera, time: Usd.TimeCode) -> dict[str, float] | None:
    """Returns the aperture of a camera with an f-stop and a focus distance.

    The result is None for a camera without depth of field.
    """
    stop, focus = source.GetFStopAttr().Get(time), source.GetFocusDistanceAttr().Get(time)
    if source.GetProjectionAttr().Get(time) == UsdGeom.Tokens.orthographic or not (stop and focus):
        return None
    # The focal length is in tenths of the unit of length.
    length = source.GetFocalLengthAttr().Get(time) * Gf.Camera.FOCAL_LENGTH_UNIT
    if not (np.isfinite([stop, focus]).all() and stop > 0 and focus > 0):
        return None
    return {"radius": float(length / (2 * stop)), "focus": float(focus)}
