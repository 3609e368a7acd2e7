"""Renders a first image: a box of twelve triangles, viewed by a camera with a given pose.

Writes box.png.
"""

import raycam

corners = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
triangles = [
    *([0, 1, 3], [0, 3, 2]),  # x = -0.5
    *([4, 6, 7], [4, 7, 5]),  # x = +0.5
    *([0, 4, 5], [0, 5, 1]),  # y = -0.5
    *([2, 3, 7], [2, 7, 6]),  # y = +0.5
    *([0, 2, 6], [0, 6, 4]),  # z = -0.5
    *([1, 5, 7], [1, 7, 3]),  # z = +0.5
]
colors = [[0.9, 0.1, 0.05], [1.0, 0.4, 0.1], [0.05, 0.2, 0.8], [0.1, 0.5, 0.9]] * 3

world = raycam.World()
world.add_mesh(corners, triangles, name="box", face_colors=colors)

camera = raycam.Camera.from_pose([2.4, -3.2, 1.9], roll=0, pitch=25, yaw=127, size=(640, 480), focal=900)
frame = raycam.render(world, camera, integrator="flat")
frame.save("box.png")
