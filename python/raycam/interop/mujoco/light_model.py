"""The lights of a MuJoCo model or scene, with the values of OpenGL's light model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from .model import DIRECTIONAL, SPOT

__all__ = ["Light", "MujocoLights", "model_lights", "scene_lights"]


@dataclass(frozen=True)
class Light:
    """A light in world coordinates."""

    kind: int
    position: Floats
    direction: Floats
    ambient: Floats
    diffuse: Floats
    specular: Floats
    shadow: bool
    attenuation: Floats
    cutoff: float
    exponent: float


@dataclass(frozen=True)
class MujocoLights:
    """The active lights, and the headlights, which move with the camera."""

    fixed: list[Light]
    headlights: list[tuple[Floats, Floats, Floats]]
    """The ambient, diffuse and specular colour [3] of each headlight."""

    def seen_from(self, camera: Camera) -> list[Light]:
        """Returns all lights. A headlight shines in the camera's viewing direction."""
        return self.fixed + [
            Light(
                DIRECTIONAL,
                position=camera.C,
                direction=camera.R[2],
                ambient=ambient,
                diffuse=diffuse,
                specular=specular,
                shadow=False,
                attenuation=np.array([1.0, 0, 0]),
                cutoff=180.0,
                exponent=0.0,
            )
            for ambient, diffuse, specular in self.headlights
        ]


def model_lights(model: Any, data: Any) -> MujocoLights:
    """Returns the active lights in the state `data`; lights that OpenGL does not draw are omitted."""
    active = [model.light(number) for number in np.flatnonzero(np.asarray(model.light_active))]
    fixed = [_light(light, data.light_xpos[light.id], data.light_xdir[light.id]) for light in active]
    headlight = model.vis.headlight
    return MujocoLights(_drawn(fixed), [_colors(headlight)] if headlight.active else [])


def scene_lights(lights: Sequence[Any]) -> MujocoLights:
    """Returns the `mjvLight`s of a scene; lights that OpenGL does not draw are omitted."""
    fixed = [_light(light, light.pos, light.dir) for light in lights if not light.headlight]
    return MujocoLights(_drawn(fixed), [_colors(light) for light in lights if light.headlight])


def _drawn(lights: list[Light]) -> list[Light]:
    """The lights that OpenGL draws."""
    return [light for light in lights if light.kind in (SPOT, DIRECTIONAL)]


def _light(light: Any, position: Any, direction: Any) -> Light:
    """Returns the light of a model or a scene; a model's values are arrays [1]."""
    kind, shadow, cutoff, exponent = (
        np.asarray(value).item() for value in (light.type, light.castshadow, light.cutoff, light.exponent)
    )
    ambient, diffuse, specular = _colors(light)
    return Light(
        int(kind),
        position=np.array(position, np.float64),
        direction=np.array(direction, np.float64),
        ambient=ambient,
        diffuse=diffuse,
        specular=specular,
        shadow=bool(shadow),
        attenuation=np.array([1, 0, 0] if kind == DIRECTIONAL else light.attenuation, np.float64),
        cutoff=float(cutoff),
        exponent=float(exponent),
    )


def _colors(light: Any) -> tuple[Floats, Floats, Floats]:
    """Returns the ambient, diffuse and specular colour [3] of a light."""
    ambient, diffuse, specular = (
        np.array(color, np.float64) for color in (light.ambient, light.diffuse, light.specular)
    )
    return ambient, diffuse, specular
