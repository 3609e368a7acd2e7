"""Vertical convex prisms that bound objects, and convex outlines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product

__all__ = ["AXES", "ConvexPrism", "outline"]

AXES = {"z": [0, 1, 2], "y": [2, 0, 1]}
"""Order of the axes that puts the up axis last."""
LARGE = 512
"""Number of points above which inner points are discarded before the hull is computed."""


@dataclass(frozen=True)
class ConvexPrism:
    """A vertical convex prism, in axes with the up axis last."""

    outline: Floats
    """The corners [n, 2] of the base, counter-clockwise, seen from above."""
    low: float
    """The height of the base."""
    high: float
    """The height of the top."""

    @classmethod
    def around(cls, corners: Floats, up: str) -> ConvexPrism:
        """Returns the smallest prism around triangles [n, 3, 3] of a world with the axis `up`."""
        points = corners.reshape(-1, 3)[:, AXES[up]]
        return cls(outline(points[:, :2]), float(points[:, 2].min()), float(points[:, 2].max()))

    @cached_property
    def normals(self) -> Floats:
        """The outward unit normals [n, 2] of the outline's edges."""
        return _normals(self.outline)

    @cached_property
    def center(self) -> Floats:
        """The mean [2] of the base's corners."""
        found: Floats = self.outline.mean(axis=0)
        return found

    @cached_property
    def middle(self) -> Floats:
        """The centre [2] of the base's bounding box."""
        found: Floats = (self.outline.min(axis=0) + self.outline.max(axis=0)) / 2
        return found

    @cached_property
    def area(self) -> float:
        """The area of the base."""
        return _area(self.outline)

    @cached_property
    def diameter(self) -> float:
        """The largest distance between two corners of the base."""
        return _diameter(self.outline)

    @cached_property
    def width(self) -> float:
        """The smallest distance between two parallel lines around the base."""
        return float(np.ptp(product(self.normals, self.outline.T), axis=1).min())

    def turned(self, cos: float, sin: float, shift: npt.ArrayLike) -> ConvexPrism:
        """Returns the prism rotated about the up axis (`cos`, `sin`), then shifted by `shift` [3]."""
        x, y, z = np.asarray(shift, float)
        turn = np.array([[cos, sin], [-sin, cos]])
        return ConvexPrism(product(self.outline, turn) + np.array([x, y]), self.low + z, self.high + z)

    def intersects(self, other: ConvexPrism, gap: float) -> bool:
        """Returns True if the distance between the prisms is below `gap`.

        Method: separating axes (Ericson 2005, 5.2.1).
        """
        if self.low >= other.high + gap or other.low >= self.high + gap:
            return False
        axes = np.concatenate([self.normals, other.normals])
        # In most cases, the axis closest to the line between the bases' centres is sufficient.
        aside = other.center - self.center
        likely = int(np.abs(product(axes, aside)).argmax())
        limit = max(gap, 1e-12)
        return all(self._gaps(other, some).max() < limit for some in (axes[likely : likely + 1], axes))

    def _gaps(self, other: ConvexPrism, axes: Floats) -> Floats:
        """The distances [n] between the bases' projections onto axes [n, 2]; negative for overlaps."""
        a, b = product(axes, self.outline.T), product(axes, other.outline.T)
        found: Floats = np.maximum(b.min(axis=1) - a.max(axis=1), a.min(axis=1) - b.max(axis=1))
        return found

    def grown(self, gap: float) -> ConvexPrism:
        """Returns the prism enlarged by `gap` at its sides, with bevelled corners, and at its top."""
        if gap == 0.0:
            return self
        # Each edge is moved outwards; the ends of neighbouring edges form the bevels. The corners are in the order of
        # the outline, so that no hull has to be computed.
        along = self.normals * gap
        moved = np.stack([self.outline + along, _following(self.outline) + along], axis=1)
        return ConvexPrism(moved.reshape(-1, 2), self.low, self.high + gap)

    def bounds(self) -> tuple[Floats, Floats]:
        """The lowest and the highest corner [3] of the bounding box."""
        return np.append(self.outline.min(axis=0), self.low), np.append(self.outline.max(axis=0), self.high)

    def intersects_triangles(self, corners: Floats) -> bool:
        """Returns True if any of the triangles [n, 3, 3] intersects the prism.

        Method: separating axes (Ericson 2005, 5.2.9).
        """
        box_low, box_high = self.bounds()
        near = ((corners.min(axis=1) < box_high) & (corners.max(axis=1) > box_low)).all(axis=1)
        corners = corners[near]
        if not len(corners):
            return False
        own = np.concatenate(
            [np.column_stack([self.outline, np.full(len(self.outline), z)]) for z in (self.low, self.high)]
        )
        side = np.column_stack([self.normals, np.zeros(len(self.outline))])
        along = np.column_stack([-side[:, 1], side[:, 0], side[:, 2]])
        edges = np.roll(corners, -1, axis=1) - corners
        axes = [np.broadcast_to(axis, (len(corners), 3)) for axis in [*side, np.array([0.0, 0.0, 1.0])]]
        axes.append(np.cross(edges[:, 0], edges[:, 1]))
        axes += [
            np.cross(edges[:, i], axis) for i in range(3) for axis in [*along, np.array([0.0, 0.0, 1.0])]
        ]
        together = np.ones(len(corners), dtype=bool)
        for axis in axes:
            ours = product(axis, own.T)
            theirs = (
                corners[..., 0] * axis[:, None, 0]
                + corners[..., 1] * axis[:, None, 1]
                + corners[..., 2] * axis[:, None, 2]
            )
            together &= (ours.min(axis=1) < theirs.max(axis=1)) & (theirs.min(axis=1) < ours.max(axis=1)) | (
                (axis**2).sum(axis=1) < 1e-30
            )
        return bool(together.any())


