"""The lights of a MuJoCo model as lights of a world."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arguments import Floats
from ...errors import Notice
from ...world import World
from .model import DIRECTIONAL, POINT, SPOT, element_name

__all__ = ["LightSources"]

SUN_SHARE = 0.5
"""Fraction of the headlight's diffuse light that becomes a sun; the rest becomes part of the sky."""
SUN_DIRECTION = [1.0, 2.0, -3.0]
"""Direction of this sun, which is the direction of raycam's default sun in a z-up world."""


class LightSources:
    """The lights that were added to a world, with the numbers of MuJoCo's lights."""

    def __init__(self, world: World, model: Any, data: Any, notices: list[Notice]) -> None:
        """Adds the active lights, the ambient light and the headlight to a world.

        All ambient light becomes a uniform sky, and the headlight becomes a sky and a sun. The headlight
        moves with MuJoCo's camera, so it cannot be part of a world. Half of the headlight's diffuse light
        becomes part of the sky, and the other half becomes a sun, because a uniform sky alone would hide the
        shape of white surfaces. A surface of albedo 1 that faces a light has the radiance `diffuse`. MuJoCo's
        spot and point lights usually do not become weaker with distance. raycam's lights become weaker; their
        strength is correct at the centre of the model.
        """
        self._world, self._model = world, model
        self._numbers: dict[int, int] = {}
        self._poses: dict[int, tuple[list[float], list[float]]] = {}
        ambient = np.zeros(3)
        headlight = model.vis.headlight
        if headlight.active:
            ambient += np.asarray(headlight.ambient) + (1.0 - SUN_SHARE) * np.asarray(headlight.diffuse)
        faded = []
        for light in np.flatnonzero(np.asarray(model.light_active)):
            ambient += np.asarray(model.light_ambient[light])
            kind, name = int(model.light_type[light]), element_name(model, "light", int(light))
            if kind not in (DIRECTIONAL, SPOT, POINT):
                text = f"light {name!r}: image lights are not supported; the light is ignored"
                notices.append(Notice(text, "ignored_element"))
            elif (np.asarray(model.light_diffuse[light]) > 0).any():
                self._add(int(light), data)
                faded += [name] if kind != DIRECTIONAL else []
        if faded:
            text = (
                f"lights {', '.join(faded)}: light decreases with the square of the distance, unlike in MuJoCo; "
                "both programs agree only at the model's centre"
            )
            notices.append(Notice(text, "approximated_value"))
        if ambient.any():
            world.add_light("sky", radiance=ambient.tolist())
        if headlight.active and np.asarray(headlight.diffuse).any():
            irradiance = np.pi * SUN_SHARE * np.asarray(headlight.diffuse, np.float64)
            world.add_light("sun", direction=SUN_DIRECTION, irradiance=irradiance.tolist())

    def _add(self, light: int, data: Any) -> None:
        model, kind = self._model, int(self._model.light_type[light])
        position, direction = self._pose(light, data)
        diffuse = np.pi * np.asarray(model.light_diffuse[light], np.float64)
        if kind == DIRECTIONAL:
            number = self._world.add_light("sun", direction=direction, irradiance=diffuse.tolist())
        else:
            distance = max(float(np.linalg.norm(np.asarray(model.stat.center) - position)), 1e-3)
            constant, linear, quadratic = np.asarray(model.light_attenuation[light], np.float64)
            faded = constant + linear * distance + quadratic * distance**2
            keys: dict[str, Any] = {"position": position}
            keys["intensity"] = (diffuse * distance**2 / max(faded, 1e-9)).tolist()
            if kind == SPOT:
                outer = float(np.clip(model.light_cutoff[light], 0.1, 89.9))
                narrow = float(model.light_exponent[light]) > 0
                keys |= {"direction": direction, "outer": outer, "inner": 0.0 if narrow else 0.99 * outer}
            number = self._world.add_light("spot" if kind == SPOT else "point", **keys)
        self._numbers[light] = number
        self._poses[light] = (position, direction)

    def _pose(self, light: int, data: Any) -> tuple[list[float], list[float]]:
        """Position and direction of a light in the world."""
        position = np.asarray(data.light_xpos[light], np.float64)
        direction: Floats = np.asarray(data.light_xdir[light], np.float64)
        return position.tolist(), direction.tolist()

    def update(self, data: Any) -> None:
        """Updates the lights whose pose has changed."""
        for light, number in self._numbers.items():
            pose = self._pose(light, data)
            if pose == self._poses[light]:
                continue
            self._poses[light] = pose
            kind = int(self._model.light_type[light])
            keys: dict[str, Any] = {} if kind == DIRECTIONAL else {"position": pose[0]}
            if kind != POINT:
                keys["direction"] = pose[1]
            self._world.set_light(number, **keys)
