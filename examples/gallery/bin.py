"""Renders a bin of parts that fell into it in a simulation.

The left half shows the colour image of a stereo camera, the right half its exact disparity.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, planks, softbox, stand

RAMP = np.array(  # sRGB colours, from the farthest to the nearest depth
    [
        [30, 15, 60],
        [55, 60, 170],
        [30, 150, 190],
        [70, 205, 120],
        [215, 225, 60],
        [250, 150, 40],
        [215, 45, 35],
    ]
)
WIDE, DEEP, HIGH = 0.6, 0.4, 0.13


def pile(assets: Path) -> raycam.World:
    """Returns a world with a bin of 40 parts at rest."""
    world = raycam.World()
    world.add_object(box=[3, 3, 0.04], location=[0, 0, -0.04], texture=planks(1024, 12, 3), type="principled",
                     roughness=0.5, name="table")  # fmt: skip
    blue = {"color": "#16407c", "type": "principled", "roughness": 0.4}
    world.add_object(box=[WIDE, DEEP, 0.02], location=[0, 0, -0.01], name="bin/bottom", **blue)
    for side in (-1, 1):
        across, along = side * WIDE / 2, side * DEEP / 2
        world.add_object(
            box=[0.012, DEEP, HIGH], location=[across, 0, HIGH / 2], name=f"bin/x {side}", **blue
        )
        world.add_object(box=[WIDE, 0.012, HIGH], location=[0, along, HIGH / 2], name=f"bin/y {side}", **blue)
    names = []
    parts = [
        (assets / "meshes/cycloidal.ply", 0.052, {"type": "metal", "metal": "copper", "roughness": 0.3}),
        (assets / "meshes/featuretype.ply", 0.036, {"type": "metal", "metal": "titanium", "roughness": 0.35}),
        (assets / "meshes/fish.obj", 0.1, {"type": "principled", "color": "#d8732a", "clearcoat": 0.6}),
        (assets / "meshes/boot.obj", 0.046, {"type": "principled", "color": "#7a4a22", "roughness": 0.6}),
    ]
    for number in range(32):
        file, height, material = parts[number % len(parts)]
        names.append(f"part {number}")
        stand(world, file, height, (0, 0, 2), name=names[-1], **material)
    for number, color in enumerate(("#c8ccd0", "#d9b13b", "#c8ccd0", "#b8392e") * 2):
        names.append(f"ball {number}")
        world.add_object(sphere=0.027, location=[0, 0, 2], name=names[-1], color=color, type="principled",
                         roughness=0.2)  # fmt: skip
    raycam.settle(world, names, into="bin", seed=7, physics={name: {"parts": 6} for name in names})
    return world


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = pile(assets)
    softbox(world, (-0.9, -0.7, 1.3), (0, 0, 0), (0.7, 0.5), [26, 24, 21])
    softbox(world, (1.0, 0.8, 1.0), (0, 0, 0), (0.3, 0.8), [14, 17, 21])
    world.add_light("sky", radiance=[0.3, 0.31, 0.33])
    left = raycam.Camera.look_at([0.05, -0.52, 0.98], [0.01, -0.012, 0.03], size=(960, 540), fov=26.5)
    frame = quality.frame(world, left, 18, channels=["color"])
    rig = raycam.Rig.stereo(quality.camera(left), baseline=0.06)
    disparity = raycam.disparity(world, rig)["disparity"]
    low, high = np.nanpercentile(disparity, (2, 99.8))
    steps = np.linspace(low, high, len(RAMP))
    shown = np.stack([np.interp(np.nan_to_num(disparity, nan=low), steps, band) for band in RAMP.T], axis=-1)
    rows, columns = np.indices(disparity.shape)
    place = columns + 0.3 * (rows - disparity.shape[0] / 2) - disparity.shape[1] / 2
    picture = np.where(place[..., None] < 0, frame.to_srgb8(), shown)
    picture[np.abs(place) < 1.5 * quality.scale] = 255
    return picture.round().astype(np.uint8)
