"""Renders ground truth next to antialiased colour: depth, positions, normals and ids.

The values are exact at every pixel centre. Writes truth.exr and truth.npz.
"""

import numpy as np
import raycam

world = raycam.World()
world.add_object(torus={"radius": 1, "tube": 0.35}, name="ring", color="#b03a2e")
world.add_object(sphere={"radius": 0.5}, name="ball", location=[0, 0, 0.2], color="#f5b041")
world.add_object(plane={"size": [6, 6]}, name="floor", location=[0, 0, -0.4])
world.add_light("sun", direction=[-1, 1, -2], irradiance=3)

camera = raycam.Camera.look_at([2.5, -3, 2.5], [0, 0, 0], [0, 0, 1], size=(640, 480), fov=35)
frame = raycam.render(world, camera, channels="all")
frame.save("truth.exr")  # named layers, float32, with the camera matrix in the header
frame.save("truth.npz")  # the same arrays for NumPy

# Each visible point projects onto the centre of its pixel.
v, u = np.nonzero(frame["instance"] >= 0)
pixels, in_front = camera.project(frame["position"][v, u])
print(f"largest distance from the pixel's centre: {np.abs(pixels - np.stack([u, v], -1)).max():.1e} px")
assert in_front.all()

# Depth is z along the principal axis: the third row of R.
z = (frame["position"][v, u] - camera.C) @ camera.R[2]
assert np.allclose(z, frame["depth"][v, u], rtol=1e-6)

pure = frame["coverage"] == 1
print(f"{pure.mean():.1%} of the pixels show a single object")
