"""Renders glass on a table: wine, water, a fish and a ball, and the light that they focus."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, fractal, mix, stand


def lathe(world: raycam.World, profile: list[tuple[float, float]], name: str, **material: object) -> int:
    """Adds the closed surface of revolution of a profile.

    The profile consists of (radius, height) pairs, and starts and ends on the axis.
    """
    knots = np.array(profile)
    length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(knots, axis=0).T))])
    at = np.linspace(0, length[-1], 260)
    curve = np.stack([np.interp(at, length, knots[:, axis]) for axis in (0, 1)], axis=1)
    for _ in range(3):  # rounds the corners
        curve[1:-1] = (curve[:-2] + 2 * curve[1:-1] + curve[2:]) / 4
    sides = 128
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inner = curve[1:-1]
    corners = np.concatenate([
        (inner[:, :1, None] * ring).reshape(-1, 2), np.zeros((2, 2))
    ])  # fmt: skip
    heights = np.concatenate([np.repeat(inner[:, 1], sides), curve[[0, -1], 1]])
    row = np.arange(len(inner) - 1)[:, None] * sides
    here, beside = np.arange(sides), (np.arange(sides) + 1) % sides
    a, b, c, d = row + here, row + beside, row + sides + beside, row + sides + here
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    bottom, top, last = len(heights) - 2, len(heights) - 1, (len(inner) - 1) * sides
    caps = [
        np.stack([0 * here + bottom, beside, here], 1),
        np.stack([0 * here + top, last + here, last + beside], 1),
    ]
    return world.add_mesh(np.column_stack([corners, heights]), np.concatenate([faces, *caps]), name=name,
                          material=material)  # fmt: skip


GLASS = [(0, 0), (0.036, 0), (0.037, 0.002), (0.008, 0.007), (0.004, 0.014), (0.004, 0.085), (0.012, 0.094),
         (0.034, 0.115), (0.042, 0.145), (0.040, 0.18), (0.034, 0.215), (0.0325, 0.215), (0.0385, 0.18),
         (0.0405, 0.145), (0.0325, 0.1165), (0.011, 0.097), (0, 0.0955)]  # fmt: skip
TUMBLER = [(0, 0), (0.03, 0), (0.032, 0.003), (0.04, 0.105), (0.0395, 0.1065), (0.038, 0.105), (0.0302, 0.012),
           (0.028, 0.009), (0, 0.0085)]  # fmt: skip
WATER = [(0, 0.0075), (0.0285, 0.0085), (0.0308, 0.012), (0.0362, 0.072), (0, 0.072)]
WINE = [(0, 0.0945), (0.0115, 0.096), (0.0333, 0.1157), (0.0412, 0.1445), (0.0411, 0.15), (0, 0.15)]


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    lathe(world, GLASS, "glass", type="glass", ior=1.5, priority=1)
    lathe(world, WINE, "wine", type="glass", ior=1.34, attenuation_color=[0.55, 0.03, 0.05],
          attenuation_distance=0.02)  # fmt: skip
    lathe(world, TUMBLER, "tumbler", type="glass", ior=1.5, priority=1)
    lathe(world, WATER, "water", type="glass", ior=1.33, attenuation_color=[0.35, 0.85, 0.8],
          attenuation_distance=0.12)  # fmt: skip
    for name in ("tumbler", "water"):
        world.set_object(name, location=[0.155, 0.05, 0])
    stand(world, assets / "meshes/fish.obj", 0.085, (-0.165, 0.01, 0.001), roll=90, yaw=75, name="fish", type="glass",
          ior=1.5, attenuation_color=[0.25, 0.6, 0.95], attenuation_distance=0.05)  # fmt: skip
    world.add_object(sphere={"radius": 0.032, "level": 6}, location=[0.085, -0.075, 0.0325], name="ball", type="glass",
                     ior=1.52)  # fmt: skip
    linen = mix("#b9ab95", "#d8cbb6", fractal((512, 512), 0.9, seed=4))
    world.add_object(box=[3, 1.1, 0.04], location=[0, 0.1, -0.02], texture=linen, name="table")
    world.add_object(box=[6, 0.05, 3], location=[0, 1.6, 0.3], color="#3c474e", name="wall")
    world.add_light(
        "bulb", position=[0.25, 0.95, 1.05], radius=0.022, power=[170, 138, 96], visible={"camera": False}
    )
    world.add_light("sky", radiance=[0.1, 0.125, 0.17])
    camera = raycam.Camera.look_at([-0.04, -0.78, 0.42], [0.0, -0.03, 0.06], size=(960, 540), fov=24.5)
    return quality.shot(world, camera, samples=40, max_depth=12, clamp=None)
