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
    lights = []
    for light in np.flatnonzero(np.asarray(model.light_active)):
        kind = int(model.light_type[light])
        if kind in (SPOT, DIRECTIONAL):
            directional = kind == DIRECTIONAL
            lights.append(
                Light(
                    kind,
                    position=np.array(data.light_xpos[light], np.float64),
                    direction=np.array(data.light_xdir[light], np.float64),
                    ambient=np.array(model.light_ambient[light], np.float64),
                    diffuse=np.array(model.light_diffuse[light], np.float64),
                    specular=np.array(model.light_specular[light], np.float64),
                    shadow=bool(model.light_castshadow[light]),
                    attenuation=np.array(
                        [1, 0, 0] if directional else model.light_attenuation[light], np.float64
                    ),
                    cutoff=float(model.light_cutoff[light]),
                    exponent=float(model.light_exponent[light]),
                )
            )
    headlight = model.vis.headlight
    return MujocoLights(lights, [_colors(headlight)] if headlight.active else [])


def scene_lights(lights: Sequence[Any]) -> MujocoLights:
    """Returns the `mjvLight`s of a scene; lights that OpenGL does not draw are omitted."""
    fixed = []
    for light in lights:
        kind = int(light.type)
        if light.headlight or kind not in (SPOT, DIRECTIONAL):
            continue
        ambient, diffuse, specular = _colors(light)
        fixed.append(
            Light(
                kind,
                position=np.array(light.pos, np.float64),
                direction=np.array(light.dir, np.float64),
                ambient=ambient,
                diffuse=diffuse,
                specular=specular,
                shadow=bool(light.castshadow),
                attenuation=np.array([1, 0, 0] if kind == DIRECTIONAL else light.attenuation, np.float64),
                cutoff=float(light.cutoff),
                exponent=float(light.exponent),
            )
        )
    return MujocoLights(fixed, [_colors(light) for light in lights if light.headlight])


def _colors(light: Any) -> tuple[Floats, Floats, Floats]:
    """Returns the ambient, diffuse and specular colour [3] of a light."""
    ambient, diffuse, specular = (
        np.array(color, np.float64) for color in (light.ambient, light.diffuse, light.specular)
    )
    return ambient, diffuse, specular
