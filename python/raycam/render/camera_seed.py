"""Seeds of the cameras of one exposure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..arguments import as_number

__all__ = ["camera_seed", "with_camera_seed"]

MASK = (1 << 64) - 1


def camera_seed(seed: int, index: int) -> int:
    """Returns the seed of one of several cameras that take images at the same time.

    `index` is the number of the camera. Camera 0 has the given seed. The images of the cameras have independent noise.
    With a common seed, equal pixels would have equal random numbers, and a stereo matcher would match the noise at
    disparity 0 instead of the scene.

    Source: SplitMix64, G. L. Steele, D. Lea and C. H. Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
    """
    if index == 0:
        return seed
    mixed = (seed + index * 0x9E3779B97F4A7C15) & MASK
    mixed = ((mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    mixed = ((mixed ^ (mixed >> 27)) * 0x94D049BB133111EB) & MASK
    return mixed ^ (mixed >> 31)


def with_camera_seed(options: Mapping[str, Any], index: int) -> dict[str, Any]:
    """Returns the options of `raycam.render` with the seed of the camera with this index.

    Options without random numbers, and invalid seeds, which `raycam.render` rejects, are unchanged.
    """
    seed = options.get("seed")
    number = 0 if seed is None else as_number(seed)
    if index == 0 or options.get("integrator") == "reference" or not isinstance(number, int):
        return dict(options)
    return {**options, "seed": camera_seed(number, index)}
