"""Random placement of objects at rest on surfaces, without collisions.

An object's bound is a vertical prism over the convex hull of its footprint, from its lowest to its highest point.
Objects whose prisms do not intersect do not collide; no object is placed inside another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product
from ..errors import WorldError, nearest
from ..world import World
from .draws import RandomStream, RejectedSample, rounded

__all__ = ["ConvexPrism", "PlacementSampler", "outline"]

AXES = {"z": [0, 1, 2], "y": [2, 0, 1]}
"""Order of the axes that puts the up axis last."""
LEVEL = 0.999
"""Cosine of the steepest slope on which objects are placed: 2.6 degrees."""
MAX_TRIES = 2000
FIRST_BATCH, MAX_BATCH = 8, 512
"""Number of tries that are checked together: small at first, because most objects find space immediately."""
MAX_HULL_TRIANGLES = 20_000
"""Largest surface whose convex hull is computed to find out whether an object fits at all."""
SLACK = 1e-6
"""Relative excess of an object's size over its surface that counts as rounding."""


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

    def turned(self, cos: float, sin: float, shift: npt.ArrayLike) -> ConvexPrism:
        """Returns the prism rotated about the up axis, then shifted by `shift` [3]."""
        x, y, z = np.asarray(shift, float)
        turn = np.array([[cos, sin], [-sin, cos]])
        return ConvexPrism(product(self.outline, turn) + np.array([x, y]), self.low + z, self.high + z)

    def intersects(self, other: ConvexPrism, gap: float) -> bool:
        """Returns True if the distance between the prisms is below `gap`.

        Method: separating axes (Ericson 2005, 5.2.1).
        """
        if self.low >= other.high + gap or other.low >= self.high + gap:
            return False
        axes = np.concatenate([_normals(self.outline), _normals(other.outline)])
        a, b = product(axes, self.outline.T), product(axes, other.outline.T)
        apart = np.maximum(b.min(axis=1) - a.max(axis=1), a.min(axis=1) - b.max(axis=1))
        return bool(apart.max() < max(gap, 1e-12))

    def intersects_triangles(self, corners: Floats) -> bool:
        """Returns True if any of the triangles [n, 3, 3] intersects the prism.

        Method: separating axes (Ericson 2005, 5.2.9).
        """
        box_low = np.append(self.outline.min(axis=0), self.low)
        box_high = np.append(self.outline.max(axis=0), self.high)
        near = ((corners.min(axis=1) < box_high) & (corners.max(axis=1) > box_low)).all(axis=1)
        corners = corners[near]
        if not len(corners):
            return False
        own = np.concatenate(
            [np.column_stack([self.outline, np.full(len(self.outline), z)]) for z in (self.low, self.high)]
        )
        side = np.column_stack([_normals(self.outline), np.zeros(len(self.outline))])
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
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered
    if (
        len(ordered) > 512
    ):  # points inside the polygon of the extremes along 16 directions are not on the hull
        ordered = _outer(ordered)

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
    # Integer directions give the same hull on every machine.
    ways = np.array(
        [[x, y] for x in (-2, -1, 0, 1, 2) for y in (-2, -1, 0, 1, 2) if max(abs(x), abs(y)) == 2], float
    )
    extremes = outline(points[np.unique(product(points, ways.T).argmax(axis=0))])
    sides, start = _normals(extremes), (_normals(extremes) * extremes).sum(axis=1)
    outside = (product(points, sides.T) >= start - 1e-12 * np.abs(points).max()).any(axis=1)
    found: Floats = points[outside]
    return found


def _normals(corners: Floats) -> Floats:
    """The outward unit normals [n, 2] of the edges of a convex outline."""
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.sqrt((edges**2).sum(axis=1, keepdims=True))
    return np.column_stack([edges[:, 1], -edges[:, 0]]) / np.where(lengths > 0.0, lengths, 1.0)


