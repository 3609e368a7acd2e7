"""Renders a video: the camera orbits a box once, while a ball moves over it by keyframes.

Writes orbit.mp4.
"""

import raycam
from raycam.video import write_video

world = raycam.World.from_dict(
    {
        "camera": {"size": [320, 240], "fov": 40, "location": [3.4, -2.6, 2.0], "target": [0, 0, 0.5]},
        "object": [
            {"name": "floor", "plane": {"size": [8, 8]}, "color": "#8fa3ad"},
            {"name": "box", "box": {"size": 1}, "location": [0, 0, 0.5], "color": "#c0392b"},
            {"name": "ball", "sphere": {"radius": 0.25}, "location": [-1, 0, 0.25], "color": "#f1c40f"},
        ],
        "light": [
            {"type": "sun", "direction": [-1, 1, -2], "irradiance": [2.5, 2.4, 2.1]},
            {"type": "sky", "radiance": [0.3, 0.35, 0.45]},
        ],
        "video": {
            "fps": 12,
            "seconds": 2,
            "orbit": {"target": [0, 0, 0.5], "degrees": 360},
            "keyframe": [
                {"time": 0, "object": "ball", "location": [-1, 0, 0.25]},
                {"time": 1, "object": "ball", "location": [0, 0, 1.7]},
                {"time": 2, "object": "ball", "location": [1, 0, 0.25]},
            ],
        },
    }
)
film = write_video(world, "orbit.mp4", samples=4)
print(f"{len(film)} frames, {film.seconds:g} seconds")
