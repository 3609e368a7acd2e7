"""Lights of SDF worlds (http://sdformat.org/spec, element light)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, Notice
from .sdf_frames import read_numbers, read_pose
from .xml_tree import Element

__all__ = ["SdfLight", "ambient_light", "read_light"]

TYPES = {"directional": "sun", "point": "point", "spot": "spot"}
"""Types of lights in SDF, and in raycam."""
DEFAULT_AMBIENT = 0.4
"""Default of `<scene><ambient>`, for worlds that do not specify it."""
MIN_DISTANCE = 0.1
"""Smallest distance in metres from the origin at which the strength of a lamp is evaluated."""

Fail = Callable[[Element, str, str], FormatError]


@dataclass(frozen=True)
class SdfLight:
    """A light as arguments of `World.add_light`."""

    type: str
    keys: dict[str, Any]
    notices: list[Notice] = field(default_factory=list)


def read_light(
    light: Element, fail: Fail, name: str, world_from_light: Floats | None = None
) -> SdfLight | None:
    """Returns a `<light>`; None if the light is turned off or black.

    A white surface that faces a directional light shows its `diffuse` colour times its `intensity`. The light of lamps
    decreases with the square of the distance; if the file specifies another attenuation, the strength is correct at the
    world's origin only, with a notice. `world_from_light` replaces the element's own pose. Raises `FormatError` for
    unknown types, negative numbers, and invalid cone angles.
    """
    kind = light.attributes.get("type", "point").strip()
    if kind not in TYPES:
        raise fail(light, f"unknown type of light {kind!r}; expected {', '.join(TYPES)}", "unknown_name")

    def numbers(owner: Element | None, tag: str, default: tuple[float, ...]) -> tuple[float, ...]:
        found = None if owner is None else owner.find(tag)
        if found is None:
            return default
        values = read_numbers(found, len(found.text.split()) if tag == "diffuse" else len(default), fail)
        if tag != "direction" and min(values) < 0:
            raise fail(found, f"<{tag}> must not be negative, got {min(values):g}", "out_of_range")
        return values

    diffuse = numbers(light, "diffuse", (1.0, 1.0, 1.0, 1.0))
    if len(diffuse) not in (3, 4):
        raise fail(light, f"<diffuse> must have 3 or 4 numbers, got {len(diffuse)}", "wrong_shape")
    strength = np.pi * numbers(light, "intensity", (1.0,))[0] * np.array(diffuse[:3])
    on = light.find("light_on")
    if not strength.any() or (on is not None and on.text.strip().lower() in ("0", "false")):
        return None
    pose = read_pose(light, fail)[0] if world_from_light is None else world_from_light
    direction = pose[:3, :3] @ numbers(light, "direction", (0.0, 0.0, -1.0))
    if not np.linalg.norm(direction) > 0:
        raise fail(light, "<direction> must not be 0 0 0", "out_of_range")
    label = f"{name}:{light.line}: light {light.attributes.get('name', kind)!r}"
    notices = []
    shadows = light.find("cast_shadows")
    if shadows is not None and shadows.text.strip().lower() in ("0", "false"):
        notices.append(
            Notice(
                f"{label}: cast_shadows = false is not supported; the light casts shadows",
                "approximated_value",
            )
        )
    if kind == "directional":
        return SdfLight("sun", {"direction": direction.tolist(), "irradiance": strength.tolist()}, notices)
    attenuation = light.find("attenuation")
    constant, linear, quadratic = (
        numbers(attenuation, tag, (default,))[0]
        for tag, default in (("constant", 1.0), ("linear", 1.0), ("quadratic", 0.0))
    )
    distance = max(float(np.linalg.norm(pose[:3, 3])), MIN_DISTANCE)
    fading = constant + linear * distance + quadratic * distance**2
    if not fading > 0:
        raise fail(
            attenuation or light,
            "constant, linear and quadratic of <attenuation> must not all be 0",
            "out_of_range",
        )
    if constant or linear:
        text = (
            f"{label}: <attenuation> is replaced by a falloff with the square of the distance; "
            "both agree only at the world's origin"
        )
        notices.append(Notice(text, "approximated_value"))
    keys: dict[str, Any] = {
        "position": pose[:3, 3].tolist(),
        "intensity": (strength * distance**2 / fading).tolist(),
    }
    if kind == "spot":
        spot = light.find("spot")
        inner, outer = (numbers(spot, f"{tag}_angle", (0.0,))[0] for tag in ("inner", "outer"))
        if not (0 <= inner <= outer and 0 < outer < np.pi):
            raise fail(
                spot or light,
                f"a spot light requires 0 <= inner_angle <= outer_angle < pi, got {inner:g} and {outer:g}",
                "out_of_range",
            )
        keys["direction"] = direction.tolist()
        keys |= {"inner": float(np.degrees(inner / 2)), "outer": float(np.degrees(outer / 2))}
    return SdfLight(TYPES[kind], keys, notices)


def ambient_light(world: Element, fail: Fail) -> SdfLight | None:
    """Returns the ambient light of a `<world>` as a uniform sky, or None for black light."""
    scene = world.find("scene")
    ambient = None if scene is None else scene.find("ambient")
    color = (
        (DEFAULT_AMBIENT,) * 3
        if ambient is None
        else read_numbers(ambient, len(ambient.text.split()), fail)[:3]
    )
    if len(color) != 3 or min(color) < 0:
        raise fail(
            ambient or world,
            f"<ambient> must have 3 or 4 numbers that are not negative, got {list(color)}",
            "wrong_shape",
        )
    return SdfLight("sky", {"radiance": list(color)}) if any(color) else None
