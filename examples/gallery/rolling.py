"""Renders a rotor of four swords with two shutters.

On the left, the shutter is global; on the right, a rolling shutter bends the blades.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality


def rotor(assets: Path) -> raycam.World:
    """Returns a world in which the rotor turns by 150 degrees in 0.1 s."""
    world = raycam.World()
    names = [f"sword {number}" for number in range(4)]
    for name in names:
        world.add_object(mesh=assets / "meshes/sword-quad-dominant.obj", name=name, type="principled", color="#2b1d14",
                         roughness=0.4, clearcoat=0.5)  # fmt: skip
    world.add_object(cylinder={"radius": 0.09, "height": 0.2}, roll=90, location=[0, 0, 1.5], color="#c23b22")
    world.add_object(box=[0.1, 0.1, 1.5], location=[0, 0.2, 0.75], color="#33363b")
    world.add_ground(color="#8a9a5b", height=0, size=80)
    world.add_light("daylight", direction=[-0.5, 1, -0.8], turbidity=3, scale=0.02)

    def place(number: int, time: float) -> list[list[float]]:
        angle = np.pi / 2 * number + np.deg2rad(1500) * time
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        matrix = np.eye(4)
        matrix[:3, :3] = turn @ [[0, 4, 0], [-3, 0, 0], [0, 0, 1.6]]
        matrix[:3, 3] = turn @ [0, 0, 0.72] + [0, 0, 1.5]
        return matrix.tolist()

    times = np.linspace(0, 0.1, 41)
    world.set_video(
        fps=10,
        seconds=0.1,
        keyframe=[
            {"time": float(time), "object": name, "matrix": place(number, time)}
            for number, name in enumerate(names)
            for time in times
        ],
    )
    return world


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = rotor(assets).at(0.05)
    camera = raycam.Camera.look_at([0, -5.2, 0.9], [0, 0, 1.4], size=(480, 540), fov=36)
    halves = [camera.exposing(0.0005), camera.exposing(0.0005, readout=0.06)]
    images = [quality.shot(world, half, samples=20) for half in halves]
    images[1][:, : max(1, round(4 * quality.scale))] = 255
    return np.concatenate(images, axis=1)
