"""Descriptions of changed objects and lights for the core."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..arguments import floats
from ..errors import WorldError
from .description import corner_values, indices
from .keys import PHOTOMETRIC_KEYS, STRENGTH_KEYS, light_keys, object_keys
from .usd_files import is_usd

__all__ = ["describe_light_change", "describe_object_change"]

CORNERS = {"face_colors": 3, "vertex_colors": 3, "uvs": 2, "normals": 3}
"""Columns of a mesh's arrays per corner or face."""

EITHER = (
    ("power", "intensity"),
    ("power", "irradiance"),
    ("radiance", "zenith"),
    ("radiance", "horizon"),
    ("radiance", "ground"),
)
"""Pairs of light keys that exclude each other."""


def describe_object_change(keys: dict[str, Any]) -> dict[str, Any]:
    """Returns the description of an object's changes.

    Raises `WorldError` for invalid keys and values.

    As in `World.add_mesh`, `faces` means `triangles` and `material` is a dict of material keys. `normals` may be None
    for flat faces.
    """
    keys = dict(keys)
    for part in (keys.pop("material", None) or {},):
        twice = keys.keys() & part.keys()
        if twice:
            raise WorldError(
                f"{', '.join(sorted(twice))}: passed twice, directly and in material", code="duplicate_name"
            )
        keys |= part
    keys = object_keys(None, keys)
    if "faces" in keys:
        if "triangles" in keys:
            raise WorldError(
                "faces and triangles are two names of the same key; use only one of them",
                code="conflicting_values",
            )
        keys["triangles"] = keys.pop("faces")
    if is_usd(keys.get("mesh")):
        raise WorldError(
            f"mesh {keys['mesh']!r}: an existing object cannot use a USD file; use remove_object, then add_object",
            code="conflicting_values",
        )
    if "triangles" in keys:
        keys["triangles"] = indices("faces", keys["triangles"])
    if "vertices" in keys:
        keys["vertices"] = floats("vertices", keys["vertices"], ("n", 3), error=WorldError)
    for name, columns in CORNERS.items():
        if name in keys:
            flat = name == "normals" and keys[name] is None
            keys[name] = [] if flat else corner_values(name, keys[name], columns)
    if "matrix" in keys:
        keys["matrix"] = floats("matrix", keys["matrix"], (4, 4), (3, 4), error=WorldError)
    given = {name: value for name, value in keys.items() if value is not None}
    if not given:
        raise WorldError(
            "set_object requires at least one key, for example set_object(which, matrix=...)",
            code="missing_value",
        )
    return given


def describe_light_change(
    light: Mapping[str, Any], description: Mapping[str, Any] | str | None, keys: dict[str, Any]
) -> tuple[dict[str, Any], bool]:
    """Returns a light's complete description after a change.

    The second value is True if the light keeps its image or profile.
    """
    given = light_keys(description, keys)
    if not given:
        raise WorldError(
            "set_light requires at least one key, for example set_light(number, irradiance=...)",
            code="missing_value",
        )
    if given.get("type", light["type"]) != light["type"]:
        return {**{key: light[key] for key in ("name", "visible") if key in light}, **given}, False
    merged = dict(light)
    if given.keys() & set(PHOTOMETRIC_KEYS):
        for key in STRENGTH_KEYS:
            merged.pop(key, None)
    if "target" in given:
        for way in ("direction", "u", "v"):
            merged.pop(way, None)
    for one, other in EITHER:
        for new, old in ((one, other), (other, one)):
            if new in given and old in merged and old not in given:
                value = merged.pop(old)
                if old == "radiance":  # replacing a uniform sky by a gradient keeps its brightness
                    merged.setdefault("zenith", value)
                    merged.setdefault("horizon", value)
    if "radiance" in given:
        for name in ("zenith", "horizon", "ground"):
            if name not in given:
                merged.pop(name, None)
    return {**merged, **given}, not given.keys() & {"image", "profile"}
