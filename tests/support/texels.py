"""Texels of image files as raycam reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import raycam


def albedo_of(path: Path, size: tuple[int, int]) -> tuple[npt.NDArray[np.float32], list[raycam.Notice]]:
    """The linear colours [height, width, 3] of an image's texels, and the notices.

    `size` is the number of columns and rows.
    """
    columns, rows = size
    table = {
        "plane": {"size": [2 * columns / rows, 2]},
        "texture": {"image": path.name, "filter": "nearest"},
    }
    world = raycam.World.from_dict({"object": table}, folder=path.parent)
    fov = np.degrees(2 * np.arctan(1e-3))
    camera = raycam.Camera.look_at([0, 0, 1e3], [0, 0, 0], up=[0, 1, 0], size=size, fov=fov)
    frame = raycam.render(world, camera, channels=["albedo"], samples=1)
    return frame["albedo"], world.notices


def linear_from_srgb(values: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """The linear values of sRGB values from 0 to 1 (IEC 61966-2-1)."""
    values = np.asarray(values, np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
