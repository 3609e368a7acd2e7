"""A table with objects for tests of data sets, and cameras around it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import raycam

SIZE = (64, 48)


def table() -> raycam.World:
    """Two equal boxes, a sliding ball and a ring with a hole on a table without a category."""
    world = raycam.World()
    world.add_object(plane={"size": [6, 6]}, name="table")
    world.add_object(box={"size": [0.6, 0.4, 0.5]}, location=[0.8, 0.2, 0.25], yaw=30, category="box")
    world.add_object(instance_of="box", location=[-0.9, -0.5, 0.25], yaw=-50)
    world.add_object(
        sphere={"radius": 0.3, "level": 3}, name="ball", location=[0, -0.9, 0.3], category="ball"
    )
    world.add_object(
        torus={"radius": 0.5, "tube": 0.12}, name="ring", location=[-0.2, 0.7, 0.6], pitch=80, category=9
    )
    world.set_video(
        fps=4,
        seconds=1,
        orbit={"target": [0, 0, 0.3], "degrees": 40},
        keyframe=[
            {"time": 0, "object": "ball", "location": [0, -0.9, 0.3]},
            {"time": 1, "object": "ball", "location": [0.7, -0.9, 0.3]},
        ],
    )
    return world


def ring(count: int = 4, fov: float = 40, **options: Any) -> list[raycam.Camera]:
    angles = np.arange(count) * 2 * np.pi / count
    return [
        raycam.Camera.look_at(
            [3.2 * np.cos(a), 3.2 * np.sin(a), 1.8], [0, 0, 0.3], size=SIZE, fov=fov, **options
        )
        for a in angles
    ]


def picture(path: Path) -> np.ndarray:
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def truth(camera: raycam.Camera, channel: str = "instance", world: raycam.World | None = None) -> np.ndarray:
    return raycam.render(world or table(), camera, samples=1, channels=channel)[channel]
