"""Lights diffuse and specular surfaces with a low sun, a warm round bulb and a blue sky.

Writes sunny.png and night.png.
"""

import raycam


def room() -> raycam.World:
    """Returns a world with three solids on a floor."""
    world = raycam.World()
    world.add_object(plane={"size": [12, 12]}, color=[0.6, 0.6, 0.58], name="floor")
    world.add_object(box={"size": 1}, location=[-1.2, 0.6, 0.5], yaw=30, color="#c0392b")
    ball = {"sphere": {"radius": 0.6, "level": 5}, "location": [0.3, -0.2, 0.6], "color": "#2e86c1"}
    world.add_object(ball | {"diffuse": 0.6, "specular": 0.35, "shininess": 80})
    world.add_object(cone={"radius": 0.5, "height": 1.4}, location=[1.6, 0.8, 0.7], color="#d4ac0d")
    return world


camera = raycam.Camera.look_at([0.5, -6, 2.4], [0.1, 0, 0.5], [0, 0, 1], size=(480, 360), fov=32)

sunny = room()
sunny.add_light({"type": "sun", "direction": [1, 0.7, -0.8], "irradiance": [3.2, 2.9, 2.5]})
sunny.add_light({"type": "sky", "radiance": [0.28, 0.36, 0.5]})
frame = raycam.render(sunny, camera, samples=16, ambient_occlusion=True)
frame.save("sunny.png")

night = room()
night.add_light({"type": "point", "position": [-1.0, -1.4, 2.2], "power": [140, 95, 55], "radius": 0.15})
night.add_light({"type": "sky", "radiance": [0.01, 0.014, 0.03]})
raycam.render(night, camera, samples=16).save("night.png")