def outline(points: Floats) -> Floats:
    """Returns the convex hull [m, 2] of points [n, 2], counter-clockwise.

    Source: A. M. Andrew 1979.
    """
    if len(points) > LARGE:
        points = _outer(points)
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def chain(row: list[list[float]]) -> list[list[float]]:
        found: list[list[float]] = []
        for x, y in row:
            while len(found) > 1:
                (ax, ay), (bx, by) = found[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                found.pop()
            found.append([x, y])
        return found[:-1]

    row = ordered.tolist()
    hull: Floats = np.array(chain(row) + chain(row[::-1]))
    return hull


def _outer(points: Floats) -> Floats:
    """Returns the points on or outside a polygon; they include the corners of the convex hull.

    The polygon's corners are the extreme points along 16 directions.
    """
    # Integer directions give the same hull on every machine.
    directions = [(2.0, y) for y in (-2.0, -1.0, 0.0, 1.0, 2.0)] + [(x, 2.0) for x in (-1.0, 0.0, 1.0)]
    # One direction at a time: arrays of all points and directions would not fit into the processor's cache.
    x, y = np.ascontiguousarray(points.T)
    along = (x * a + y * b for a, b in directions)
    ends = [end for values in along for end in (values.argmin(), values.argmax())]
    extremes = outline(points[np.unique(ends)])
    limit = 1e-12 * max(np.abs(x).max(), np.abs(y).max())
    outside = np.zeros(len(points), dtype=bool)
    for (a, b), corner in zip(_normals(extremes), extremes, strict=True):
        outside |= x * a + y * b >= corner[0] * a + corner[1] * b - limit
    found: Floats = points[outside]
    return found


def _following(corners: Floats) -> Floats:
    """The corner [n, 2] after each corner of an outline."""
    return np.concatenate([corners[1:], corners[:1]])


def _normals(corners: Floats) -> Floats:
    """The outward unit normals [n, 2] of the edges of a convex outline."""
    edges = _following(corners) - corners
    lengths = np.sqrt((edges**2).sum(axis=1, keepdims=True))
    return np.column_stack([edges[:, 1], -edges[:, 0]]) / np.where(lengths > 0.0, lengths, 1.0)


def _diameter(corners: Floats) -> float:
    """The largest distance between two corners of an outline [n, 2]."""
    apart = corners[:, np.newaxis] - corners
    return float(np.sqrt((apart**2).sum(axis=2).max()))


def _area(corners: Floats) -> float:
    """The area of a convex outline [n, 2]."""
    x, y = (corners - corners[:1]).T
    return float(np.abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2)
