"""A gearbox as a technical drawing: lines where depth or normals jump, with shading from ambient occlusion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality


def picture(assets: Path, quality: Quality) -> Picture:
    """Returns the image."""
    world = raycam.World()
    world.add_object(mesh=assets / "meshes/cycloidal.ply", name="gearbox")
    centre = world.bounds.mean(axis=0)
    camera = raycam.Camera.orthographic(
        centre + [2.4, -3.2, 2.3], target=centre + [0.45, 0.34, 0.0], height=1.9, size=(1280, 720)
    )
    camera = quality.camera(camera)
    twice = camera.resized((camera.size[0] * 2, camera.size[1] * 2))
    frame = raycam.render(
        world,
        twice,
        integrator="ao",
        ambient_occlusion=0.5,
        samples=32,
        channels=["color", "depth", "normal"],
    )
    depth = np.nan_to_num(frame["depth"], posinf=9)
    jump = sum(np.abs(np.diff(depth, 2, axis=axis, prepend=depth.take([0, 0], axis))) for axis in (0, 1))
    bend = sum(
        np.linalg.norm(np.diff(frame["normal"], axis=axis, prepend=frame["normal"].take([0], axis)), axis=2)
        for axis in (0, 1)
    )
    line = np.clip(np.maximum((jump - 0.012) * 60, (bend - 0.35) * 2), 0, 1)
    shade = frame["color"].mean(axis=2)
    paper, ink = np.array([0.06, 0.2, 0.42]), np.array([0.86, 0.94, 1.0])
    rows, columns = np.indices(line.shape) / quality.scale
    grid = ((rows % 80 < 2) | (columns % 80 < 2)) * 0.12
    tone = np.where(np.isfinite(frame["depth"]), 0.55 + 0.75 * shade, 1 + grid)[..., None]
    drawn = np.clip(paper * tone + line[..., None] * (ink - paper), 0, 1)
    height, width = line.shape
    small = drawn.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    return (small * 255).round().astype(np.uint8)
