"""Renders a mesh file with its texture several times, on a hill made of arrays.

Writes herd.png.
"""

from pathlib import Path

import numpy as np
import raycam

# Relative paths refer to the world's folder. The mesh and its texture are part of raycam.
world = raycam.World(folder=Path(raycam.__file__).parent / "assets")
world.add_object(mesh="spot/cow.obj", name="spot", roll=90, yaw=130, location=[0, 0, 0.737])

# The same mesh again at other positions and sizes; its triangles are stored once.
for k in range(5):
    angle = np.radians(72 * k + 40)
    place = [2.2 * np.cos(angle), 2.2 * np.sin(angle), 0.737 * 0.4]
    world.add_object(instance_of="spot", name=f"calf {k}", roll=90, yaw=72 * k, scale=0.4, location=place)

# The hill is a grid of heights. `uvs` assigns a position in the texture to each vertex.
x, y = np.meshgrid(np.linspace(-6, 6, 61), np.linspace(-6, 6, 61))
height = 0.25 * np.maximum(0, np.hypot(x, y) - 3.2) ** 1.5
vertices = np.stack([x, y, height], -1).reshape(-1, 3)
index = np.arange(61 * 61).reshape(61, 61)
a, b, c, d = (corner.ravel() for corner in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
uvs = 0.02 + 0.06 * np.stack([x, y], -1).reshape(-1, 2) / 12
grass = {"texture": "spot/cow_texture.png", "color": "#88aa66"}
world.add_mesh(vertices, faces, uvs=uvs, material=grass, name="hill")

world.add_light(type="sun", direction=[1, 1, -1.4], irradiance=[2.8, 2.6, 2.2])
world.add_light(type="sky", radiance=[0.35, 0.42, 0.5])
camera = raycam.Camera.look_at([-4.2, -6.0, 3.6], [0, 0, 0.5], [0, 0, 1], size=(480, 360), fov=32)
raycam.render(world, camera, samples=8, ambient_occlusion=True).save("herd.png")
print(world)
