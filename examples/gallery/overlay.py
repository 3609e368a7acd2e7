"""Ground truth of one frame in slanted strips: colour with boxes in space, depth, normals and object ids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality
from PIL import Image, ImageDraw
from still_life import still_life

PALETTE = np.random.default_rng(8).uniform(0.25, 1.0, (64, 3)) * 255
EDGES = [(a, b) for a in range(8) for b in range(a) if (a ^ b).bit_count() == 1]


def draw_boxes(picture: Picture, world: raycam.World, camera: raycam.Camera, width: int) -> Picture:
    """Returns the picture with the oriented boxes of all models."""
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    for item in world.objects:
        if item.category == "model":
            corners = np.asarray(raycam.box3d(world, item.id).corners)
            pixels, _ = camera.project(corners)
            color = tuple(int(value) for value in PALETTE[item.id])
            for a, b in EDGES:
                draw.line([*pixels[a], *pixels[b]], fill=color, width=width)
    return np.asarray(image)


def picture(assets: Path, quality: Quality) -> Picture:
    """Returns the image."""
    world, camera = still_life(assets)
    frame = quality.frame(world, camera, 20, channels=["color", "depth", "normal", "instance"])
    color = frame.to_srgb8()
    camera = quality.camera(camera)
    depth = np.clip((frame["depth"] - 1.2) / 1.6, 0, 1)[..., None]
    boxes = draw_boxes(color, world, camera, max(1, round(3 * quality.scale)))
    planes = [
        boxes,
        boxes,
        (1 - depth) ** 1.2 * [255, 236, 190] + depth * [24, 12, 74],
        (frame["normal"] + 1) * 127.5,
        PALETTE[frame["instance"] % 64],
    ]
    rows, columns = np.indices(color.shape[:2])
    place = (columns + 0.28 * (rows - color.shape[0] / 2)) / color.shape[1] * 5
    strip = np.clip(place.astype(int), 0, 4)[..., None]
    picture = np.select([strip == number for number in range(5)], planes)
    seam = np.abs(place - np.round(place)) < 0.006
    picture[seam & (np.round(place) > 0) & (np.round(place) < 5)] = 255
    return picture.clip(0, 255).round().astype(np.uint8)
