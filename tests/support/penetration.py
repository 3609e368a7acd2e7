"""Penetration of a world's objects, measured by FCL through trimesh."""

from __future__ import annotations

import numpy as np
import raycam
import trimesh


def fcl_penetration(world: raycam.World) -> float:
    """The greatest depth at which FCL finds two objects of the world to overlap, in metres.

    Overlaps among fixed objects, whose names begin with `bin/`, are not counted.
    """
    manager = trimesh.collision.CollisionManager()
    for item in world.objects:
        corners = world.triangles(item.id).reshape(-1, 3)
        mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=True)
        manager.add_object(item.name, mesh)
    _, _, contacts = manager.in_collision_internal(return_names=True, return_data=True)
    fixed = {item.name for item in world.objects if item.name.startswith("bin/")}
    depths = [contact.depth for contact in contacts if not contact.names <= fixed]
    return max(depths, default=0.0)
