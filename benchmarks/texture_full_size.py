"""Measures a texture of 4096² from 100 photographs of 12 megapixels, with its peak memory.

    python benchmarks/texture_full_size.py MODEL FOLDER [--photographs N] [--photo W H] [--size N] [--method NAME]

MODEL is a mesh with texture coordinates, for example spot's `cow.obj`. FOLDER receives the photographs, which are
renders of the mesh with a pattern as its texture; photographs that exist are not rendered again.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import raycam
from raycam.world.object_mesh import object_mesh


def patterned(path: Path) -> raycam.World:
    """Returns the first object of a model with a pattern as its unlit texture, centred and scaled to a radius of 1."""
    mesh = object_mesh(raycam.load(path), 0)
    points = mesh.corners.reshape(-1, 3) - (mesh.corners.max(axis=(0, 1)) + mesh.corners.min(axis=(0, 1))) / 2
    points /= np.linalg.norm(points, axis=1).max()
    x, y = np.meshgrid(np.arange(4096), np.arange(4096))
    picture = np.stack([x // 16, y // 16, 128 + 100 * np.sin(x / 23) * np.cos(y / 17)], axis=2)
    world = raycam.World()
    world.add_mesh(
        points,
        np.arange(len(points)).reshape(-1, 3),
        uvs=mesh.uvs[0].reshape(-1, 2),
        material={"type": "unlit", "texture": raycam.Texture(picture.astype(np.uint8), wrap="clamp")},
    )
    return world


def cameras_around(count: int, size: tuple[int, int]) -> dict[str, Any]:
    """Returns cameras with the names of their photographs."""
    turns = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = np.linspace(-0.8, 0.8, count)
    around = np.sqrt(1 - height**2)
    ways = np.stack([around * np.cos(turns), around * np.sin(turns), height], axis=1)
    return {
        f"{i:04d}.jpg": raycam.Camera.look_at(3 * way, [0, 0, 0], size=size, fov=45)
        for i, way in enumerate(ways)
    }


def main() -> None:
    """Renders the photographs, then measures the texture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--photographs", type=int, default=100)
    parser.add_argument("--photo", type=int, nargs=2, default=(4000, 3000))
    parser.add_argument("--size", type=int, default=4096)
    parser.add_argument("--method", default="blend")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    world = patterned(options.model)
    cameras = cameras_around(options.photographs, tuple(options.photo))
    options.folder.mkdir(parents=True, exist_ok=True)
    for name, camera in cameras.items():
        if not (options.folder / name).exists():
            raycam.render(world, camera, samples=1).save(options.folder / name)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start, used = time.perf_counter(), time.process_time()
    found = raycam.texture_from_photos(
        world, cameras, options.folder, size=options.size, method=options.method
    )
    print(
        json.dumps(
            {
                "elapsed_s": round(time.perf_counter() - start, 1),
                "processor_s": round(time.process_time() - used, 1),
                "peak_gib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
                "peak_before_gib": round(before / 2**20, 2),
                "texels_seen": int(found.seen.sum()),
            }
        )
    )


if __name__ == "__main__":
    main()
