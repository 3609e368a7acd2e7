"""Renders the ground truth of one frame in slanted strips.

The strips show colour with 3D boxes, depth, normals and object ids.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality
from PIL import Image, ImageDraw
from still_life import still_life

HUES = np.arange(64)[:, None] * 0.618 + [0, 1 / 3, 2 / 3]
PALETTE = 140 + 110 * np.cos(2 * np.pi * HUES)  # sRGB
RAMP = np.array(  # sRGB, from near to far
    [[255, 246, 200], [250, 160, 60], [200, 50, 95], [85, 25, 130], [20, 14, 70]]
)
EDGES = [(a, b) for a in range(8) for b in range(a) if (a ^ b).bit_count() == 1]


def draw_boxes(picture: Picture, world: raycam.World, camera: raycam.Camera, width: int) -> Picture:
    """Returns the image with the oriented boxes of all models drawn on it."""
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
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world, camera = still_life(assets)
    frame = quality.frame(world, camera, 20, channels=["color", "depth", "normal", "instance"])
    color = frame.to_srgb8()
    camera = quality.camera(camera)
    depth = np.clip(frame["depth"], 1.35, 2.3)
    steps = np.linspace(1.35, 2.3, len(RAMP))
    boxes = draw_boxes(color, world, camera, max(1, round(3 * quality.scale)))
    planes = [
        boxes,
        boxes,
        np.stack([np.interp(depth, steps, band) for band in RAMP.T], axis=-1),
        (frame["normal"] + 1) * 127.5,
        PALETTE[frame["instance"] % 64],
    ]
    rows, columns = np.indices(color.shape[:2])
    place = (columns + 0.28 * (rows - color.shape[0] / 2)) / color.shape[1] * 5
    strip = np.clip(place.astype(int), 0, 4)[..., None]
    picture = np.select([strip == number for number in range(5)], planes)
    seam = np.abs(place - np.round(place)) < 0.006
    picture[seam & (np.round(place) > 1) & (np.round(place) < 5)] = 255
    return picture.clip(0, 255).round().astype(np.uint8)
