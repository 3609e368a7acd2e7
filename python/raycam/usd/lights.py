"""Lights of USD as descriptions of a world file.

Source: the schemas of `UsdLux`, "Quantities and Units".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdLux

from .arrays import NO_INDEX
from .handover import MeshArrays
from .meshes import rows

__all__ = ["cylinder_light", "light_spec"]

CYLINDER_SIDES = 32
"""Number of sides of the prism that replaces a cylinder light."""

Found = tuple[dict[str, Any] | None, str | None]


def light_spec(
    prim: Usd.Prim,
    world_from_local: Gf.Matrix4d,
    image: Callable[[Sdf.AssetPath], str | None],
    up: str,
    time: Usd.TimeCode,
) -> Found:
    """Returns the light's description and a notice; either may be None.

    `image` returns the file of an asset.
    """
    kind = prim.GetTypeName()

    def value(key: str, default: Any) -> Any:
        attribute = prim.GetAttribute(f"inputs:{key}")
        found = attribute.Get(time) if attribute else None
        return default if found is None else found

    color, fault = _color(kind, value)
    if fault:
        return None, f"ignored: {fault}"
    matrix = np.array(rows(world_from_local))
    place, axes = matrix[:3, 3], matrix[:3, :3]
    scale = np.linalg.norm(axes, axis=0)
    if not np.isfinite(matrix).all() or (kind != "SphereLight" and np.linalg.matrix_rank(axes) < 3):
        return None, "ignored: the light's transform has scale 0 or is not finite"
    forward = (-axes[:, 2]).tolist()
    normalized = value("normalize", False)
    fault = _odd_size(kind, value, normalized)
    if fault:
        return None, f"ignored: {fault}"

    def radiance(area: float) -> list[float]:
        return [float(value) for value in color / (area if normalized else 1.0)]

    if kind == "DistantLight":
        angle = np.radians(value("angle", 0.53))
        solid = np.pi * np.sin(angle / 2) ** 2
        irradiance = color if normalized or solid == 0 else color * solid
        sun = {"type": "sun", "direction": forward, "irradiance": irradiance.tolist()}
        return sun | {"angular_diameter": float(np.degrees(angle))}, None
    if kind == "SphereLight":
        point = prim.GetAttribute("treatAsPoint").Get(time)
        radius = float(value("radius", 0.5) * scale.mean())
        power = color * np.pi * (1.0 if normalized else 4 * np.pi * radius**2)
        bulb: dict[str, Any] = {"position": place.tolist(), "power": power.tolist()}
        cone = value("shaping:cone:angle", 180.0)
        if not cone > 0:
            return None, f"ignored: the light's cone angle is {cone:g}"
        if cone <= 90:
            # Intensity on the axis: radiance times the area of the visible disk.
            intensity = (power / (4 * np.pi)).tolist()
            soft = float(np.clip(value("shaping:cone:softness", 0.0), 0, 1))
            spot = {"type": "spot", "position": place.tolist(), "direction": forward, "intensity": intensity}
            return spot | {"inner": cone * (1 - soft), "outer": float(cone)}, None
        return {"type": "point", **bulb, "radius": 0.0 if point else radius}, None
    if kind == "RectLight":
        u = axes[:, 0] * value("width", 1.0)
        v = -axes[:, 1] * value("height", 1.0)
        area = float(np.linalg.norm(np.cross(u, v)))
        panel = {"type": "area", "position": place.tolist(), "u": u.tolist(), "v": v.tolist()}
        said = "the light's texture is ignored" if _file(prim, time) else None
        return panel | {"radiance": radiance(area)}, said
    if kind == "DiskLight":
        radius = float(value("radius", 0.5) * scale[:2].mean())
        disk = {"type": "disk", "position": place.tolist(), "direction": forward, "radius": radius}
        return disk | {"radiance": radiance(np.pi * radius**2)}, None
    if kind in ("DomeLight", "DomeLight_1"):
        return _dome_light(prim, color, axes, image, up, time)
    return None, f"ignored: {kind or 'a prim without a type'} is not supported as a light"


def _dome_light(
    prim: Usd.Prim,
    color: Any,
    axes: Any,
    image: Callable[[Sdf.AssetPath], str | None],
    up: str,
    time: Usd.TimeCode,
) -> Found:
    """The description of a dome light with its image."""
    kind = prim.GetTypeName()
    asset = _file(prim, time)
    if not asset:
        return {"type": "sky", "radiance": color.tolist()}, None
    file = image(asset)
    if file is None:
        return None, "ignored: the light's image cannot be used"
    # The middle of a latlong image is at the light's +z, the image's top at +y.
    middle, pole = axes[:, 2], axes[:, 1]
    if kind == "DomeLight_1" and _pole_axis(prim, up) == "Z":
        middle, pole = -axes[:, 1], axes[:, 2]
    yaw = np.arctan2(-middle[0], -middle[2]) if up == "y" else np.arctan2(middle[1], middle[0])
    said = None
    if np.abs(pole / np.linalg.norm(pole) - np.array([0, up == "y", up == "z"])).max() > 1e-3:
        said = "the light's pole axis is not the world's up axis; the image is shown upright"
    elif np.ptp(color) > 1e-6 * color.max():
        said = "the light's image is multiplied by the mean of the light's colour"
    sky = {"type": "environment", "image": file, "yaw": float(np.degrees(yaw))}
    return sky | {"scale": float(color.mean())}, said


def _odd_size(kind: str, value: Callable[[str, Any], Any], normalized: bool) -> str | None:
    """The reason why the power of a light with this size is undefined; None for valid sizes."""
    keys = {"DistantLight": ["angle"], "RectLight": ["width", "height"]}.get(kind, ["radius"])
    for key in keys:
        size = value(key, 1.0)
        may_be_zero = kind == "DistantLight" or (kind == "SphereLight" and normalized)
        if (
            not np.isfinite(size)
            or size < 0
            or (size == 0 and not may_be_zero)
            or (key == "angle" and size > 180)
        ):
            return f"the light's {key} is {size:g}"
    return None


def _color(kind: str, value: Callable[[str, Any], Any]) -> tuple[Any, str | None]:
    """The colour of a light times its intensity, or the reason why it cannot be used."""
    color = np.array(value("color", Gf.Vec3f(1)), float)
    if value("enableColorTemperature", False):
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(value("colorTemperature", 6500.0)))
    fallback = 50000.0 if kind == "DistantLight" else 1.0
    color = color * value("intensity", fallback) * 2.0 ** value("exposure", 0.0)
    if not np.isfinite(color).all():
        return color, "the light's colour or intensity is not finite"
    return np.maximum(color, 0.0), None if (color > 0).any() else "the light has no intensity"


def _file(prim: Usd.Prim, time: Usd.TimeCode) -> Sdf.AssetPath | None:
    attribute = prim.GetAttribute("inputs:texture:file")
    asset = attribute.Get(time) if attribute else None
    return asset if asset and asset.path else None


def _pole_axis(prim: Usd.Prim, up: str) -> str:
    """The axis at the top of a dome light's image, "Y" or "Z"."""
    axis = str(prim.GetAttribute("poleAxis").Get() or "scene")
    return up.upper() if axis == "scene" else axis


