"""Measures `surface_visibility`, and prints a checksum of its result for comparison with another version.

    python benchmarks/visibility.py [--scene ball|room] [--faces N] [--cameras N] [--photo W H] [--lens MODEL]
        [--threads N]

The scene "ball" is a bumpy ball with cameras around it; "room" is the inside of one with 27 small balls, and cameras in
it that look in all directions. To compare two versions, run them in alternation with their packages in PYTHONPATH.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import resource
import time
import warnings
from typing import Any

import numpy as np
import raycam
from photographs import ball

LENSES: dict[str, dict[str, Any]] = {
    "pinhole": {},
    "fisheye": {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]},
    "opencv": {"model": "opencv", "distortion": [0.1, -0.05, 0.001, -0.002, 0.01]},
}


def make_scene(name: str, faces: int, count: int, lens: dict[str, Any]) -> tuple[raycam.World, list[Any]]:
    """Returns the world and its cameras."""
    world = raycam.World()
    turns = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = np.linspace(-0.8, 0.8, count)
    around = np.sqrt(1 - height**2)
    ways = np.stack([around * np.cos(turns), around * np.sin(turns), height], axis=1)
    if name == "ball":
        data = ball(faces)
        world.add_mesh(data["vertices"], data["faces"])
        return world, [raycam.Camera.look_at(3 * way, [0, 0, 0], **lens) for way in ways]
    data, small = ball(faces // 2), ball(faces // 54)
    world.add_mesh(5 * data["vertices"], data["faces"][:, ::-1])
    for place in np.stack(np.meshgrid(*[[-2, 0, 2]] * 3), axis=-1).reshape(-1, 3):
        world.add_mesh(0.4 * small["vertices"] + place, small["faces"])
    return world, [raycam.Camera.look_at(way, 4 * way[[1, 2, 0]], **lens) for way in ways]


def checksum(found: Any) -> str:
    """Returns a checksum of a result's arrays."""
    names = ("views", "fraction", "best_view", "best_resolution", "angle", "faces_seen")
    return hashlib.sha256(b"".join(getattr(found, name).tobytes() for name in names)).hexdigest()[:12]


def main() -> None:
    """Measures one run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", choices=("ball", "room"), default="ball")
    parser.add_argument("--faces", type=int, default=1_000_000)
    parser.add_argument("--cameras", type=int, default=300)
    parser.add_argument("--photo", type=int, nargs=2, default=(1752, 1168))
    parser.add_argument("--lens", choices=tuple(LENSES), default="fisheye")
    parser.add_argument("--threads", type=int)
    options = parser.parse_args()
    lens = {**LENSES[options.lens], "size": tuple(options.photo), "fov": 60}
    world, cameras = make_scene(options.scene, options.faces, options.cameras, lens)
    world.cast_rays([[0.0, 0.0, 9.0]], [[0.0, 0.0, -1.0]])
    warnings.simplefilter("ignore")
    start, used = time.perf_counter(), time.process_time()
    found = raycam.surface_visibility(world, cameras, facing="front", threads=options.threads)
    print(
        json.dumps(
            {
                "elapsed_s": round(time.perf_counter() - start, 2),
                "processor_s": round(time.process_time() - used, 2),
                "peak_gib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
                "faces": len(found.views),
                "seen": int((found.views > 0).sum()),
                "pairs": int(found.faces_seen.sum()),
                "checksum": checksum(found),
            }
        )
    )


if __name__ == "__main__":
    main()
