"""A bin with parts that fall into it."""

from __future__ import annotations

import raycam


def bin_of_parts(count: int) -> tuple[raycam.World, list[str]]:
    """A world with a bin and `count` parts above it, and the parts' names.

    The bin consists of five boxes, `bin/bottom` to `bin/back`.
    """
    world = raycam.World()
    walls = {
        "bottom": ([0.4, 0.3, 0.01], [0, 0, 0.005]),
        "left": ([0.01, 0.3, 0.15], [-0.195, 0, 0.085]),
        "right": ([0.01, 0.3, 0.15], [0.195, 0, 0.085]),
        "front": ([0.38, 0.01, 0.15], [0, -0.145, 0.085]),
        "back": ([0.38, 0.01, 0.15], [0, 0.145, 0.085]),
    }
    for name, (size, location) in walls.items():
        world.add_object(name=f"bin/{name}", box={"size": size}, location=location)
    shapes = [
        {"box": {"size": [0.06, 0.04, 0.03]}},
        {"cylinder": {"radius": 0.02, "height": 0.07}},
        {"sphere": {"radius": 0.025, "level": 3}},
        {"torus": {"radius": 0.03, "tube": 0.008, "segments": 24}},
    ]
    names = [f"part-{i}" for i in range(count)]
    for i, name in enumerate(names):
        world.add_object(name=name, **shapes[i % len(shapes)])
    return world, names
