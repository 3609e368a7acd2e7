"""The scene of the image with motion blur: a turning carousel with foxes and bulbs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import ribbon, stand

SECTORS = ("#b3261e", "#f3e6cc")


def carousel(assets: Path) -> raycam.World:
    """Returns a world in which a carousel turns by 100 degrees per second about the z axis."""
    world = raycam.World()
    angle = np.linspace(0, 2 * np.pi, 97)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turning = []

    def cone(name: str, low: tuple[float, float], high: tuple[float, float], colors: tuple[str, ...]) -> None:
        rims = [np.column_stack([radius * ring, np.full(97, z)]) for radius, z in (low, high)]
        tones = np.array([list(bytes.fromhex(colors[i // 6 % len(colors)][1:])) for i in range(96)], np.uint8)
        world.add_mesh(np.concatenate(rims), ribbon(96), name=name, face_colors=np.concatenate([tones, tones]),
                       material={"type": "principled", "roughness": 0.45})  # fmt: skip
        turning.append((name, np.eye(4)))

    cone("roof", (3.0, 3.55), (0.0, 4.9), SECTORS)
    cone("frieze", (3.0, 3.15), (3.0, 3.55), SECTORS[::-1])
    cone("ceiling", (0.0, 3.4), (3.0, 3.2), ("#d9b36a", "#8c2f2a"))
    cone("deck", (2.9, 0.45), (0.5, 0.45), ("#7c5636", "#5d3d24"))
    cone("drum", (0.55, 0.45), (0.55, 3.35), ("#d8b25c", "#274d63", "#e9dfc8"))
    world.add_object(cylinder={"radius": 2.95, "height": 0.42, "segments": 96}, location=[0, 0, 0.22],
                     color="#7a1f1b", name="base")  # fmt: skip
    file = assets / "gltf/Fox/Fox.glb"
    for number in range(8):
        turn = np.pi / 4 * number
        place = (2.1 * np.cos(turn), 2.1 * np.sin(turn), 0.85 + 0.22 * (number % 2))
        name = f"fox {number}"
        stand(world, file, 1.05, place, yaw=np.degrees(turn) + 180, name=name)
        turning.append((name, np.asarray(world.objects[-1].matrix)))
        pole = np.eye(4)
        pole[:3, 3] = [*place[:2], 1.9]
        world.add_object(cylinder={"radius": 0.03, "height": 2.9}, matrix=pole.tolist(), type="metal", metal="gold",
                         roughness=0.25, name=f"pole {number}")  # fmt: skip
        turning.append((f"pole {number}", pole))
    for number in range(24):
        turn = np.pi / 12 * number
        for radius, z, tag in ((3.06, 3.35, "outer"), (2.4, 3.2, "inner")):
            place = np.eye(4)
            place[:3, 3] = [radius * np.cos(turn), radius * np.sin(turn), z]
            name = f"{tag} {number}"
            world.add_object(sphere={"radius": 0.05, "level": 2}, matrix=place.tolist(), name=name, color="#000000",
                             emission=[80, 36, 11])  # fmt: skip
            turning.append((name, place))
    times = np.linspace(-0.1, 0.1, 9)

    def turned(time: float) -> np.ndarray:
        c, s = np.cos(np.deg2rad(100) * time), np.sin(np.deg2rad(100) * time)
        return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    keyframes = [
        {"time": float(time + 0.1), "object": name, "matrix": (turned(time) @ matrix).tolist()}
        for name, matrix in turning
        for time in times
    ]
    world.set_video(fps=10, seconds=0.2, keyframe=keyframes)
    return world
