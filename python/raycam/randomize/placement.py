"""Random placement of objects at rest on surfaces, without collisions.

An object's bound is a vertical prism over the convex hull of its footprint, from its lowest to its highest point.
Objects whose prisms do not intersect do not collide; no object is placed inside another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product
from ..errors import WorldError
from ..one_line import counted
from .convex_prism import ConvexPrism
from .draws import RandomStream, RejectedSample, rounded
from .surroundings import Ground, Surroundings

__all__ = ["PlacementSampler"]

MAX_TRIES = 2000
FIRST_BATCH, MAX_BATCH = 1, 512
"""Smallest and largest number of tries that are checked together.

The first batch has one try, because most objects find space immediately.
"""
MAX_HULL_TRIANGLES = 20_000
"""Largest surface whose convex hull is computed to find out whether an object fits at all."""
SLACK = 1e-6
"""Relative excess of an object's size over its surface that counts as rounding."""


class Placement(NamedTuple):
    """A random pose of an object, before the collisions with other placed objects are checked."""

    prism: ConvexPrism
    """The object's bound in this pose."""
    pose: Floats
    """The pose [4, 4], with the up axis last."""
    supported: bool
    """True if the base is on the ground."""


class PlacementSampler:
    """Samples poses of one object after another on the surfaces of a world, by rejection."""

    def __init__(self, surroundings: Surroundings) -> None:
        self._around = surroundings
        self._axes = surroundings.axes
        self._taken: list[ConvexPrism] = []
        self._areas: dict[str | None, float] = {}

    def sample_first_tries(
        self, requests: Sequence[tuple[ConvexPrism, str | None, RandomStream]]
    ) -> list[Placement | None]:
        """Returns the first try of `sample_pose` for each object.

        The result is None for objects that are larger than their surface, or whose surface has no level part.

        The objects (bound, surface, random stream) are checked together, because most objects find space at the first
        try, and one query of many rays is faster than many queries.
        """
        found: list[Placement | None] = [None] * len(requests)
        by_surface: dict[str | None, list[int]] = {}
        for number, (_, surface, _) in enumerate(requests):
            by_surface.setdefault(surface, []).append(number)
        for surface, members in by_surface.items():
            ground = self._around.ground(surface)
            if not len(ground.triangles):
                continue
            members = [n for n in members if not self._exceeds(requests[n][0], ground)]
            drawn = [self._try(requests[n][0], ground, requests[n][2].substream(0)) for n in members]
            for n, placement in zip(members, self._placements(drawn, ground), strict=True):
                found[n] = placement
        return found

    def sample_pose(
        self,
        shape: ConvexPrism,
        surface: str | None,
        draw: RandomStream,
        gap: float,
        what: str,
        first_try: Placement | None = None,
    ) -> Floats:
        """Samples the pose [4, 4] of an object with the bound `shape`, and reserves its space.

        The pose rotates the object about the up axis and places its lowest point on the object `surface` (default:
        any object), at least `gap` metres from all other objects. `first_try` is the object's result of
        `sample_first_tries`, if it is known. Raises `WorldError` if the surface has no level part, and
        `RejectedSample` if no space is found.
        """
        ground = self._around.ground(surface)
        if not len(ground.triangles):
            raise WorldError(
                f"{what}: {surface or 'the world'} has no upward-facing level surface to place objects on",
                code="nothing_visible",
            )
        tries = 0
        if not self._is_too_large(shape, surface, gap):
            for first, last in _batches():
                tries = last
                known = [first_try] if first_try is not None and first == 0 else []
                numbers = range(first + len(known), last)
                drawn = [self._try(shape, ground, draw.substream(n)) for n in numbers]
                for prism, pose, supported in [*known, *self._placements(drawn, ground)]:
                    if supported and self._free(prism, gap):
                        self._reserve(prism, surface)
                        return self._world_axes(pose)
        size = np.ptp(shape.outline, axis=0)
        raise RejectedSample(
            f"{what}: no space found on {surface or 'the world'}{f' after {tries} tries' if tries else ''}: "
            "the object needs "
            f"{size[0]:.3g} x {size[1]:.3g} m, the level surface has {ground.areas[-1] / 2:.3g} m², and "
            f"{counted(len(self._taken), 'placed object')} may take a part of it; "
            "use fewer or smaller objects, a larger surface or a smaller gap"
        )

    def check_total_area(self, shapes: list[ConvexPrism], surface: str | None, what: str) -> None:
        """Raises `RejectedSample` if the objects' total area exceeds the area of the level surface.

        `what` names the first object. Without this check, many attempts would be spent on placing some of the objects.
        """
        ground = self._around.ground(surface)
        if not 0 < len(ground.triangles) <= MAX_HULL_TRIANGLES:
            return
        height = min(shape.high - shape.low for shape in shapes)
        total = sum(shape.area for shape in shapes)
        if ground.relief <= 1e-6 * height and total > ground.hull.area * (1 + SLACK):
            raise RejectedSample(
                f"{what}: no space for {len(shapes)} objects on {surface or 'the world'}: they need {total:.3g} m², "
                f"the level surface has {ground.areas[-1] / 2:.3g} m²; use fewer or smaller objects, or a larger "
                "surface"
            )

    def _is_too_large(self, shape: ConvexPrism, surface: str | None, gap: float) -> bool:
        """Returns True if the base is too large for the ground, next to the existing objects.

        The base is too large if no position and rotation can put it inside the ground's convex hull, next to
        the objects that are already there. A convex outline inside another outline has no larger diameter,
        width or area.
        """
        ground = self._around.ground(surface)
        if self._exceeds(shape, ground):
            return True
        if len(ground.triangles) > MAX_HULL_TRIANGLES:
            return False
        hull = ground.hull
        if ground.relief > 1e-6 * (shape.high - shape.low):
            return False
        # The areas of all objects on a level surface must fit side by side into the surface's hull.
        total = self._areas.get(surface, 0.0) + shape.area
        return surface in self._areas and (
            total > hull.area * (1 + SLACK) or gap > hull.diameter * (1 + SLACK)
        )

    def _reserve(self, prism: ConvexPrism, surface: str | None) -> None:
        """Reserves the space of an object on a surface."""
        self._taken.append(prism)
        self._areas[surface] = self._areas.get(surface, 0.0) + prism.area

    def _exceeds(self, shape: ConvexPrism, ground: Ground) -> bool:
        """Returns True if the base is larger than the ground's convex hull."""
        if len(ground.triangles) > MAX_HULL_TRIANGLES:
            return False
        hull = ground.hull
        sizes = (
            (shape.diameter, hull.diameter),
            (shape.width, hull.width),
            (shape.area, hull.area),
        )
        return any(own > limit * (1 + SLACK) for own, limit in sizes)

    def _try(self, shape: ConvexPrism, ground: Ground, draw: RandomStream) -> tuple[ConvexPrism, Floats]:
        """A random position, uniform over the ground, and a random rotation about the up axis."""
        areas = ground.areas
        number = int(np.searchsorted(areas, draw.uniform01(0) * areas[-1]))
        triangle = ground.triangles[min(number, len(areas) - 1)]
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
        middle = shape.middle
        turned = np.array([cos * middle[0] - sin * middle[1], sin * middle[0] + cos * middle[1]])
        shift = [rounded(float(value)) for value in (*(point[:2] - turned), point[2] - shape.low)]
        pose = np.eye(4)
        pose[:2, :2], pose[:3, 3] = [[cos, -sin], [sin, cos]], shift
        return shape.turned(cos, sin, shift), pose

    def _placements(self, drawn: Sequence[tuple[ConvexPrism, Floats]], ground: Ground) -> list[Placement]:
        """Checks which of the drawn poses have ground below them."""
        if not drawn:
            return []
        supported = self._supported([prism for prism, _ in drawn], ground.owners)
        return [Placement(*one, bool(stands)) for one, stands in zip(drawn, supported, strict=True)]

    def _supported(self, prisms: list[ConvexPrism], owners: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
        """Returns True for prisms with ground directly below them, and nothing in between.

        The ground must be below the centre and all corners of the base.
        """
        counts = [len(prism.outline) + 1 for prism in prisms]
        starts = np.concatenate(
            [
                np.column_stack([np.vstack([prism.outline, prism.center]), np.full(count, prism.high)])
                for prism, count in zip(prisms, counts, strict=True)
            ]
        )
        low = np.repeat([prism.low for prism in prisms], counts)
        size = np.repeat([prism.high - prism.low for prism in prisms], counts)
        origins = np.empty_like(starts)
        origins[:, self._axes] = starts + np.column_stack([np.zeros((len(starts), 2)), size * 1e-3 + 1e-9])
        down = np.zeros(3)
        down[self._axes[2]] = -1.0
        hits = self._around.world.cast_rays(origins, down, fields=("instance", "position"))
        height = hits["position"][:, self._axes[2]]
        with np.errstate(invalid="ignore"):
            on_ground = (
                hits["instance"] == owners[0] if len(owners) == 1 else np.isin(hits["instance"], owners)
            )
            good = on_ground & (np.abs(height - low) <= 1e-3 * size + 1e-9)
        outside = self._outside(origins)
        ends = np.cumsum(counts)[:-1]
        return np.array([part.all() for part in np.split(good & outside, ends)])

    def _outside(self, origins: Floats) -> npt.NDArray[np.bool_]:
        """Returns True for points that are not inside an object.

        For these points, the first surface above faces down, or there is no surface above.
        """
        up = np.zeros(3)
        up[self._axes[2]] = 1.0
        hits = self._around.world.cast_rays(origins, up, fields=("instance", "triangle"))
        there = hits["instance"] >= 0
        found = np.ones(len(origins), dtype=bool)
        if not there.any():
            return found
        first = self._around.first_triangles
        corners = self._around.corners[first[hits["instance"][there]] + hits["triangle"][there]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        found[there] = normal[:, 2] <= 0.0
        return found

    def _free(self, prism: ConvexPrism, gap: float) -> bool:
        """True if all other objects are at least `gap` metres away from the prism."""
        if any(prism.intersects(other, gap) for other in self._taken):
            return False
        # The base is excluded: it touches the ground, and may overlap the ground slightly if the
        # ground is not exactly level.
        body = ConvexPrism(prism.outline, prism.low + 2e-3 * (prism.high - prism.low), prism.high)
        low, high = body.bounds()
        margin = gap * (1 + 1e-9)
        near = self._around.near(low - margin, high + margin)
        return not len(near) or not body.grown(gap).intersects_triangles(near)

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
