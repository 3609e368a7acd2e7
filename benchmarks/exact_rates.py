"""Prints the rates of exact rays: first hits with all fields, with ids only, and any hits.

    PYTHONPATH=FOLDER python benchmarks/exact_rates.py

FOLDER holds the package `raycam` of a build; run builds in alternation. Rates are million rays per second of processor
time of all threads, the best of twelve, for 100,000 rays: random rays around a ball, and the rays of a camera.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import raycam

ROUNDS = 12


def rate(call: Callable[[], Any], count: int) -> float:
    """Returns the best rate of a call with `count` rays, in million rays per second."""
    call()
    best = float("inf")
    for _ in range(ROUNDS):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return count / best / 1e6


def main() -> None:
    random = np.random.default_rng(1)
    around = random.uniform(-1.2, 1.2, (100_000, 3)), random.normal(size=(100_000, 3))
    camera = raycam.Camera.look_at([0, -3, 1], [0, 0, 0], up=[0, 0, 1], fov=45, size=(400, 250))
    seen = tuple(array.reshape(-1, 3) for array in camera.rays())
    print(raycam.__file__)
    for level in (5, 6):
        world = raycam.World()
        world.add_object(sphere={"radius": 1, "level": level})
        for name, rays in {"random": around, "camera": seen}.items():
            calls = {
                "first": partial(world.cast_rays, *rays),
                "ids": partial(world.cast_rays, *rays, fields=("instance", "triangle")),
                "any": partial(world.occluded, *rays),
            }
            rates = ", ".join(f"{kind} {rate(call, len(rays[0])):.2f}" for kind, call in calls.items())
            print(f"{20 * 4**level:6} triangles, {name}: {rates}")


if __name__ == "__main__":
    main()
