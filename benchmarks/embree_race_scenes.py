"""Writes the scenes of `raycam bench` as files for `embree_race.py`, one variation per seed.

`NAME.tri`: uint32 vertex count V, uint32 triangle count T, V x 3 float32, T x 3 uint32, little endian.
`NAME.cam`: 13 float32: eye, target, up, vertical field of view in degrees, position of the light.
"""

import pathlib

import numpy as np
from raycam.bench.scenes import SCENES, BenchScene

TRIANGLES = {"terrain": 2_880_000, "rock": 1_310_720, "town": 1_470_000, "hair": 1_200_000}


def write(folder: pathlib.Path, seed: int) -> None:
    """Writes all scenes of a seed."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for name, triangles in TRIANGLES.items():
        write_one(folder / name, SCENES[name](rng, triangles))


def write_one(path: pathlib.Path, scene: BenchScene) -> None:
    """Writes PATH.tri and PATH.cam."""
    with open(path.with_suffix(".tri"), "wb") as file:
        np.array([len(scene.vertices), len(scene.faces)], "<u4").tofile(file)
        np.ascontiguousarray(scene.vertices, "<f4").tofile(file)
        np.ascontiguousarray(scene.faces, "<u4").tofile(file)
    camera = [*scene.eye, *scene.target, 0, 0, 1, scene.fov, *scene.light]
    np.array(camera, "<f4").tofile(path.with_suffix(".cam"))
