"""The materials of an object's slots in a view: their values, and edits of one slot or of all slots."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._core import srgb_from_linear
from ...arguments import real
from ...errors import SettingsError, WorldError
from ...one_line import counted
from ...world import World
from .contents import check_object, materials_of_object

__all__ = ["MATERIAL_KEYS", "describe_material", "edit_material", "list_slots"]

MATERIAL_KEYS = ("color", "roughness", "metallic", "emission")
"""The values of a material that the client changes."""
MAX_LISTED_SLOTS = 200
"""Maximum number of an object's slots that the client lists."""


def list_slots(world: World, number: int) -> list[dict[str, Any]]:
    """The first slots of an object: each material's name, its colour as text, and whether it has a texture."""
    return [
        {"name": each["name"], "color": color_text(each["color"]), "textured": each["texture"] is not None}
        for each in materials_of_object(world, number)[:MAX_LISTED_SLOTS]
    ]


def describe_material(world: World, number: int, slot: int = 0) -> dict[str, Any]:
    """The values of the material in an object's slot, for the client's fields; empty for an unknown object or slot."""
    found = materials_of_object(world, number)
    return _fields(found[slot]) if slot < len(found) else {}


def edit_material(world: World, number: int, slot: int | None, key: str, value: Any) -> World:
    """Returns a copy of a world with a changed material in a slot of an object; if `slot` is None, in all slots.

    Keys: `color` (text), `roughness` and `metallic` (0 to 1), `emission` (W/(m² sr)). A change of roughness or metallic
    makes materials without this key principled; they keep their colours, textures, and the other key's value. Raises
    `WorldError` for an unknown object or slot, and `SettingsError` for an invalid value.
    """
    check_object(world, number)
    materials = materials_of_object(world, number)
    slots = range(len(materials)) if slot is None else [slot]
    if slot is not None and slot >= len(materials):
        raise WorldError(
            f"object {number} has no material slot {slot}; it has {counted(len(materials), 'slot')}, numbered from 0",
            code="index_out_of_range",
        )
    changed = world.copy()
    tables: dict[str | int, dict[str, Any]] = {
        each: _keys_of_change(_fields(materials[each]), key, value) for each in slots
    }
    changed.set_object(number, slots=tables)
    return changed


def _keys_of_change(shown: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Returns the keys of `World.set_object` that change a value of a material."""
    if key == "color" and isinstance(value, str):
        return {"color": value}
    if key == "emission":
        return {"emission": [real(key, value, 0.0, 1e6)] * 3}
    if key in ("roughness", "metallic"):
        share = real(key, value, 0.0, 1.0)
        with_key = ("principled", "metal", "glass") if key == "roughness" else ("principled",)
        kept = {"type": "principled", "roughness": shown["roughness"], "metallic": shown["metallic"]}
        return {**({} if shown["model"] in with_key else kept), key: share}
    raise SettingsError(
        f"material key {key} cannot be set to {str(value)[:80]}: the key is unknown, or the value has a wrong type",
        code="unknown_key",
    )


def _fields(found: dict[str, Any]) -> dict[str, Any]:
    """The values of a material for the client's fields."""
    model = found["model"]
    name, values = (model, {}) if isinstance(model, str) else next(iter(model.items()))
    return {
        "model": name.lower(),
        "color": color_text(found["color"]),
        "linear": found["color"],
        "textured": found["texture"] is not None,
        "emission": max(found["emission"]["value"]),
        "roughness": _roughness(name, values),
        "metallic": values["metallic"]["value"] if name == "Principled" else float(name == "Metal"),
    }


def color_text(linear: list[float]) -> str:
    """Returns a linear colour as "#rrggbb" in sRGB."""
    bytes_ = srgb_from_linear(np.array(linear, np.float32), 1.0, 8, "standard")
    return "#" + "".join(f"{int(each):02x}" for each in bytes_)


def _roughness(model: str, values: dict[str, Any]) -> float:
    """The roughness of a material, as in the channel `roughness`: 1 without a glossy lobe.

    For a Phong lobe, it is the roughness of the microfacets that correspond to its exponent (B. Walter et al.,
    "Microfacet Models for Refraction through Rough Surfaces", 2007, section 5.2).
    """
    if model == "Principled":
        return float(values["roughness"]["value"])
    if model in ("Metal", "Glass"):
        return float(values["roughness"])
    if model == "Phong" and any(values["specular"]):
        return float((2 / (values["shininess"] + 2)) ** 0.25)
    return 1.0
