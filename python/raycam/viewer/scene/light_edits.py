"""Edits of lights in a view.

Strength, colour, position and direction can be changed; lights can be added and removed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..._core import srgb_from_linear
from ...arguments import Floats, real
from ...errors import SettingsError, WorldError
from ...one_line import counted
from ...srgb import linear_from_srgb
from ...world import World
from ...world.framing import without_ground
from ...world.keys import STRENGTH_KEYS
from .rotation import up_axis

__all__ = ["NEW_LIGHTS", "UNITS", "describe_light", "edit_light"]

NEW_LIGHTS = ("point", "spot", "sun", "area")
"""The types of lights that can be added."""
UNITS = {"irradiance": "W/m²", "power": "W", "intensity": "W/sr", "radiance": "W/(m² sr)"}
"""The unit of each strength."""
IRRADIANCE = 3.0
"""The irradiance of a new light at the world's centre, W/m²."""
MAX_LEVEL = 1e9
SPOT_ANGLES = {"inner": 20.0, "outer": 30.0}
AREA_SHARE = 0.4
"""The side of a new area light, as a share of the world's diagonal."""


def describe_light(light: dict[str, Any], number: int) -> dict[str, Any]:
    """The light's name and the values that the client can change.

    A value that the light's type does not have is None.
    """
    key = _strength_key(light)
    strength = None if key is None else np.broadcast_to(np.asarray(light[key], float), 3)
    color, level = (None, None) if strength is None else _color_and_level(strength)
    return {
        "name": f"{light.get('type', 'light')} {number}",
        "unit": UNITS.get(key or "", ""),
        "color": color,
        "level": level,
        "position": light.get("position"),
        "direction": light.get("direction"),
    }


def edit_light(world: World, number: int, key: str, value: Any) -> World:
    """Returns a copy of a world with a changed light.

    `key` is `strength` (a factor), `level` (the largest of red, green and blue, in the light's unit), `color` (text
    #rrggbb; the level does not change), `position` (metres [3], or an axis and a number), `direction` (in the same
    form), `remove` (True), or `add` (a type of `NEW_LIGHTS`; `number` is ignored). Raises `WorldError` for an unknown
    light or a key that it does not have, and `SettingsError` for an invalid value.
    """
    changed = world.copy()
    if key == "add":
        changed.add_light(_new_light(world, value))
        return changed
    lights = world.lights
    if number >= len(lights):
        raise WorldError(
            f"light {number} does not exist; the world has {counted(len(lights), 'light')}",
            code="index_out_of_range",
        )
    light = lights[number]
    if key == "remove" and value is True:
        changed.remove_light(number)
    elif key == "strength":
        changed.set_light(number, _stronger(light, real(key, value, 1e-6, 1e6)))
    elif key in ("level", "color"):
        changed.set_light(number, _tinted(light, key, value))
    elif key in ("position", "direction") and light.get(key) is not None:
        changed.set_light(number, {key: _vector(key, value, light[key])})
    else:
        raise WorldError(f"light {number}: a {light['type']} light has no {key}", code="unknown_name")
    return changed


def _strength_key(light: dict[str, Any]) -> str | None:
    return next((name for name in STRENGTH_KEYS if light.get(name) is not None), None)


def _color_and_level(strength: Floats) -> tuple[str, float]:
    """Returns a strength's colour #rrggbb, relative to its largest value, and this value."""
    level = float(strength.max())
    share = strength / level if level > 0 else np.ones(3)
    bytes_ = srgb_from_linear(share.astype(np.float32), 1.0, 8, "standard")
    return "#" + "".join(f"{int(each):02x}" for each in bytes_), float(f"{level:.6g}")


