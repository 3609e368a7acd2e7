"""A bumpy ball with a smooth texture, rendered from cameras around it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import raycam

SIZE = 96


def ball_texture() -> np.ndarray:
    """A smooth sRGB texture that is continuous across the seam of the coordinates.

    Neighbouring texels differ by up to 19 levels.
    """
    turn, height = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE * 2 * np.pi, (np.arange(SIZE) + 0.5) / SIZE)
    waves = np.stack(
        [np.sin(2 * turn + 9 * height), np.cos(turn - 8 * height), np.sin(3 * turn) * np.sin(15 * height)],
        axis=2,
    )
    return np.rint(128 + 90 * waves).astype(np.uint8)


def bumpy_ball(side: int = 12) -> raycam.World:
    """A ball without poles, of 4 `side`² triangles with edges of up to 20 degrees."""
    u, v = np.meshgrid(np.linspace(0, 1, 2 * side + 1), np.linspace(0.12, 0.88, side + 1))
    radius = 1 + 0.1 * np.sin(6 * np.pi * u) * np.sin(5 * np.pi * v)
    turn, polar = 2 * np.pi * u, np.pi * v
    directions = [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)]
    corner = (np.arange(side)[:, None] * (2 * side + 1) + np.arange(2 * side)).ravel()
    a, b, c, d = corner, corner + 2 * side + 1, corner + 2 * side + 2, corner + 1
    world = raycam.World()
    world.add_mesh(
        (np.stack(directions, axis=-1) * radius[..., None]).reshape(-1, 3),
        np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]),
        uvs=np.stack([u.ravel(), v.ravel()], axis=1),
        name="ball",
        material={"type": "unlit", "texture": raycam.Texture(ball_texture(), wrap="clamp")},
    )
    return world


def cameras_around(count: int = 6, **lens: Any) -> dict[str, raycam.Camera]:
    """Cameras around the ball, alternately above and below its equator.

    Their pixels are smaller than the texels.
    """
    turns = 2 * np.pi * np.arange(count) / count
    places = [[3 * np.cos(turn), 3 * np.sin(turn), (-1) ** i * 1.2] for i, turn in enumerate(turns.tolist())]
    return {
        f"{i}.png": raycam.Camera.look_at(place, [0, 0, 0], size=(240, 240), fov=50, **lens)
        for i, place in enumerate(places)
    }


def away_from_rims(seen: np.ndarray, margin: int = 2) -> np.ndarray:
    """Mask of seen texels that are more than `margin` texels away from unseen texels.

    Nearer to unseen texels, photographs also show the background.
    """
    inner = cv2.erode(np.pad(seen, 1).astype(np.uint8), np.ones((2 * margin + 1,) * 2, np.uint8))
    mask: np.ndarray = inner[1:-1, 1:-1] > 0
    return mask
