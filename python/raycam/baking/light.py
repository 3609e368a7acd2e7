"""Light at points of surfaces, path traced."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from ..errors import Notice
from ..notices import warn
from ..render.request import image_request
from ..world import World
from .surface_points import SurfacePoints

__all__ = ["LIGHT_MAPS", "light_values", "warn_of_default_lights"]

LIGHT_MAPS = ("irradiance", "direct", "radiance")
"""Maps of light: irradiance from all light, irradiance directly from lights, and radiance along the normal."""
DIRECT_DEPTH = 2
"""Number of path segments for `direct`: one segment from the texel's surface to a light."""


def light_values(
    name: str,
    points: SurfacePoints,
    pixels: npt.NDArray[np.int32],
    samples: int,
    max_depth: int | None,
    threads: int | None,
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Returns a map's light [n, 3] at points, and the standard errors [n] of the luminance.

    Both are 0 for points without a surface. `name` is one of `LIGHT_MAPS`, `pixels` [n, 2] select the random numbers,
    and `samples` and `max_depth` are as in `bake`.
    """
    depth = DIRECT_DEPTH if name == "direct" else max_depth
    options = {"integrator": "path", "samples": samples, "max_depth": depth, "threads": threads}
    request, _, _ = image_request(
        points.world,
        {key: value for key, value in options.items() if value is not None},
        names=["color"],
        surface="first",
        frame=0,
        transparent_background=False,
        region=None,
    )
    request |= {"noise_threshold": None, "time_limit": None, "threads": threads}
    if depth is None:
        request["max_depth"] = None
    known = points.instance >= 0
    light, error = np.zeros((len(known), 3), np.float32), np.zeros(len(known), np.float32)
    query = {
        "instance": points.instance[known],
        "triangle": points.triangle[known],
        "barycentric": _weights(points.barycentric[known]),
        "normal": np.ascontiguousarray(points.normal[known]),
        "pixel": np.ascontiguousarray(pixels[known]),
    }
    quantity = "radiance" if name == "radiance" else "irradiance"
    light[known], error[known] = _core.world_light_at(points.world._core, query, quantity, request)
    return light, error


def _weights(barycentric: Floats) -> Floats:
    """Returns barycentric weights as C-contiguous float64, as the core requires them."""
    return np.ascontiguousarray(barycentric, np.float64)


def warn_of_default_lights(world: World) -> None:
    """Warns if a world has no lights, because its light maps then show the default lights."""
    if world._core.lit_by_default_lights:
        warn(
            Notice(
                "the world has no lights; light maps show the default lights. Add lights with world.add_light, or a "
                "sky to the world file",
                "default_lights",
            )
        )
