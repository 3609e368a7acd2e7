"""Three cameras at one position: a pinhole and two with distortion."""

from __future__ import annotations

import raycam

SIZE = (96, 64)


def cameras() -> dict[str, raycam.Camera]:
    place = {"eye": [4, -3, 2.5], "target": [0, 0, 0.4], "size": SIZE}
    return {
        "pinhole": raycam.Camera.look_at(**place, fov=35),
        "lens": raycam.Camera.look_at(
            **place, fov=60, distortion=[-0.25, 0.05, 0.002, 0.001], pixel_center="half"
        ),
        "fisheye": raycam.Camera.look_at(**place, focal=30, distortion=[0.02, 0, 0, 0], model="fisheye"),
    }
