"""Measures the processor time of a recipe's worlds and their first images.

Eight GLBs of 150,000 triangles, each with a texture of 1024 x 1024 texels, are placed at random on a plane. Each turn
draws a new world and renders its first image of 128 x 128 pixels, in turn with each of the channels and integrators.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import report

OBJECTS, COLUMNS, ROWS, TEXELS = 8, 300, 250, 1024
IMAGES: dict[str, dict[str, Any]] = {
    "depth": {"channels": ["depth"]},
    "flat, 1 sample": {"integrator": "flat", "samples": 1},
    "flat, 16 samples": {"integrator": "flat", "samples": 16},
    "direct, 1 sample": {"integrator": "direct", "samples": 1},
    "direct, 16 samples": {"integrator": "direct", "samples": 16},
}


def write_model(path: Path, seed: int) -> None:
    """Writes a bumpy ball with a texture of random patches."""
    import raycam

    random = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(0, 1, COLUMNS + 1), np.linspace(0, 1, ROWS + 1))
    longitude, latitude = 2 * np.pi * u, np.pi * v
    radius = 0.3 * (1 + 0.1 * np.sin(7 * longitude) * np.sin(latitude) * np.sin(5 * latitude + seed))
    ring = radius * np.sin(latitude)
    points = np.stack([ring * np.cos(longitude), ring * np.sin(longitude), radius * np.cos(latitude)], -1)
    index = np.arange((COLUMNS + 1) * (ROWS + 1)).reshape(ROWS + 1, COLUMNS + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([a, d, c], -1)]).reshape(-1, 3)
    patches = random.integers(40, 256, (32, 32, 3), dtype=np.uint8)
    texture = np.kron(patches, np.ones((TEXELS // 32, TEXELS // 32, 1), np.uint8))
    texture += random.integers(0, 8, texture.shape, dtype=np.uint8)
    world = raycam.World()
    world.add_object(
        vertices=points.reshape(-1, 3).tolist(),
        triangles=faces.tolist(),
        uvs=np.stack([u, v], -1).reshape(-1, 2).tolist(),
        texture=texture,
    )
    world.to_gltf(path)


def recipe(folder: Path, on: bool) -> Any:
    """Returns a recipe of eight models under a sun and a sky: above a plane, or with `on` placed on the plane."""
    import raycam

    for number in range(OBJECTS):
        write_model(folder / f"{number}.glb", number)
    above = {"location": {"uniform": [[-1.5, -1.5, 0.35], [1.5, 1.5, 0.6]]}, "yaw": {"uniform": [0, 360]}}
    place = {"on": "floor"} if on else above
    models = [{"name": f"{number}", "mesh": f"{number}.glb", **place} for number in range(OBJECTS)]
    return raycam.Recipe(
        {
            "object": [{"name": "floor", "plane": {"size": [6, 6]}, "color": [0.6, 0.6, 0.6]}, *models],
            "light": [
                {"type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 3, 3]},
                {"type": "sky", "radiance": [0.3, 0.4, 0.5]},
            ],
            "camera": [{"size": [128, 128], "fov": 45, "location": [0, -5, 3], "pitch": 30, "yaw": 90}],
        },
        folder=folder,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--on", action="store_true", help="place the models on the plane (the key `on`)")
    options = parser.parse_args()
    import raycam

    warnings.simplefilter("ignore")
    draw: list[float] = []
    first: dict[str, list[float]] = {name: [] for name in IMAGES}
    again: dict[str, list[float]] = {name: [] for name in IMAGES}
    with tempfile.TemporaryDirectory() as name:
        worlds = recipe(Path(name), options.on)
        for turn in range(options.worlds + 2):
            for number, (image, how) in enumerate(IMAGES.items()):
                start = time.process_time()
                world = worlds.world(turn * len(IMAGES) + number)
                drawn = time.process_time()
                raycam.render(world, **how)
                rendered = time.process_time()
                raycam.render(world, **how)
                repeated = time.process_time()
                # The first two worlds also prepare the meshes and textures that all worlds of the recipe share.
                if turn >= 2:
                    draw.append(drawn - start)
                    first[image].append(rendered - start)
                    again[image].append(repeated - rendered)
    rows = [["world alone", *(f"{1000 * value:.1f}" for value in report.spread(draw)), "", ""]]
    for image in IMAGES:
        spreads = (*report.spread(first[image]), *report.spread(again[image]))
        rows.append([image, *(f"{1000 * value:.1f}" for value in spreads)])
    notes = [
        f"{OBJECTS} GLBs of {2 * COLUMNS * ROWS:,} triangles with textures of {TEXELS} x {TEXELS} texels; images of"
        f" 128 x 128. Milliseconds of the processor, of all threads; best and median of {options.worlds} worlds. The"
        " world and its first image: every turn has a new world. Second image: the same image of the same world once"
        " more."
    ]
    head = ["image", "world and first image: best", "median", "second image: best", "median"]
    report.write("recipe", "A recipe's world and its first image", notes, head, rows)


if __name__ == "__main__":
    main()