def cylinder_light(
    prim: Usd.Prim, world_from_local: Gf.Matrix4d, time: Usd.TimeCode
) -> tuple[MeshArrays, list[float]]:
    """The side of a cylinder light as a mesh along x, and its radiance.

    Raises `ValueError` for a light that cannot be shown, for example with an invalid size or transform.

    With `normalize`, the power refers to the cylinder's area in the world, as for other lights.
    """

    def value(key: str, default: Any) -> Any:
        attribute = prim.GetAttribute(f"inputs:{key}")
        found = attribute.Get(time) if attribute else None
        return default if found is None else found

    color, fault = _color("CylinderLight", value)
    radius, length = float(value("radius", 0.5)), float(value("length", 1.0))
    if fault is None and not (np.isfinite([radius, length]).all() and radius > 0 and length > 0):
        fault = f"the light's radius is {radius:g} and its length {length:g}"
    axes = np.array(rows(world_from_local))[:3, :3]
    if fault is None and not (np.isfinite(axes).all() and np.linalg.matrix_rank(axes) == 3):
        fault = "the light's transform has scale 0 or is not finite"
    if fault:
        raise ValueError(f"ignored: {fault}")
    turns = np.linspace(0, 2 * np.pi, CYLINDER_SIDES, endpoint=False)
    # The prism's area equals the cylinder's area.
    sides = np.pi / (CYLINDER_SIDES * np.sin(np.pi / CYLINDER_SIDES))
    circle = np.column_stack([np.cos(turns), np.sin(turns)]) * radius * sides
    ends = [np.column_stack([np.full(CYLINDER_SIDES, x), circle]) for x in (-length / 2, length / 2)]
    points = np.concatenate(ends)
    low = np.arange(CYLINDER_SIDES)
    following = np.roll(low, -1)
    quads = np.column_stack([low, following, following + CYLINDER_SIDES, low + CYLINDER_SIDES])
    placed = points @ axes.T
    corners = placed[quads]
    area = (
        np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1).sum()
        / 2
    )
    index = np.full((quads.size, 3), NO_INDEX, np.uint32)
    index[:, 0] = quads.ravel()
    empty = np.zeros((0, 3))
    polygons = np.column_stack([np.full(CYLINDER_SIDES, 4), np.zeros(CYLINDER_SIDES)])
    mesh = MeshArrays(points, empty, np.zeros((0, 2)), empty, polygons, index, False)
    return mesh, (color / (area if value("normalize", False) else 1.0)).tolist()
