"""Measures how the time of an image grows with triangles, pixels, samples and lights.

Each run changes one of these quantities.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import raycam
import report

BASE = {"triangles": 20_000, "pixels": 320 * 240, "samples": 4, "lights": 1}
STEPS: dict[str, list[int]] = {
    "triangles": [2_000, 20_000, 200_000, 2_000_000],
    "pixels": [160 * 120, 320 * 240, 640 * 480, 1280 * 960],
    "samples": [1, 4, 16, 64],
    "lights": [1, 4, 16, 64],
}


def seconds(triangles: int, pixels: int, samples: int, lights: int) -> tuple[float, float]:
    """Returns the median seconds of a lit image, and the seconds of the preparation."""
    world = raycam.World()
    side = round((triangles / 2) ** 0.5)
    grid = [
        [x / side, y / side, 0.1 * ((7 * x + 13 * y) % 5) / side]
        for y in range(side + 1)
        for x in range(side + 1)
    ]
    row = side + 1
    corners = [
        (y * row + x, y * row + x + 1, (y + 1) * row + x, (y + 1) * row + x + 1)
        for y in range(side)
        for x in range(side)
    ]
    world.add_mesh(grid, [face for a, b, c, d in corners for face in ((a, b, d), (a, d, c))])
    for number in range(lights):
        world.add_light({"type": "point", "position": [number / lights, 0.3, 1], "power": [9 / lights] * 3})
    height = round((pixels * 3 / 4) ** 0.5)
    camera = raycam.Camera.look_at([0.5, -0.6, 0.8], [0.5, 0.5, 0], size=(height * 4 // 3, height), fov=60)
    start = time.perf_counter()
    world.prepare()
    once = time.perf_counter() - start
    options: dict[str, Any] = {"samples": samples, "channels": "color"}
    times = []
    for frame in range(3):
        start = time.perf_counter()
        raycam.render(world, camera, frame=frame, **options)
        times.append(time.perf_counter() - start)
    return statistics.median(times), once


def main() -> None:
    rows = []
    for name, values in STEPS.items():
        for value in values:
            frame, once = seconds(**(BASE | {name: value}))
            rows.append([name, f"{value:,}", f"{1000 * frame:.1f}", f"{1000 * once:.0f}"])
    base = ", ".join(f"{value:,} {name}" for name, value in BASE.items())
    notes = [f"Milliseconds, median of 3 frames; other values: {base}. once: preparation of the world."]
    report.write("growth", "Growth of the time of a frame", notes, ["of", "so many", "a frame", "once"], rows)


if __name__ == "__main__":
    main()
