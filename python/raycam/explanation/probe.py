"""Computes the light along one ray with `raycam.render`.

The camera is a pinhole camera with one pixel, which is 1e-5 radians wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..notices import collected
from ..reference.units import Floats
from ..render import is_unlit, render
from ..world import World

__all__ = ["Estimate", "emitted", "facing_light", "lit_world", "only_light", "radiance"]

WIDTH = 1e-5
"""The angle that the probe's single pixel covers, in radians."""
ROUNDING = 1e-6
"""Relative rounding error of the mean of equal samples in float32."""
DARK = {"type": "sun", "direction": [0, 0, -1], "irradiance": [0, 0, 0]}
"""A light of zero strength, which prevents default lights."""


@dataclass(frozen=True)
class Estimate:
    """The mean radiance of samples, with its standard error."""

    value: Floats
    """The mean in linear RGB, [3], W/(m² sr)."""
    error: float
    """The standard error of the luminance; 0 if all samples are equal."""


def radiance(world: World, origin: Floats, direction: Floats, samples: int, *, seed: int = 0) -> Estimate:
    """Returns the radiance at `origin` [3] from `direction` [3], from `samples` samples.

    The radiance consists of emission and direct light. `seed` selects the random numbers.
    """
    with collected():  # notices about a single pixel do not apply to the image
        frame = render(
            world,
            _camera(origin, direction),
            integrator="direct",
            samples=max(samples, 2),
            channels=["color", "error"],
            seed=seed,
            threads=1,
            ambient_occlusion=False,
        )
    value, error = frame["color"][0, 0].astype(np.float64), float(frame["error"][0, 0])
    return Estimate(value, error if error > ROUNDING * float(value.max()) else 0.0)


def emitted(world: World, origin: Floats, direction: Floats) -> Floats:
    """Returns the radiance [3] that the visible surface emits; for a miss, the sky's radiance."""
    with collected():
        frame = render(
            world,
            _camera(origin, direction),
            integrator="path",
            max_depth=1,
            samples=1,
            channels=["color"],
            threads=1,
            ambient_occlusion=False,
        )
    return np.asarray(frame["color"][0, 0], np.float64)


def lit_world(world: World, camera: Camera) -> World:
    """Returns the world with the lights that `render` uses.

    These are the world's own lights. A world without lights gets the studio's lights.
    """
    return world.in_studio(camera) if is_unlit(world, camera, {"integrator": "direct"}) else world


def only_light(world: World, number: int | None) -> World:
    """Returns a copy of the world with only one of its lights, or without lights.

    The bodies of removed lamps still occlude.
    """
    made = world.copy()
    made.add_light(DARK)
    for other, light in reversed(list(enumerate(world.lights))):
        if other != number and light.get("body"):
            made.set_light(other, visible={"camera": False, "reflection": False, "light": False})
        elif other != number:
            made.remove_light(other)
    return made


def facing_light(dark: World, point: Floats, towards: Floats, distance: float) -> World:
    """Returns a copy of the world `dark` with one additional point light.

    The light is `distance` metres from `point`, in the direction `towards` [3], and has an irradiance of 1 at `point`.
    """
    made = dark.copy()
    made.add_light(
        {"type": "point", "position": (point + distance * towards).tolist(), "intensity": [distance**2] * 3}
    )
    return made


def _camera(origin: Floats, direction: Floats) -> Camera:
    """The pinhole camera for one pixel."""
    up = np.eye(3)[int(np.argmin(np.abs(direction)))]
    return Camera.look_at(origin, origin + direction, up, size=(1, 1), focal=1 / WIDTH)
