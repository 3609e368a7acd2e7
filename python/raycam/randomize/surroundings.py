"""The fixed objects among which a recipe places other objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..errors import WorldError, nearest
from ..world import World
from .convex_prism import AXES, ConvexPrism, outline

__all__ = ["Ground", "Surroundings"]

LEVEL = 0.999
"""Cosine of the steepest slope on which objects are placed: 2.6 degrees."""


@dataclass(frozen=True)
class Ground:
    """The level triangles of one object or of all objects."""

    triangles: Floats
    """The level triangles [n, 3, 3], with the up axis last."""
    areas: Floats
    """Cumulative sums [n] of twice the triangles' horizontal areas."""
    owners: npt.NDArray[np.int32]
    """The ids of the objects to which the triangles belong, without repetition."""

    @cached_property
    def relief(self) -> float:
        """The height difference between the highest and the lowest point."""
        return float(np.ptp(self.triangles[..., 2]))

    @cached_property
    def hull(self) -> ConvexPrism:
        """The convex outline, as a prism without height."""
        return ConvexPrism(outline(self.triangles.reshape(-1, 3)[:, :2]), 0.0, 0.0)


class Surroundings:
    """The triangles and level surfaces of a world; all coordinates have the up axis last."""

    def __init__(self, world: World) -> None:
        # A copy, so that it does not contain objects that are added later.
        self.world = world = world.at(0.0)
        """The world at time 0."""
        self.axes = AXES[world.up]
        """The order of the world's axes."""
        self.names = [item.name for item in world.objects]
        """The names of the objects."""
        ids = world.triangle_ids()[:, 0] if self.names else np.empty(0, np.int32)
        self.ids: npt.NDArray[np.int32] = ids
        """The id of the object to which each triangle belongs [n]."""
        self.corners: Floats = world.triangles()[..., self.axes] if self.names else np.empty((0, 3, 3))
        """The triangles [n, 3, 3]."""
        self.first_triangles = np.searchsorted(ids, np.arange(len(self.names)))
        """The index of each object's first triangle."""
        self._boxes = self.corners.min(axis=1), self.corners.max(axis=1)
        self._grounds: dict[str | None, Ground] = {}

    def near(self, low: Floats, high: Floats) -> Floats:
        """Returns the triangles [m, 3, 3] whose bounding boxes intersect a box.

        The box extends from `low` [3] to `high` [3].
        """
        lows, highs = self._boxes
        found: Floats = self.corners[((lows < high) & (highs > low)).all(axis=1)]
        return found

    def ground(self, surface: str | None) -> Ground:
        """Returns the level triangles of an object, by name, or of all objects.

        Raises `WorldError` for an unknown name.
        """
        if surface not in self._grounds:
            if surface is not None and surface not in self.names:
                raise WorldError(nearest("supporting object", surface, self.names), code="unknown_name")
            level = self._upward[:, 2] > LEVEL * np.sqrt((self._upward**2).sum(axis=1))
            if surface is not None:
                level &= self.ids == self.names.index(surface)
            self._grounds[surface] = Ground(
                self.corners[level], np.cumsum(self._upward[level, 2]), np.unique(self.ids[level])
            )
        return self._grounds[surface]

    @cached_property
    def _upward(self) -> Floats:
        """The triangles' normals [n, 3]; their lengths are twice the triangles' areas."""
        corners = self.corners
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
