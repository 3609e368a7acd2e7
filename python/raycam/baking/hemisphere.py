"""Cosine-weighted directions around normals, the same for every call."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

__all__ = ["hemisphere_directions"]


def hemisphere_directions(
    normals: Floats, keys: npt.NDArray[np.int64], sample: int, samples: int, cone: float = np.pi
) -> Floats:
    """Returns unit direction number `sample` of `samples` for each normal, [n, 3].

    The density of the directions is proportional to the cosine. The directions are in a cone with the opening angle
    `cone` in radians; for pi, the cone is the hemisphere and the density is cosine / pi.

    A Hammersley set is shifted by a hash of `keys` [n] (Cranley and Patterson 1976) and mapped by Malley's method.
    """
    mixed = (keys.astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    mixed ^= mixed >> np.uint64(29)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed ^= mixed >> np.uint64(32)
    shift_u = (mixed >> np.uint64(40)).astype(np.float64) / (1 << 24)
    shift_v = (mixed & np.uint64(0xFFFFFF)).astype(np.float64) / (1 << 24)
    u = ((sample + 0.5) / samples + shift_u) % 1.0 * np.sin(cone / 2) ** 2
    v = (int(f"{sample:032b}"[::-1], 2) / 2.0**32 + shift_v) % 1.0
    radius, angle = np.sqrt(u), 2 * np.pi * v
    x, y, z = radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u)
    nx, ny, nz = normals.T
    sign = np.where(nz >= 0, 1.0, -1.0)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    first = np.stack([1 + sign * nx * nx * a, sign * b, -sign * nx], axis=1)
    second = np.stack([b, sign + ny * ny * a, -ny], axis=1)
    found: Floats = x[:, None] * first + y[:, None] * second + z[:, None] * normals
    return found
