"""Fireflies: pixels that a single rare path makes far brighter than their neighbours.

Notices report the lights and objects that cause fireflies.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World
from ..errors import Notice

__all__ = ["bright_pixels", "firefly_notices"]

MIN_FIREFLY_SAMPLES = 256
"""Minimum samples per pixel for a notice; with fewer samples, bright pixels are ordinary noise."""
FIREFLY_RATIO = 20.0
"""Minimum ratio of a firefly's brightness to the median of its neighbours."""
MIN_PATH_SHARE = 0.5
"""Minimum fraction of a firefly's light that a single path contributes."""
MAX_TRACED_PIXELS = 64
"""Maximum number of pixels whose paths are traced again; the brightest pixels are used."""
MAX_NAMED_PATHS = 3
"""Maximum number of light paths that a notice lists."""
DISTANCE_TOLERANCE = 1e-3
"""Relative difference up to which two distances count as equal."""
SKY_TYPES = ("environment", "sky", "daylight")
SUN_TYPES = ("sun", "daylight")
DAYLIGHT_SUN_DIAMETER_DEG = 0.53
"""Diameter of the sun of a light of type "daylight", in degrees."""
SUN_MARGIN_DEG = 0.1
"""Maximum angle in degrees between a sun's disk and a ray at which the ray counts as a hit."""

Pixels = npt.NDArray[np.int64]
Vector = npt.NDArray[np.float64]


def firefly_notices(
    world: World, camera: Camera, color: npt.NDArray[np.float32], request: dict[str, Any]
) -> Iterator[Notice]:
    """Yields a notice if a whole image [h, w, 3] contains fireflies.

    The image must have at least 256 samples per pixel. The notice names the lights and objects that cause the
    fireflies; for this, their paths are traced again.
    """
    timed, clamped = request.get("time_limit") is not None, request.get("clamp") is not None
    if request["integrator"] != "path" or request["samples"] < MIN_FIREFLY_SAMPLES or timed or clamped:
        return
    found = bright_pixels(color)[:MAX_TRACED_PIXELS]
    if not len(found):
        return
    pixels = [(int(x), int(y)) for x, y in found]
    ways: Counter[str] = Counter()
    for sample in world._core.brightest_samples(camera._core, request, pixels):
        if sample is not None and sample[0] >= MIN_PATH_SHARE and len(sample[1]) > 1:
            ways[_way(world, *sample[1:])] += 1
    if not ways:
        return
    count = ways.total()
    named = "; ".join(f"{way} ({number})" for way, number in ways.most_common(MAX_NAMED_PATHS))
    others = count - sum(number for _, number in ways.most_common(MAX_NAMED_PATHS))
    least = "at least " if len(found) == MAX_TRACED_PIXELS else ""
    more = f"; other paths ({others})" if others else ""
    message = (
        f"fireflies: {least}{count} {'pixel is' if count == 1 else 'pixels are'} more than {FIREFLY_RATIO:g} times as "
        f"bright as their neighbours because of a single light path: {named}{more}. Use more samples, a larger light "
        "or denoise=True; "
        "clamp also removes such pixels, but darkens the image"
    )
    yield Notice(message, "fireflies")


def bright_pixels(color: npt.NDArray[np.float32]) -> Pixels:
    """Returns pixels [n, 2] (x, y) that are far brighter than their neighbours.

    These pixels of the image [h, w, 3] are more than 20 times as bright as their neighbours' median. The brightest
    pixel is first. The image's border pixels are repeated beyond its edges; pixels with black neighbours are not
    included.
    """
    light = color.max(axis=2)
    height, width = light.shape
    if min(height, width) < 3:
        return np.zeros((0, 2), dtype=np.int64)
    padded = np.pad(light, 1, mode="edge")
    # Few pixels are far brighter than their darkest neighbours, so the median is computed only for these pixels.
    rows = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    darkest = np.minimum(np.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    y, x = np.nonzero(light > FIREFLY_RATIO * darkest)
    around = [
        padded[y + row, x + column] for row in range(3) for column in range(3) if (row, column) != (1, 1)
    ]
    median = np.median(around, axis=0) if len(y) else np.zeros(0)
    bright = (light[y, x] > FIREFLY_RATIO * median) & (median > 0)
    y, x = y[bright], x[bright]
    order = np.argsort(-light[y, x], kind="stable")
    return np.column_stack([x, y])[order].astype(np.int64)


def _way(world: World, instances: list[int], origin: Any, direction: Any, distance: float) -> str:
    """The light of a path and the objects along it, as text."""
    names = [str(world.objects[each].name) for each in instances]
    seen, *between = names
    through = list(dict.fromkeys(name for name in between if name != seen)) or list(dict.fromkeys(between))
    light = _light(world, np.asarray(origin, dtype=float), np.asarray(direction, dtype=float), distance)
    return f"light of {light} via {_listed(through)}, visible on {seen!r}"


def _listed(names: list[str]) -> str:
    quoted = [repr(name) for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def _light(world: World, origin: Vector, direction: Vector, distance: float) -> str:
    """The name of the light at the end of a ray: type and number, or the emissive object."""
    lights = [dict(light) for light in world.lights]
    if not np.isfinite(distance):
        suns = [number for number, light in enumerate(lights) if _is_sun_along(light, direction)]
        skies = [number for number, light in enumerate(lights) if light["type"] in SKY_TYPES]
        number = next(iter([*suns, *skies]), None)
        return "the default sky" if number is None else f"{lights[number]['type']} {number}"
    start = origin + direction * distance * (1 - 10 * DISTANCE_TOLERANCE)
    hit = world.cast_rays(start, direction, fields=("t", "instance"), threads=1)
    shines = int(hit["instance"]) >= 0 and float(hit["t"]) <= 20 * DISTANCE_TOLERANCE * distance
    end = origin + direction * distance
    far = {number: _distance(light, end) for number, light in enumerate(lights) if "position" in light}
    nearest = min(far, key=lambda number: far[number], default=None)
    if shines and (nearest is None or far[nearest] > 20 * DISTANCE_TOLERANCE * distance):
        return f"the object {str(world.objects[int(hit['instance'])].name)!r}"
    return "a light" if nearest is None else f"{lights[nearest]['type']} {nearest}"


def _is_sun_along(light: dict[str, Any], direction: Vector) -> bool:
    """True if a ray of this direction ends in the disk of a sun."""
    if light["type"] not in SUN_TYPES:
        return False
    towards = -np.asarray(light["direction"], dtype=float)
    angle = np.degrees(np.arccos(np.clip(towards @ direction / np.linalg.norm(towards), -1, 1)))
    diameter = float(
        light.get("angular_diameter", DAYLIGHT_SUN_DIAMETER_DEG if light["type"] == "daylight" else 0)
    )
    return bool(angle <= diameter / 2 + SUN_MARGIN_DEG)


def _distance(light: dict[str, Any], point: Vector) -> float:
    """Returns the distance of a point from a light with a position.

    The distance is measured from the light's surface, and is 0 inside the light.
    """
    position = np.asarray(light["position"], dtype=float)
    u, v = (np.asarray(light.get(name, [0.0, 0.0, 0.0]), dtype=float) for name in ("u", "v"))
    if u.any() and v.any():
        across = [float(np.clip((point - position) @ edge / (edge @ edge), -0.5, 0.5)) for edge in (u, v)]
        position = position + across[0] * u + across[1] * v
    return max(float(np.linalg.norm(point - position)) - float(light.get("radius", 0.0)), 0.0)
