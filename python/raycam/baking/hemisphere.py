"""Cosine-weighted directions around normals, the same for every call and on every processor."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import cos, sin

__all__ = ["Hemispheres"]


class Hemispheres:
    """`samples` directions around each of the unit normals [n, 3].

    The density of the directions is proportional to the cosine. The directions are in a cone with the opening angle
    `cone` in radians; for pi, the cone is the hemisphere and the density is cosine / pi.

    A Hammersley set is shifted by a hash of `keys` [n] (Cranley and Patterson 1976) and mapped by Malley's method.
    """

    def __init__(
        self, normals: Floats, keys: npt.NDArray[np.int64], samples: int, cone: float = np.pi
    ) -> None:
        mixed = (keys.astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
        mixed *= np.uint64(0xBF58476D1CE4E5B9)
        mixed ^= mixed >> np.uint64(32)
        self._shift = (mixed >> np.uint64(40)).astype(np.float64) / (1 << 24)
        turn = 2 * np.pi * ((mixed & np.uint64(0xFFFFFF)).astype(np.float64) / (1 << 24))
        self._spread = float(sin(cone / 2)) ** 2
        self._normals = np.ascontiguousarray(normals.T)
        nx, ny, nz = self._normals
        sign = np.where(nz >= 0, 1.0, -1.0)
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        first = np.stack([1 + sign * nx * nx * a, sign * b, -sign * nx])
        second = np.stack([b, sign + ny * ny * a, -ny])
        numbers = np.arange(samples)
        self._heights = (numbers + 0.5) / samples
        angles = 2 * np.pi * np.array([int(f"{number:032b}"[::-1], 2) / 2.0**32 for number in numbers])
        self._cosines, self._sines = cos(angles), sin(angles)
        # The tangents are turned by the shift here, so that no trigonometric function is needed for each direction.
        c, s = cos(turn), sin(turn)
        self._first, self._second = c * first + s * second, c * second - s * first

    def directions(self, part: slice) -> Floats:
        """Returns the directions around each normal of a part, [k, samples, 3]."""
        u = self._heights + self._shift[part, None]
        u -= u >= 1.0
        u *= self._spread
        radius, z = np.sqrt(u), np.sqrt(1 - u)
        x, y = radius * self._cosines, radius * self._sines
        found = np.empty((*u.shape, 3))
        for axis in range(3):
            first, second, normal = (
                rows[axis, part, None] for rows in (self._first, self._second, self._normals)
            )
            found[..., axis] = x * first + y * second + z * normal
        return found
