"""Renders a gearbox as a technical drawing.

Lines are drawn where depth or normals change abruptly; the shading is ambient occlusion.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality

PAPER, INK = np.array([0.06, 0.2, 0.42]), np.array([0.86, 0.94, 1.0])
VIEWS = (  # for each view: direction to the camera; left, top, width, height in the image; height in m
    ((2.4, -3.2, 2.6), (30, 20, 560, 500), 2.2),
    ((0, -4, 0), (610, 40, 310, 180), 1.35),
    ((0, -0.004, 4), (610, 240, 310, 270), 2.05),
)


def ink(frame: raycam.Frame) -> np.ndarray:
    """Returns the amount of ink, 0 to 1, [h, w]: edges of depth and of normals."""
    depth = np.where(np.isfinite(frame["depth"]), frame["depth"], 9)
    normal = frame["normal"]
    lines = []
    for axis in (0, 1):
        jump = np.abs(np.diff(depth, 2, axis=axis, prepend=depth.take([0, 0], axis)))
        bend = np.linalg.norm(np.diff(normal, axis=axis, prepend=normal.take([0], axis)), axis=2)
        lines += [(jump - 0.012) * 60, (bend - 0.35) * 2]
    drawn = np.clip(np.max(lines, axis=0), 0, 1)
    return drawn * (count_near(drawn > 0.2) >= 13)  # without isolated dots, where the mesh has slivers


def count_near(mask: np.ndarray, reach: int = 6) -> np.ndarray:
    """Returns the number of true values within `reach` pixels in x and y, [h, w]."""
    padded = np.pad(mask.astype(int), reach)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * reach + 1, 2 * reach + 1))
    return windows.sum(axis=(2, 3))


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3].

    The gearbox is drawn from three directions.
    """
    world = raycam.World()
    world.add_object(mesh=assets / "meshes/cycloidal.ply", name="gearbox")
    centre = world.bounds.mean(axis=0)
    scale = 2 * quality.scale  # rendered at twice the size, with four samples of each channel per pixel
    paint = np.ones((round(540 * scale) // 2 * 2, round(960 * scale) // 2 * 2, 3)) * PAPER
    rows, columns = np.indices(paint.shape[:2]) / scale
    paint += 0.15 * ((rows % 30 < 1) | (columns % 30 < 1))[..., None] * PAPER
    for direction, place, height in VIEWS:
        left, top, wide, high = (round(side * scale) for side in place)
        camera = raycam.Camera.orthographic(
            np.add(centre, direction), target=centre, height=height, size=(wide, high)
        )
        samples = max(4, round(16 * quality.effort))
        channels = ["color", "depth", "normal"]
        frame = raycam.render(
            world, camera, integrator="ao", ambient_occlusion=0.5, samples=samples, channels=channels
        )
        part = paint[top : top + high, left : left + wide]
        seen = np.isfinite(frame["depth"])[..., None]
        part[:] = np.where(seen, PAPER * (0.5 + 0.8 * frame["color"].mean(axis=2, keepdims=True)), part)
        part += ink(frame)[..., None] * (INK - part)
    small = paint.reshape(paint.shape[0] // 2, 2, -1, 2, 3).mean(axis=(1, 3))
    return (np.clip(small, 0, 1) * 255).round().astype(np.uint8)
