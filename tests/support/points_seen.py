"""Visible world points, spread over a camera's image."""

from __future__ import annotations

import numpy as np
import raycam


def points_seen(camera: raycam.Camera, count: int, seed: int) -> np.ndarray:
    """World points on the rays of random pixels inside and around the image."""
    rng = np.random.default_rng(seed)
    origins, directions = camera.rays(rng.uniform([-60, -60], [700, 540], (count, 2)))
    points = origins + rng.uniform(0.2, 50, (count, 1)) * directions
    return points[np.isfinite(points).all(axis=1)]
