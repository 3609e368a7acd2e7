"""Casts the rays of a rotating scanner with 32 beams, and stores the measured points.

Writes points.ply.
"""

import numpy as np
import raycam

world = raycam.World()
world.add_object(plane={"size": [20, 20]}, name="floor")
for k in range(12):
    place = [6 * np.cos(k * np.pi / 6), 6 * np.sin(k * np.pi / 6), 1]
    world.add_object(cylinder={"radius": 0.4, "height": 2}, location=place, name=f"column {k}")
wagon = world.add_object(box={"size": [3, 1.6, 1.4]}, location=[3, -1, 0.7], yaw=20, name="wagon")

azimuth, elevation = np.radians(np.meshgrid(np.arange(0, 360, 0.4), np.linspace(-25, 10, 32)))
directions = np.stack(
    [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], -1
).reshape(-1, 3)
origins = np.tile([0.0, 0.0, 1.5], (len(directions), 1))

hits = world.cast_rays(origins, directions)
met = np.isfinite(hits["t"])
on_wagon = (hits["instance"] == wagon).sum()
print(f"{met.sum()} of {len(met)} beams hit something, {on_wagon} of them the wagon")
print(f"the farthest point is at {hits['t'][met].max():.2f} m")

# Points from which a lamp, 4 m above the floor, is hidden.
points = hits["position"][met]
lamp = np.array([0.0, 0.0, 4.0])
above = points + 1e-6 * hits["normal"][met]  # slightly above the surface
dark = world.occluded(above, lamp - above, t_max=1.0)
print(f"{dark.mean():.0%} of the points are not lit by the lamp")

with open("points.ply", "w", encoding="ascii") as file:
    file.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n")
    file.write("property float x\nproperty float y\nproperty float z\nend_header\n")
    np.savetxt(file, points, fmt="%.4f")