class PlacementSampler:
    """Samples poses of one object after another on the surfaces of a world, by rejection."""

    def __init__(self, world: World) -> None:
        # A copy, so that it does not contain objects that are added later; their prisms represent these objects.
        self._world = world = world.at(0.0)
        self._axes = AXES[world.up]
        self._names = [item.name for item in world.objects]
        self._ids = world.triangle_ids()[:, 0] if self._names else np.empty(0, np.int32)
        self._corners = world.triangles()[..., self._axes] if self._names else np.empty((0, 3, 3))
        self._taken: list[ConvexPrism] = []
        self._surface_of: list[str | None] = []
        self._hulls: dict[str | None, Floats] = {}

    def sample_pose(
        self, shape: ConvexPrism, surface: str | None, draw: RandomStream, gap: float, what: str
    ) -> Floats:
        """Samples the pose [4, 4] of an object with the bound `shape`, and reserves its space.

        The pose rotates the object about the up axis and places its lowest point on the object `surface` (default:
        any object), at least `gap` metres from all other objects. Raises `WorldError` if there is no space.
        """
        ground, areas, owners = self._ground(surface)
        if not len(ground):
            raise WorldError(
                f"{what}: {surface or 'the world'} has no upward-facing level surface to place objects on",
                code="nothing_visible",
            )
        tries = 0
        if not self._is_too_large(shape, surface, ground, gap):
            for first, last in _batches():
                tries = last
                drawn = [self._try(shape, ground, areas, draw.substream(n)) for n in range(first, last)]
                supported = self._supported([prism for prism, _ in drawn], owners)
                for (prism, pose), stands in zip(drawn, supported, strict=True):
                    if stands and self._free(prism, gap):
                        self._taken.append(prism)
                        self._surface_of.append(surface)
                        return self._world_axes(pose)
        size = np.ptp(shape.outline, axis=0)
        raise RejectedSample(
            f"{what}: no space found on {surface or 'the world'}{f' after {tries} tries' if tries else ''}: "
            "the object needs "
            f"{size[0]:.3g} x {size[1]:.3g} m, the level surface has {areas[-1] / 2:.3g} m² with "
            f"{len(self._taken)} objects on it; use fewer or smaller objects, a larger surface or a smaller gap"
        )

    def check_total_area(self, shapes: list[ConvexPrism], surface: str | None, what: str) -> None:
        """Raises `RejectedSample` if the objects' total area exceeds the area of the level surface.

        `what` names the first object. Without this check, many attempts would be spent on placing some of the objects.
        """
        ground, areas, _ = self._ground(surface)
        if not 0 < len(ground) <= MAX_HULL_TRIANGLES:
            return
        height = min(shape.high - shape.low for shape in shapes)
        total = sum(_area(shape.outline) for shape in shapes)
        if np.ptp(ground[..., 2]) <= 1e-6 * height and total > _area(self._hull(surface, ground)) * (
            1 + SLACK
        ):
            raise RejectedSample(
                f"{what}: no space for {len(shapes)} objects on {surface or 'the world'}: they need {total:.3g} m², "
                f"the level surface has {areas[-1] / 2:.3g} m²; use fewer or smaller objects, or a larger surface"
            )

    def _hull(self, surface: str | None, ground: Floats) -> Floats:
        """The convex outline of a surface's level triangles."""
        if surface not in self._hulls:
            self._hulls[surface] = outline(ground.reshape(-1, 3)[:, :2])
        return self._hulls[surface]

    def _is_too_large(self, shape: ConvexPrism, surface: str | None, ground: Floats, gap: float) -> bool:
        """Returns True if the base is too large for the ground, next to the existing objects.

        The base is too large if no position and rotation can put it inside the ground's convex hull, next to
        the objects that are already there. A convex outline inside another outline has no larger diameter,
        width or area.
        """
        if len(ground) > MAX_HULL_TRIANGLES:
            return False
        hull = self._hull(surface, ground)
        if any(
            measure(shape.outline) > measure(hull) * (1 + SLACK) for measure in (_diameter, _width, _area)
        ):
            return True
        if np.ptp(ground[..., 2]) > 1e-6 * (shape.high - shape.low):
            return False
        # The areas of all objects on a level surface must fit side by side into the surface's hull.
        others = [prism for prism, on in zip(self._taken, self._surface_of, strict=True) if on == surface]
        total = sum(_area(prism.outline) for prism in [*others, shape])
        return bool(others) and (total > _area(hull) * (1 + SLACK) or gap > _diameter(hull) * (1 + SLACK))

    def _ground(self, surface: str | None) -> tuple[Floats, Floats, npt.NDArray[np.int32]]:
        """Returns the level triangles [n, 3, 3], cumulative sums of areas, and the objects' ids.

        The sums are sums of twice the triangles' horizontal areas. The ids are those of the triangles'
        objects, each once.
        """
        if surface is not None and surface not in self._names:
            raise WorldError(nearest("object to stand on", surface, self._names), code="unknown_name")
        normals = np.cross(
            self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0]
        )
        level = normals[:, 2] > LEVEL * np.sqrt((normals**2).sum(axis=1))
        if surface is not None:
            level &= self._ids == self._names.index(surface)
        return self._corners[level], np.cumsum(normals[level, 2]), np.unique(self._ids[level])

    def _try(
        self, shape: ConvexPrism, ground: Floats, areas: Floats, draw: RandomStream
    ) -> tuple[ConvexPrism, Floats]:
        """A random position, uniform over the ground, and a random rotation about the up axis."""
        triangle = ground[min(int(np.searchsorted(areas, draw.uniform01(0) * areas[-1])), len(ground) - 1)]
        u, v = draw.uniform01(1), draw.uniform01(2)
        u, v = (u, v) if u + v <= 1.0 else (1.0 - u, 1.0 - v)
        point = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0])
        # A random direction without trigonometry: a point of the unit disk, normalised.
        for number in range(3, 200, 2):
            x, y = draw.uniform(-1, 1, number), draw.uniform(-1, 1, number + 1)
            length = np.sqrt(x * x + y * y)
            if 0.1 < length <= 1.0:
                break
        cos, sin = float(x / length), float(y / length)
        middle = (shape.outline.min(axis=0) + shape.outline.max(axis=0)) / 2
        turned = np.array([cos * middle[0] - sin * middle[1], sin * middle[0] + cos * middle[1]])
        shift = [rounded(float(value)) for value in (*(point[:2] - turned), point[2] - shape.low)]
        pose = np.eye(4)
        pose[:2, :2], pose[:3, 3] = [[cos, -sin], [sin, cos]], shift
        return shape.turned(cos, sin, shift), pose

    def _supported(self, prisms: list[ConvexPrism], owners: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
        """Returns True for prisms with ground directly below them, and nothing in between.

        The ground must be below the centre and all corners of the base.
        """
        counts = [len(prism.outline) + 1 for prism in prisms]
        starts = np.concatenate(
            [
                np.column_stack(
                    [np.vstack([prism.outline, prism.outline.mean(axis=0)]), np.full(count, prism.high)]
                )
                for prism, count in zip(prisms, counts, strict=True)
            ]
        )
        low = np.repeat([prism.low for prism in prisms], counts)
        size = np.repeat([prism.high - prism.low for prism in prisms], counts)
        origins = np.empty_like(starts)
        origins[:, self._axes] = starts + np.column_stack([np.zeros((len(starts), 2)), size * 1e-3 + 1e-9])
        down = np.zeros(3)
        down[self._axes[2]] = -1.0
        hits = self._world.cast_rays(origins, down)
        height = hits["position"][:, self._axes[2]]
        with np.errstate(invalid="ignore"):
            good = np.isin(hits["instance"], owners) & (np.abs(height - low) <= 1e-3 * size + 1e-9)
        outside = self._outside(origins)
        ends = np.cumsum(counts)[:-1]
        return np.array([part.all() for part in np.split(good & outside, ends)])

    def _outside(self, origins: Floats) -> npt.NDArray[np.bool_]:
        """Returns True for points that are not inside an object.

        For these points, the first surface above faces down, or there is no surface above.
        """
        up = np.zeros(3)
        up[self._axes[2]] = 1.0
        hits = self._world.cast_rays(origins, up)
        there = hits["instance"] >= 0
        first = np.searchsorted(self._ids, np.arange(len(self._names)))
        corners = self._corners[first[hits["instance"][there]] + hits["triangle"][there]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        found = np.ones(len(origins), dtype=bool)
        found[there] = normal[:, 2] <= 0.0
        return found

    def _free(self, prism: ConvexPrism, gap: float) -> bool:
        """True if all other objects are at least `gap` metres away from the prism."""
        if any(prism.intersects(other, gap) for other in self._taken):
            return False
        # The base is excluded: it touches the ground, and may overlap the ground slightly if the
        # ground is not exactly level.
        wide = ConvexPrism(
            _inflate(prism.outline, gap), prism.low + 2e-3 * (prism.high - prism.low), prism.high + gap
        )
        return not wide.intersects_triangles(self._corners)

    def _world_axes(self, pose: Floats) -> Floats:
        """Converts a transform from axes with up last to the world's axes."""
        order = np.eye(4)
        # The rotation from world axes to axes whose third axis points up.
        order[:3, :3] = np.eye(3)[self._axes]
        found: Any = product(product(order.T, pose), order)
        return np.asarray(found)


def _batches() -> Iterator[tuple[int, int]]:
    """The tries in batches: the number of the first try, and the number after the last try."""
    first, size = 0, FIRST_BATCH
    while first < MAX_TRIES:
        last = min(first + size, MAX_TRIES)
        yield first, last
        first, size = last, min(2 * size, MAX_BATCH)


def _diameter(corners: Floats) -> float:
    """The largest distance between two corners of an outline [n, 2]."""
    apart = corners[:, np.newaxis] - corners
    return float(np.sqrt((apart**2).sum(axis=2).max()))


def _width(corners: Floats) -> float:
    """The smallest distance between two parallel lines around a convex outline [n, 2]."""
    return float(np.ptp(product(_normals(corners), corners.T), axis=1).min())


def _area(corners: Floats) -> float:
    """The area of a convex outline [n, 2]."""
    x, y = (corners - corners[:1]).T
    return float(np.abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2)


def _inflate(corners: Floats, gap: float) -> Floats:
    """A convex outline with each edge moved outwards by `gap`, and bevelled corners."""
    normals = _normals(corners)
    return outline(
        np.concatenate([corners + normals * gap, np.roll(corners, -1, axis=0) + normals * gap, corners])
    )
