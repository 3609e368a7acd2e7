"""Explains the colour of one pixel: every step of the lecture, in numbers and as a figure.

Writes explain.txt and explain.svg.
"""

from pathlib import Path

import raycam

world = raycam.World()
world.add_object(box={"size": 1}, name="box", color="#d7263d", yaw=20)
world.add_object(cone={"radius": 0.6, "height": 1.2, "segments": 12}, name="cone", location=[1.2, 1.4, 0.1])
camera = raycam.Camera.look_at([3, -4, 2], [0.2, 0.3, 0], [0, 0, 1], size=(640, 480), fov=35)

explanation = raycam.explain(world, camera, pixel=(300, 230))
print(explanation)
Path("explain.txt").write_text(str(explanation), encoding="utf-8")
explanation.save_figure("explain.svg")

# Check a number of the explanation: intersect the ray with the plane of the nearest triangle.
winner = explanation.winner
t = winner.n @ (winner.a - explanation.C) / (winner.n @ explanation.r)
frame = raycam.render(world, camera, channels=["triangle", "depth"])
assert abs(t - winner.t) <= 1e-12 * t
assert frame["triangle"][230, 300] == winner.triangle
