"""Queries of points and point pairs: closest points, distances, inside tests, visibility."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, limits, one_of, paired, real, rows_of, thread_count, triples
from ..io.fork_guard import no_fork
from ..one_line import one_line
from .chosen import Chosen, object_mask, object_number
from .ray_queries import Surface

__all__ = ["PointQueries", "Topology"]

PAIRS_PER_BLOCK = 1 << 20
"""Number of point pairs converted at a time, so that broadcast points need little memory."""


@one_line
@dataclass(frozen=True)
class Topology:
    """The topology of an object's mesh, and its volume.

    Vertices with equal positions count as one vertex; triangles with two equal corners are ignored. `closed`: every
    edge belongs to an even number of triangles. `oriented`: neighbouring triangles traverse their common edge in
    opposite directions. `boundary_edges` int32 [k, 2] are the edges of an odd number of triangles, as vertex indices;
    vertices with equal positions have the index of the first of these vertices. `volume` is the placed object's
    volume in cubic metres, positive if triangles are counter-clockwise seen from outside; it is only meaningful for
    closed, oriented meshes. `components` is the number of parts that edges connect.
    """

    closed: bool
    oriented: bool
    boundary_edges: npt.NDArray[np.int32]
    volume: float
    components: int


class PointQueries:
    """Base class of `World` with the queries of points."""

    __slots__ = ()

    _core: _core.World

    def topology(self, object: int | str) -> Topology:
        """Returns the topology of an object's mesh, by number or name.

        Raises `WorldError` for an unknown object.
        """
        return Topology(*_core.world_topology(self._core, object_number(self._core, object)))

    def inside(
        self, points: npt.ArrayLike, *, objects: Chosen | None = None, threads: int | None = None
    ) -> Bools:
        """Returns True [...] for `points` [..., 3] that are inside any of the objects.

        The result is exact for closed meshes. A point is inside an oriented mesh if the signed crossings of a ray from
        the point do not sum to 0. The mesh may be inside out, hollow, or consist of overlapping bodies. A point is
        inside a mesh with mixed orientations if the number of crossings is odd. A point is inside an open mesh if the
        absolute winding number is at least 1/2. A point on a surface is classified as if moved by an infinitesimal (e,
        e², e³): a box contains `low <= p < high`, so a point on the common face of two adjacent boxes is inside exactly
        one. Points that are not finite are outside.

        `objects` are numbers or names (default: all), and `threads` is the number of threads (default: all).
        Raises `WorldError` for unknown objects and `SettingsError` for a wrong shape.
        """
        array = triples("points", points)
        mask, threads = self._ready(objects, threads)
        return _core.world_inside(self._core, rows_of(array), mask, threads).reshape(array.shape[:-1])

    def winding_number(
        self, points: npt.ArrayLike, *, objects: Chosen | None = None, threads: int | None = None
    ) -> Floats:
        """Returns the generalised winding number around `points` [..., 3], float64 [...].

        The winding numbers of all objects are summed.

        A winding number is the surface's solid angle divided by 4 pi (Jacobson, Kavan and Sorkine-Hornung
        2013): 1 inside a closed mesh whose triangles are counter-clockwise seen from outside, 0 outside, and
        in between for open meshes. Integers are exact; other values have errors of about 1e-12. The running
        time is proportional to the number of edges that triangles traverse more often in one direction than
        in the other. The value is 0 for points that are not finite. Arguments and errors are those of
        `inside`.
        """
        array = triples("points", points)
        mask, threads = self._ready(objects, threads)
        return _core.world_winding_number(self._core, rows_of(array), mask, threads).reshape(array.shape[:-1])

    def closest_points(
        self,
        points: npt.ArrayLike,
        *,
        max_distance: npt.ArrayLike = np.inf,
        objects: Chosen | None = None,
        threads: int | None = None,
    ) -> dict[str, npt.NDArray[Any]]:
        """Returns the closest surface point to each of `points` [..., 3], within `max_distance`.

        =========== ================ =================================================================  =====
        distance    float64 [...]    to the closest point                                               +inf
        position    float64 [..., 3] the closest point in the world                                     NaN
        instance    int32 [...]      number of the point's object                                       -1
        triangle    int32 [...]      index of the point's triangle in the mesh                          -1
        barycentric float64 [..., 3] weights of the triangle's corners, at least 0 and of sum 1         0
        normal      float64 [..., 3] the triangle's unit normal, outwards; 0 without an area            0
        =========== ================ =================================================================  =====

        The last column is the value if there is no surface within `max_distance` (one number, or one for each
        point), in an empty world, and for points that are not finite. Triangles without area are included, as
        segments or points. Among equal distances, for example at an edge, the triangle that faces the point
        most directly is returned, and among these, the smallest (instance, triangle). Errors are below 4
        units in the last place of the largest coordinate. `objects` and `threads` are as in `inside`. Raises
        `SettingsError` for a wrong shape and limits that are negative or NaN, and `WorldError` for unknown
        objects.
        """
        query, shape = self._points(points, max_distance, objects, threads)
        found = _core.world_closest_points(self._core, query)
        return {name: array.reshape((*shape, *array.shape[1:])) for name, array in found.items()}

    def distance(
        self,
        points: npt.ArrayLike,
        *,
        max_distance: npt.ArrayLike = np.inf,
        objects: Chosen | None = None,
        threads: int | None = None,
    ) -> Floats:
        """Returns the distance float64 [...] of `points` [..., 3] to the nearest surface.

        The arguments, rules and errors are those of `closest_points`.
        """
        query, shape = self._points(points, max_distance, objects, threads)
        return _core.world_distance(self._core, query).reshape(shape)

    def signed_distance(
        self,
        points: npt.ArrayLike,
        *,
        sign: Literal["auto", "winding", "pseudonormal", "none"] = "auto",
        max_distance: npt.ArrayLike = np.inf,
        objects: Chosen | None = None,
        threads: int | None = None,
    ) -> Floats:
        """Returns the signed distance of `points` [..., 3] to the nearest surface, float64 [...].

        The distance is negative inside.

        `sign` selects which points have a negative distance. "auto" selects points for which `inside` is True, and
        "winding" points with an absolute winding number of at least 1/2. "pseudonormal" selects points behind the
        surface at the closest point, also for open meshes (Bærentzen and Aanæs 2005). "none" selects no points. trimesh
        uses the opposite sign. The distance is +inf beyond `max_distance`. Other arguments and errors are those of
        `closest_points`.
        """
        rule = one_of("sign", sign, ("auto", "winding", "pseudonormal", "none"))
        query, shape = self._points(points, max_distance, objects, threads)
        if rule == "none":
            return _core.world_distance(self._core, query).reshape(shape)
        return _core.world_signed_distance(self._core, query, rule).reshape(shape)

    def visible(
        self,
        a: npt.ArrayLike,
        b: npt.ArrayLike,
        *,
        margin: float | None = None,
        objects: Chosen | None = None,
        surface: Surface = "first",
        threads: int | None = None,
    ) -> Bools:
        """Returns True [...] for points `a` and `b` [..., 3] with no triangle between them.

        The result is symmetric in `a` and `b`.

        The points broadcast as in NumPy: `visible(a[:, None], b)` returns the visibility matrix, without
        copying the points. Triangles within `margin` of either point are ignored, because the point may lie
        on them. The default margin is eight units in the last place of the points' dtype (float32 or float64)
        at the largest coordinate, the rounding error of a point on a surface. As in `cast_rays`, triangles
        include their edges, and `objects` and `surface` select the triangles that block the view. The result
        is False for points that are not finite. `threads` is the number of threads (default: all). Raises
        `SettingsError` for a wrong shape and a negative margin.
        """
        left, right = triples("a", a), triples("b", b)
        pair = paired(("a", left), ("b", right))
        shape = pair[0].shape[:-1]
        margin = (
            _rounding(left, right)
            if margin is None
            else real("margin", margin, 0.0, what="a distance in metres")
        )
        word = one_of("surface", surface, ("first", "solid"))
        mask, threads = self._ready(objects, threads)
        count = int(np.prod(shape, dtype=np.int64))
        found = np.empty(count, dtype=np.bool_)
        for first in range(0, count, PAIRS_PER_BLOCK):
            last = min(count, first + PAIRS_PER_BLOCK)
            if count <= PAIRS_PER_BLOCK:
                starts, ends = (rows_of(array) for array in pair)
            else:
                place = np.unravel_index(np.arange(first, last), shape)
                starts, ends = (rows_of(array[place]) for array in pair)
            found[first:last] = _core.world_visible(
                self._core, starts, ends, float(margin), mask, word, threads
            )
        return found.reshape(shape)

    def _points(
        self, points: npt.ArrayLike, max_distance: npt.ArrayLike, objects: Chosen | None, threads: int | None
    ) -> tuple[dict[str, Any], tuple[int, ...]]:
        """Returns the arguments of the core's query and the points' shape; prepares the world."""
        array = triples("points", points)
        shape = array.shape[:-1]
        reach = limits("max_distance", max_distance, shape)
        mask, threads = self._ready(objects, threads)
        query = {"points": rows_of(array), "max_distance": reach, "objects": mask, "threads": threads}
        return query, shape

    def _ready(self, objects: Chosen | None, threads: int | None) -> tuple[Bools | None, int | None]:
        """The chosen objects and the number of threads; prepares the world."""
        mask, threads = object_mask(self._core, objects), thread_count(threads)
        with no_fork():
            self._core.prepare(threads)
        return mask, threads


def _rounding(*points: npt.NDArray[Any]) -> float:
    """Returns eight units in the last place at the points' largest finite coordinate.

    The unit is the unit of the least precise dtype.
    """
    largest = 0.0
    coarsest = float(np.finfo(np.float64).eps)
    for array in points:
        if array.dtype.kind == "f":
            coarsest = max(coarsest, float(np.finfo(array.dtype).eps))
        finite = np.abs(array[np.isfinite(array)])
        if finite.size:
            largest = max(largest, float(finite.max()))
    return 8 * coarsest * largest
