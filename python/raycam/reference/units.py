"""Rescaling of worlds to a size of about 1 around the origin."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Units:
    """Local units of length: world = origin + scale * local.

    P⁺ mixes lengths with the number 1, so digits are lost in a world that is tiny, huge, or far from its
    origin. Worlds of ordinary size keep their own units.
    """

    origin: Floats
    scale: float

    @staticmethod
    def for_world(points: Floats, C: Floats) -> Units:
        """The units for a world with points [n, 3] and a camera at C [3]."""
        low, high = (
            np.minimum(points.min(axis=0, initial=np.inf), C),
            np.maximum(points.max(axis=0, initial=-np.inf), C),
        )
        center, extent = (low + high) / 2, float(np.max(high - low) / 2)
        origin = center if 0 < 16 * extent < np.abs(center).max() else np.zeros(3)
        reach = float(np.linalg.norm(C - origin))
        # P contains only the camera, so only the camera's distance can be too large. Scaling by powers of two is exact.
        unit = reach if reach > 64 else extent if 0 < extent < 1 / 64 else 1.0
        return Units(origin, math.ldexp(1.0, round(math.log2(unit))))

    @property
    def are_ordinary(self) -> bool:
        """True if these are the world's own units."""
        return self.scale == 1 and not self.origin.any()

    def points(self, points: Floats) -> Floats:
        """World points [..., 3] in these units."""
        return np.asarray((points - self.origin) / self.scale)

    def camera(self, P: Floats) -> Floats:
        """The camera matrix [3, 4] that maps points in these units to the same pixels."""
        return np.column_stack([P[:, :3] * self.scale, P[:, :3] @ self.origin + P[:, 3]])
