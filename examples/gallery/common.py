"""Functions and classes that the scripts of the gallery share.

They place models on the ground, compute noise textures, and render the final images.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import raycam

Picture = np.ndarray  # [height, width, 3] sRGB bytes


@dataclass(frozen=True)
class Quality:
    """Size and noise of the images.

    `scale` multiplies the images' sides, and `effort` the number of samples per pixel.
    """

    scale: float = 1.0
    effort: float = 1.0
    denoise: bool = True

    def camera(self, camera: raycam.Camera) -> raycam.Camera:
        """Returns the camera with the image size multiplied by `scale`."""
        width, height = camera.size
        return camera.resized((round(width * self.scale), round(height * self.scale)))

    def frame(
        self, world: raycam.World, camera: raycam.Camera, samples: int = 64, **options: Any
    ) -> raycam.Frame:
        """Returns a path-traced frame with the view transform AgX."""
        options = {"integrator": "path", "max_depth": 8, "clamp": 20, "view": "agx"} | options
        samples = max(1, round(samples * self.effort))
        return raycam.render(world, self.camera(camera), samples=samples, denoise=self.denoise, **options)

    def shot(self, world: raycam.World, camera: raycam.Camera, samples: int = 64, **options: Any) -> Picture:
        """Renders a frame and returns its image as sRGB bytes [h, w, 3]."""
        return self.frame(world, camera, samples, channels=["color"], **options).to_srgb8()


def stand(
    world: raycam.World,
    file: Path,
    height: float,
    location: tuple[float, float, float] = (0, 0, 0),
    **keys: Any,
) -> int:
    """Adds a model whose lowest point is at `location`, and returns the object's id.

    After its rotation, the model is `height` metres high.
    """
    turn = {key: keys.pop(key) for key in ("roll", "pitch", "yaw") if key in keys}
    trial = raycam.World()
    trial.add_object(mesh=file, **turn)
    low, high = trial.bounds
    scale = height / (high[2] - low[2])
    base = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return world.add_object(
        mesh=file, scale=scale, location=(np.array(location) - scale * base).tolist(), **turn, **keys
    )


def ribbon(count: int) -> np.ndarray:
    """Returns the faces between two rows of `count` + 1 vertices each.

    The vertices of the second row follow those of the first.
    """
    first = np.arange(count)[:, None]
    sides = np.array([[0, 1, count + 2], [0, count + 2, count + 1]])
    return np.concatenate([first + side for side in sides])


def fractal(shape: tuple[int, int], power: float = 1.8, stretch: float = 1.0, seed: int = 0) -> np.ndarray:
    """Returns periodic noise between 0 and 1, float64 [h, w].

    A larger `power` makes the noise smoother, `stretch` makes it wider.
    """
    rows, columns = np.fft.fftfreq(shape[0]) * shape[0], np.fft.fftfreq(shape[1]) * shape[1] * stretch
    radius = np.hypot(rows[:, None], columns[None])
    radius[0, 0] = np.inf
    waves = np.fft.fft2(np.random.default_rng(seed).normal(size=shape)) / radius**power
    noise = np.fft.ifft2(waves).real
    low, high = np.percentile(noise, (1, 99))
    return np.clip((noise - low) / (high - low), 0, 1)


def mix(low: str, high: str, amount: np.ndarray) -> np.ndarray:
    """Returns sRGB bytes [h, w, 3] between the colours `low` and `high` ("#rrggbb").

    `amount` [h, w] is 0 for `low` and 1 for `high`.
    """
    ends = [np.array(list(bytes.fromhex(color[1:])), float) for color in (low, high)]
    return (ends[0] + amount[..., None] * (ends[1] - ends[0])).round().astype(np.uint8)


def planks(size: int = 1024, boards: int = 6, seed: int = 1) -> np.ndarray:
    """Returns the texture of a wooden floor or table, sRGB bytes [size, size, 3].

    The boards run along the rows.
    """
    grain = fractal((size, size), 1.1, 14, seed)
    board = np.arange(size) * boards // size
    tone = np.random.default_rng(seed).uniform(-0.18, 0.18, boards)[board][:, None]
    seam = np.minimum(np.arange(size) * boards % size, size - np.arange(size) * boards % size)
    dark = np.clip(seam / (0.012 * size), 0.25, 1)[:, None, None]
    return (mix("#3b2213", "#8a5a34", np.clip(grain + tone, 0, 1)) * dark).round().astype(np.uint8)


def softbox(
    world: raycam.World,
    position: tuple[float, float, float],
    target: tuple[float, float, float],
    size: tuple[float, float],
    radiance: float | list[float],
    **keys: Any,
) -> None:
    """Adds an area light that is not visible to cameras."""
    world.add_light(
        "area",
        position=position,
        target=target,
        size=size,
        radiance=radiance,
        visible={"camera": False},
        **keys,
    )
