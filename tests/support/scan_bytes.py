"""Small lidar scans whose bytes are equal on every machine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import raycam

from .picture_bytes import digest

HASHES = Path(__file__).parents[1] / "data" / "scan_bytes.json"
DRIVE = {
    "keyframe": [
        {"time": 0, "object": "car", "location": [7, -4, 0.8]},
        {"time": 1, "object": "car", "location": [7, 6, 0.8]},
    ],
    "fps": 10,
    "seconds": 1,
}
BEAMS = {"beam_samples": 7, "returns": "dual", "waveform": True}
SCANS: dict[str, tuple[str, dict[str, Any]]] = {
    "Velodyne": ("vlp16", {}),
    "Ouster": ("os1-16", {"returns": "dual"}),
    "Hesai": ("pandar-xt32", {}),
    "Risley prisms": ("livox-mid40", {}),
    "raster": ("livox-hap", {}),
    "one plane": ("hokuyo-utm30lx", {}),
    "beams": ("os1-16", BEAMS),
    "beams of a Risley prism": (
        "livox-mid40",
        {**BEAMS, "returns": "all", "beam_divergence": (0.005, 0.0007)},
    ),
    "beams in fog": ("os1-16", {**BEAMS, "visibility": 60.0}),
    "fog": ("os1-16", {"visibility": 30.0, "returns": "dual"}),
    "light of the world": ("hokuyo-utm30lx", {"near_ir_samples": 4}),
    "overlap": ("vlp16", {"overlap": [[0.5, 0.1], [3.0, 0.7], [9.0, 1.0]]}),
}


def street() -> raycam.World:
    """A floor, a wall with a sign, a mirror, a pane of glass, a ball, and a car that moves."""
    world = raycam.World()
    world.add_object(plane={"size": [60, 60]}, name="floor", color=[0.3, 0.3, 0.3])
    world.add_object(
        box={"size": [0.5, 40, 8]}, name="wall", location=[15, 0, 4], yaw=7, color=[0.6, 0.5, 0.4]
    )
    sign = {"reflectance": 0.5, "retroreflection": 200}
    world.add_object(box={"size": [0.1, 1, 1]}, name="sign", location=[9, 5, 2], yaw=20, lidar=sign)
    table = {"reflectance": 0.2, "retroreflection_table": [[0, 300], [20, 150], [40, 10]]}
    world.add_object(box={"size": [0.1, 1, 1]}, name="second sign", location=[9, -5, 2], yaw=30, lidar=table)
    mirror = {"type": "metal", "metal": "silver", "roughness": 0.0}
    world.add_object(box={"size": [4, 0.1, 3]}, name="mirror", location=[2, 8, 1.5], yaw=5, **mirror)
    world.add_object(box={"size": [0.02, 4, 3]}, name="pane", location=[-5, 0, 1.5], yaw=12, type="glass")
    world.add_object(
        box={"size": 2}, name="behind the pane", location=[-9, 1, 1], yaw=33, color=[0.8, 0.8, 0.8]
    )
    gloss = {"color": [0.2, 0.3, 0.6], "specular": [0.3, 0.3, 0.3], "shininess": 40}
    world.add_object(sphere={"radius": 1.2, "level": 3}, name="ball", location=[3, -5, 1.2], **gloss)
    metal = {"type": "metal", "metal": "copper", "roughness": 0.4}
    world.add_object(box={"size": [2, 4, 1.6]}, name="car", location=[7, -4, 0.8], **metal)
    world.set_video(**DRIVE)
    return world


def scan(name: str, world: raycam.World) -> raycam.Scan:
    """Scans the street, 0.2 s after its start, with a lidar that moves and turns."""
    device, settings = SCANS[name]
    lidar = raycam.Lidar(device, **settings).placed([0, 0, 1.8], yaw=-8, pitch=1)
    bends = [
        (0.06, lidar.placed([0.4, 0.1, 1.8], yaw=4)),
        (0.1, lidar.placed([0.7, 0.3, 1.82], yaw=19, roll=2)),
    ]
    return raycam.scan(world.at(0.2), lidar.moving(bends), frame=1, keep_lost=True)


def digests(name: str, world: raycam.World) -> dict[str, str]:
    """The hashes of a scan's fields."""
    found = scan(name, world)
    return {field: digest(np.asarray(found[field])) for field in sorted(found)}


def kept() -> dict[str, dict[str, str]]:
    """The hashes in the file."""
    found: dict[str, dict[str, str]] = json.loads(HASHES.read_text(encoding="utf-8"))
    return found
