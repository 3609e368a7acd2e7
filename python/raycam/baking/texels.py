"""Texels of a mesh: the face at each texel's centre.

The faces are found with exact edge signs in texture space.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats
from ..errors import Notice
from ..notices import warn
from ..one_line import counted

__all__ = ["Texels", "covered_texels", "find_texels", "warn_of_overlap"]

Ints = npt.NDArray[np.int64]

MAX_CANDIDATES = 1 << 20
"""Number of triangle-texel pairs processed at a time, about 200 MB."""
MAX_RELATIVE_ERROR = 1e-14
"""Maximum relative error of a float64 edge function; smaller values are recomputed with exact fractions."""


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels [n] whose centre is inside a face, row by row."""

    size: tuple[int, int]
    """(width, height) of the texture."""
    index: Ints
    """Row times width plus column, ascending."""
    face: npt.NDArray[np.int32]
    """The face at the texel's centre; on an edge, the face with the lowest number."""
    corners: Floats
    """The corners of all faces [f, 3, 2] in texels, where whole numbers are texel centres."""
    overlapping: int
    """The number of texels whose centre is inside several faces, because islands overlap."""

    def weights(self, part: slice | Ints = slice(None)) -> Floats:
        """Barycentric weights [n, 3] of the faces' corners for the given texels."""
        return _weights(self.corners[self.face[part]], self.index[part], self.size[0])


def find_texels(uvs: npt.NDArray[np.float32], size: tuple[int, int]) -> Texels:
    """Finds the texels of faces in a texture of `size`.

    The faces have texture coordinates `uvs` [f, 3, 2] (v down). A texel's centre is at (column + 1/2,
    row + 1/2) / size. Centres outside 0..1 are ignored.
    """
    width, height = size
    corners = np.asarray(uvs, np.float64) * [width, height] - 0.5
    owner = np.full(width * height, -1, np.int32)
    strict = np.zeros(width * height, np.uint8)
    for face, x, y in _candidates(corners, size):
        signs = edge_signs(corners[face], x, y)
        inside = (signs >= 0).all(axis=1) | (signs <= 0).all(axis=1)
        inside &= signs.any(axis=1)
        place, face, signs = (y * width + x)[inside], face[inside], signs[inside]
        np.add.at(strict, place[(signs != 0).all(axis=1)], 1)
        # Faces are assigned in descending order, so that the face with the lowest number remains.
        order = np.argsort(-face, kind="stable")
        place, face = place[order], face[order]
        known = owner[place]
        owner[place] = np.where((known >= 0) & (known < face), known, face)
    index = np.flatnonzero(owner >= 0)
    return Texels(size, index, owner[index], corners, int((strict > 1).sum()))


def _candidates(corners: Floats, size: tuple[int, int]) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Iterates over faces and the texels of their bounding boxes, in bounded pieces.

    Each piece consists of faces, columns and rows.
    """
    low = np.clip(np.ceil(corners.min(axis=1)), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1)), -1, np.array(size) - 1).astype(np.int64)
    extent = np.maximum(high - low + 1, 0)
    faces = np.flatnonzero(extent.all(axis=1))
    # Each piece contains some rows of the faces' bounding boxes.
    rows = extent[faces, 1]
    start = 0
    while start < len(faces):
        total = np.cumsum(
            rows[start : start + MAX_CANDIDATES] * extent[faces[start : start + MAX_CANDIDATES], 0]
        )
        some = faces[start : start + max(1, int(np.searchsorted(total, MAX_CANDIDATES, side="right")))]
        start += len(some)
        tall = np.repeat(some, extent[some, 1])
        y = low[tall, 1] + _count_up(extent[some, 1])
        for first in range(0, len(tall), max(1, MAX_CANDIDATES // max(1, int(extent[some, 0].max())))):
            piece = slice(first, first + max(1, MAX_CANDIDATES // max(1, int(extent[some, 0].max()))))
            widths = extent[tall[piece], 0]
            face = np.repeat(tall[piece], widths)
            yield face, low[face, 0] + _count_up(widths), np.repeat(y[piece], widths)


def _count_up(lengths: Ints) -> Ints:
    """Returns the numbers 0 to n - 1 for each of the lengths n, concatenated."""
    ends = np.cumsum(lengths)
    found: Ints = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - lengths, lengths)
    return found


def edge_signs(corners: Floats, x: Ints, y: Ints) -> npt.NDArray[np.int8]:
    """Returns the exact signs [n, 3] of triangles' edge functions at points (x, y).

    The triangles are `corners` [n, 3, 2].
    """
    signs = np.empty((len(corners), 3), np.int8)
    point = np.stack([x, y], axis=1).astype(np.float64)
    for i in range(3):
        a, b = corners[:, i], corners[:, (i + 1) % 3]
        left = (b[:, 0] - a[:, 0]) * (point[:, 1] - a[:, 1])
        right = (b[:, 1] - a[:, 1]) * (point[:, 0] - a[:, 0])
        value = left - right
        signs[:, i] = np.sign(value)
        unsure = np.flatnonzero(np.abs(value) <= MAX_RELATIVE_ERROR * (np.abs(left) + np.abs(right)))
        for k in unsure:
            ax, ay, bx, by = (Fraction(float(v)) for v in (*a[k], *b[k]))
            exact = (bx - ax) * (int(y[k]) - ay) - (by - ay) * (int(x[k]) - ax)
            signs[k, i] = (exact > 0) - (exact < 0)
    return signs


def _weights(corners: Floats, index: Ints, width: int) -> Floats:
    """The barycentric weights [n, 3] of texel centres in triangles [n, 3, 2]."""
    point = np.stack([index % width, index // width], axis=1).astype(np.float64)
    a, b, c = (corners[:, i] - point for i in range(3))

    def cross(p: Floats, q: Floats) -> Floats:
        found: Floats = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        return found

    raw = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)
    total = raw.sum(axis=1, keepdims=True)
    weights = np.clip(raw / total, 0.0, 1.0)
    found: Floats = weights / weights.sum(axis=1, keepdims=True)
    return found


def covered_texels(texels: Texels) -> Bools:
    """Returns True [h, w] for texels whose centre is in a face."""
    covered = np.zeros(texels.size[0] * texels.size[1], bool)
    covered[texels.index] = True
    return covered.reshape(texels.size[1], texels.size[0])


def warn_of_overlap(texels: Texels, name: object) -> None:
    """Warns if islands of an object's texture coordinates overlap."""
    if texels.overlapping:
        warn(
            Notice(
                f"object {name!r}: several faces share {counted(texels.overlapping, 'texel')}, because islands of its "
                "texture coordinates overlap; the first face determines a shared texel's value",
                "overlapping_islands",
            )
        )
