"""Renders a robot arm over a table of parts; `category` gives the mask of every link."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import raycam
from arm import urdf
from common import Picture, Quality, planks, softbox, stand
from PIL import Image, ImageDraw, ImageFont

JOINTS = {"turn": 0.5, "shoulder": 0.42, "elbow": 1.5, "roll": 0.3, "wrist": 1.05, "flange": 0.5}
LEFT = ("turret", "forearm", "wrist", "right_finger")  # the parts whose labels are on the left
TINTS = np.array(
    [[230, 60, 60], [250, 150, 40], [240, 220, 60], [90, 200, 80], [50, 190, 220], [90, 110, 240], [190, 90, 230],
     [240, 100, 170], [160, 230, 150]]
)  # fmt: skip


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(urdf())
        arm = world.add_robot(file, joints=JOINTS, location=[-0.35, 0.15, 0])
    links = len(world.objects)
    for item in world.objects:
        world.set_object(item.id, type="principled", roughness=0.35, clearcoat=0.4)
    world.add_object(box=[2.6, 1.7, 0.08], location=[0.1, 0.2, -0.04], texture=planks(1024, 9, 5), type="principled",
                     roughness=0.3)  # fmt: skip
    world.add_object(plane=12, location=[0, 0, -0.8], color="#5a5e60")
    world.add_object(box=[12, 0.1, 6], location=[0, 2.2, 1], color="#8d9aa0")
    gear = {"type": "metal", "metal": "copper", "roughness": 0.28}
    x, y = arm.pose("hand")[:2, 3]
    stand(world, assets / "meshes/cycloidal.ply", 0.15, (x, y, 0), yaw=20, name="gearbox", **gear)
    stand(world, assets / "meshes/cycloidal.ply", 0.11, (-0.02, 0.42, 0), yaw=70, type="metal", metal="titanium",
          roughness=0.28)  # fmt: skip
    stand(world, assets / "meshes/boot.obj", 0.22, (0.72, 0.3, 0), roll=90, yaw=-50, color="#7a4a22",
          type="principled", roughness=0.55)  # fmt: skip
    stand(world, assets / "meshes/skull.obj", 0.19, (-0.82, 0.2, 0), roll=90, yaw=25, color="#d8cbb0",
          type="principled", roughness=0.55)  # fmt: skip
    stand(world, assets / "meshes/fish.obj", 0.15, (-0.02, -0.28, 0), roll=90, yaw=60, color="#2f7fbf",
          type="principled", roughness=0.3, clearcoat=0.7)  # fmt: skip
    softbox(world, (-1.6, -1.6, 2.2), (0, 0.1, 0.3), (1.2, 1.0), [26, 24, 21])
    softbox(world, (2.0, 0.2, 1.8), (0.1, 0.1, 0.3), (0.8, 1.2), [9, 11, 14])
    world.add_light("sky", radiance=[0.22, 0.24, 0.27])
    camera = raycam.Camera.look_at([0.5, -2.3, 0.95], [-0.04, 0.1, 0.385], size=(960, 540), fov=24.5)
    frame = quality.frame(world, camera, 18, channels=["color", "instance", "category"])
    ids = np.where(frame["instance"] < links, frame["category"], -1)
    ids = np.where(frame["instance"] < 0, -1, ids)
    names = np.unique(ids[ids >= 0])
    tint = TINTS[np.searchsorted(names, ids).clip(0, len(names) - 1) % len(TINTS)]
    color = frame.to_srgb8().astype(float)
    light = color.mean(axis=2, keepdims=True) / 255
    mask = (ids >= 0)[..., None]
    picture = np.where(mask, 0.25 * color + 0.75 * tint * (0.45 + 0.6 * light), color * 0.82)
    edge = np.zeros(ids.shape, bool)
    reach = max(1, round(1.5 * quality.scale))
    for axis in (0, 1):
        for step in range(1, reach + 1):
            edge |= (ids != np.roll(ids, step, axis)) & ((ids >= 0) | (np.roll(ids, step, axis) >= 0))
    picture[edge] = 255
    image = Image.fromarray(picture.clip(0, 255).round().astype(np.uint8))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(round(17 * quality.scale))
    for name in names:
        rows, columns = np.nonzero(ids == name)
        row, edge = rows.mean(), columns[rows == round(rows.mean())]
        right = world.categories[name] not in LEFT
        start = (edge.max() if right else edge.min()) + (1 if right else -1) * 6 * quality.scale
        end = start + (1 if right else -1) * 42 * quality.scale
        draw.line([start, row, end, row], fill="white", width=max(1, round(1.5 * quality.scale)))
        text = f" {world.categories[name]} "
        draw.text((end, row), text, fill="white", font=font, anchor="lm" if right else "rm")
    return np.asarray(image)
