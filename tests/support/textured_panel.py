"""A textured panel, rendered from cameras around it."""

from __future__ import annotations

from typing import Any

import numpy as np
import raycam


def pattern(size: int = 64) -> np.ndarray:
    """A smooth sRGB pattern that every lens resolves."""
    x, y = np.meshgrid(np.arange(size) / size, np.arange(size) / size)
    waves = np.stack([np.sin(6 * x + 2 * y), np.cos(5 * y - x), np.sin(4 * x * y + 1)], axis=2)
    return np.rint(128 + 90 * waves).astype(np.uint8)


def noise(size: int = 256, seed: int = 1) -> np.ndarray:
    """An sRGB texture with details of all sizes from two texels upwards."""
    random = np.random.default_rng(seed)
    total = np.zeros((size, size, 3))
    cells = 4
    while cells <= size // 2:
        coarse = random.normal(size=(cells, cells, 3))
        total += np.repeat(np.repeat(coarse, size // cells, axis=0), size // cells, axis=1)
        cells *= 2
    return np.clip(128 + 22 * total, 20, 235).astype(np.uint8)


def panel(texture: np.ndarray | None = None, up: str = "z", cells: int = 1) -> raycam.World:
    """A square from -1 to 1 that faces up, of `cells` x `cells` squares; u is x and v is -y."""
    world = raycam.World(up)
    side = np.linspace(0, 1, cells + 1)
    u, v = (each.ravel() for each in np.meshgrid(side, side))
    corner = np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)
    a, b, c, d = corner, corner + cells + 1, corner + cells + 2, corner + 1
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=-2).reshape(-1, 3)
    world.add_mesh(
        np.stack([2 * u - 1, 1 - 2 * v, 0 * u], axis=1),
        faces,
        uvs=np.stack([u, v], axis=1),
        name="panel",
        material={
            "type": "unlit",
            "texture": raycam.Texture(pattern() if texture is None else texture, wrap="clamp"),
        },
    )
    return world


def shots(
    world: raycam.World, places: list, size: tuple[int, int] = (400, 400), samples: int = 16, **lens: Any
) -> tuple[dict[str, raycam.Camera], dict[str, np.ndarray]]:
    """Cameras that look at the panel's centre, and their photographs."""
    cameras = {
        f"{i:02d}.png": raycam.Camera.look_at(place, [0, 0, 0], up=[0, 1, 0], fov=60, size=size, **lens)
        for i, place in enumerate(places)
    }
    return cameras, {
        name: raycam.render(world, camera, samples=samples).to_srgb8() for name, camera in cameras.items()
    }


def ring_of_places(count: int, radius: float = 0.7, height: float = 2.4) -> list[list[float]]:
    """Camera positions above the panel."""
    angles = np.arange(count) * 2 * np.pi / count + 0.3
    return [[radius * np.cos(a), radius * np.sin(a), height] for a in angles.tolist()]


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """The peak signal-to-noise ratio of uint8 images in decibels."""
    return float(10 * np.log10(255**2 / ((a.astype(float) - b) ** 2).mean()))


def inner(texture: np.ndarray, margin: int = 3) -> np.ndarray:
    """The texels away from the panel's edge.

    Pixels at the edge mix the panel with the background.
    """
    return texture[margin:-margin, margin:-margin]
