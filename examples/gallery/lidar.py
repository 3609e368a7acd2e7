"""Draws a lidar scan over the image of a camera on the same car.

The lidar has 128 lasers; its points are coloured by distance.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality
from PIL import Image, ImageDraw
from town import street

NEAR, FAR = 3.0, 40.0
RAMP = np.array(  # sRGB colours, from the nearest to the farthest point
    [[255, 70, 60], [255, 190, 50], [120, 255, 90], [50, 220, 255], [80, 110, 255], [200, 100, 255]]
)


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = street(assets)
    camera = raycam.Camera.look_at([-0.5, -9.7, 1.7], [0.35, 0, 1.75], size=(960, 540), fov=64)
    frame = quality.frame(world, camera, 10, channels=["color", "distance"], max_depth=5)
    camera = quality.camera(camera)
    lidar = raycam.Lidar("os1-128", mode="2048x10").placed([-0.5, -9.9, 1.95], yaw=90)
    points = raycam.scan(world, lidar)["true_position"]
    pixels, depth = camera.project(points)
    width, height = camera.size
    inside = (depth > 0) & (pixels >= 0).all(axis=1) & (pixels < [width - 1, height - 1]).all(axis=1)
    points, pixels = points[inside], pixels[inside]
    distance = np.linalg.norm(points - camera.C, axis=1)
    column, row = pixels.round().astype(int).T
    visible = distance < frame["distance"][row, column] * 1.03 + 0.05
    ends = np.geomspace(NEAR, FAR, len(RAMP))
    image = Image.fromarray((frame.to_srgb8() * 0.7).round().astype(np.uint8))
    image = image.resize((2 * width, 2 * height), Image.Resampling.BICUBIC)
    draw = ImageDraw.Draw(image)
    for place, far in zip(2 * pixels[visible], distance[visible], strict=True):
        color = tuple(int(np.interp(np.log(far), np.log(ends), band)) for band in RAMP.T)
        radius = quality.scale * np.clip(12 / far, 1.5, 3.2)
        draw.ellipse([*(place - radius), *(place + radius)], fill=color)
    return np.asarray(image.resize((width, height), Image.Resampling.LANCZOS))