def _tinted(light: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Returns the keys of a light with another level or colour; raises `edit_light`'s errors."""
    name = _strength_key(light)
    if name is None:
        raise WorldError(
            f"a {light['type']} light has no {key} to edit; set strength, which scales the light",
            code="unknown_name",
        )
    strength = np.broadcast_to(np.asarray(light[name], float), 3)
    largest = float(strength.max())
    if key == "level":
        share = strength / largest if largest > 0 else np.ones(3)
        return {name: (share * real(key, value, 0.0, MAX_LEVEL)).tolist()}
    share = _linear(value)
    if not share.max() > 0:
        raise SettingsError(
            "color: a light cannot be black; to turn it off, set its strength to 0", code="out_of_range"
        )
    return {name: (share / share.max() * largest).tolist()}


def _linear(value: Any) -> Floats:
    """Returns the linear values [3] of a colour #rrggbb; raises `SettingsError` for other texts."""
    try:
        text = value.removeprefix("#")
        encoded = np.array([int(text[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        if len(text) != 6 or value == text:
            raise ValueError(value)
    except (AttributeError, ValueError, TypeError):
        raise SettingsError(f"color: expected #rrggbb, not {value!r}", code="invalid_value") from None
    return linear_from_srgb(encoded)


def _stronger(light: dict[str, Any], factor: float) -> dict[str, Any]:
    """The keys that make a light brighter by a factor."""
    own = next(([name] for name in (*STRENGTH_KEYS, "scale") if name in light), [])
    own = own or [name for name in ("zenith", "horizon", "ground") if name in light]
    if not own:
        own, light = ["scale"], {"scale": 1.0}
    return {name: (np.asarray(light[name], float) * factor).tolist() for name in own}


def _vector(key: str, value: Any, before: Sequence[float]) -> list[float]:
    """Returns a vector [3], given as three numbers, or as an axis (0 to 2) and its new value.

    Raises `SettingsError` for other values.
    """
    if isinstance(value, list) and len(value) == 2 and value[0] in (0, 1, 2):
        value = [value[1] if axis == value[0] else before[axis] for axis in range(3)]
    if not isinstance(value, list) or len(value) != 3 or not np.isfinite(value).all():
        raise SettingsError(f"{key}: expected three numbers, or an axis and a number", code="wrong_shape")
    return [float(each) for each in value]


def _new_light(world: World, kind: Any) -> dict[str, Any]:
    """Returns a light above the world's objects that lights their centre with `IRRADIANCE`.

    Raises `SettingsError` for an unknown kind.
    """
    if kind not in NEW_LIGHTS:
        raise SettingsError(
            f"a new light must be one of {', '.join(NEW_LIGHTS)}, not {kind!r}", code="unknown_name"
        )
    bounds = without_ground(world).bounds
    low, high = np.array([[-1.0] * 3, [1.0] * 3]) if bounds is None else bounds
    up = up_axis(world.up)
    side = np.array([0.35, -0.35, 0.0] if world.up == "z" else [0.35, 0.0, 0.35])
    size = max(float(np.linalg.norm(high - low)), 1e-6)
    center = (low + high) / 2
    position = center + size * (up + side)
    away = center - position
    distance = float(np.linalg.norm(away))
    direction = (away / distance).tolist()
    if kind == "sun":
        return {"type": "sun", "direction": direction, "irradiance": [IRRADIANCE] * 3}
    if kind == "area":
        length = AREA_SHARE * size
        u = np.cross(direction, up)
        u *= length / np.linalg.norm(u)
        v = np.cross(direction, u)
        radiance = IRRADIANCE * distance**2 / length**2
        return {
            "type": "area",
            "position": position.tolist(),
            "u": u.tolist(),
            "v": v.tolist(),
            "radiance": [radiance] * 3,
        }
    intensity = [IRRADIANCE * distance**2] * 3
    if kind == "spot":
        spot = {"direction": direction, "intensity": intensity, **SPOT_ANGLES}
        return {"type": "spot", "position": position.tolist(), **spot}
    return {
        "type": "point",
        "position": position.tolist(),
        "power": [4 * math.pi * each for each in intensity],
    }
