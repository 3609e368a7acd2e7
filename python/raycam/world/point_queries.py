"""Queries of points and of pairs of points: closest points, distances, inside and outside, sight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, limits, one_of, paired, rows_of, thread_count, triples
from ..errors import SettingsError
from ..io.fork_guard import no_fork
from .chosen import Chosen, object_mask, object_number
from .ray_queries import Surface

__all__ = ["PointQueries", "Topology"]

PAIRS_PER_BLOCK = 1 << 20
"""Pairs of points that are converted at once, so that broadcast points take no memory."""


@dataclass(frozen=True)
class Topology:
    """A mesh as a surface.

    Vertices at one place are one; triangles with two corners at one place are left out. `closed`: every edge has an
    even number of triangles. `oriented`: every edge is passed as often one way as the other. `boundary_edges` int32
    [k, 2] are the edges of an odd number of triangles, as vertices of the mesh, the first at each place. `volume` is
    that of the placed object, positive if triangles are counter-clockwise seen from outside; it means something for
    closed, oriented meshes. `components`: the number of parts that edges connect.
    """

    closed: bool
    oriented: bool
    boundary_edges: npt.NDArray[np.int32]
    volume: float
    components: int


class PointQueries:
    """Methods of `World` that take points."""

    __slots__ = ()

    _core: _core.World

    def topology(self, object: int | str) -> Topology:
        """The topology of an object's mesh, by number or name; raises `WorldError` for an unknown object."""
        return Topology(*_core.world_topology(self._core, object_number(self._core, object)))

    def inside(
        self, points: npt.ArrayLike, *, objects: Chosen | None = None, threads: int | None = None
    ) -> Bools:
        """True [...] for `points` [..., 3] inside of any of the objects.

        Exact for closed meshes: of oriented ones, also inside out, with hollows or with bodies that overlap, the signed
        crossings of a ray are not 0; where windings are mixed, their number is odd. An open mesh holds the points with
        a winding number of 1/2 or more, in size. A point on a surface is where a point moved by an infinitesimal (e,
        e², e³) is: a box holds `low <= p < high`, and bodies side by side fill space. Points that are not finite are
        outside. `objects` are numbers or names; raises `WorldError` for unknown ones, and `SettingsError` for other
        shapes.
        """
        array = triples("points", points)
        mask, threads = self._ready(objects, threads)
        return _core.world_inside(self._core, rows_of(array), mask, threads).reshape(array.shape[:-1])

    def winding_number(
        self, points: npt.ArrayLike, *, objects: Chosen | None = None, threads: int | None = None
    ) -> Floats:
        """The generalised winding number float64 [...] of the objects around `points` [..., 3], summed over objects.

        The solid angle of the surface over 4 pi (Jacobson, Kavan and Sorkine-Hornung 2013): 1 inside of a closed mesh
        whose triangles are counter-clockwise seen from outside, 0 outside, between for open ones. Whole numbers are
        exact, others are off by 1e-12 or so. Takes time in proportion to the edges that do not pair. 0 for points that
        are not finite; arguments and errors of `inside`.
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
        """The closest point of the world to each of `points` [..., 3], within `max_distance`.

        =========== ================ =================================================================  =====
        distance    float64 [...]    to the closest point                                               +inf
        position    float64 [..., 3] the closest point in the world                                     NaN
        instance    int32 [...]      number of its object                                               -1
        triangle    int32 [...]      index of its triangle in the mesh                                  -1
        barycentric float64 [..., 3] weights of the triangle's corners, at least 0 and of sum 1         0
        normal      float64 [..., 3] the triangle's unit normal, outwards; 0 without an area            0
        =========== ================ =================================================================  =====

        The last column is the value without a point in reach: beyond `max_distance` (one number or one for each point),
        in an empty world, and for points that are not finite. Triangles without area are segments or points, and
        count. Of equal distances the smallest (instance, triangle) is taken. Errors are below 4 units in the last
        place of the largest coordinate. Raises `SettingsError` for other shapes and limits that are negative or NaN,
        and `WorldError` for unknown objects.
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
        """The distance float64 [...] of `points` [..., 3] to the surfaces, as of `closest_points`."""
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
        """The distance float64 [...] of `points` [..., 3] to the nearest surface, negative inside.

        `sign`: "auto" is negative where `inside` is True; "winding" where the winding number is 1/2 or more, in size;
        "pseudonormal" behind the surface at its closest point (Bærentzen and Aanæs 2005), also of open sheets; "none"
        is `distance`. (trimesh has the other sign: positive inside.) +inf beyond `max_distance`. Arguments and errors
        of `closest_points`.
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
        """True [...] for points `a` and `b` [..., 3] with no triangle between them; the same both ways.

        They broadcast as in NumPy: `visible(a[:, None], b)` is the matrix of sight, and takes no memory beside it.
        Triangles within `margin` of either point do not count: those on which an end lies. By default the margin is
        eight units in the last place of the points' dtype (float32 or float64) at the largest coordinate, the rounding
        of a point on a surface. A triangle is closed, as for `cast_rays`; `objects` and `surface` are as there. Points
        that are not finite see nothing. Raises `SettingsError` for other shapes and a negative margin.
        """
        left, right = triples("a", a), triples("b", b)
        pair = paired(("a", left), ("b", right))
        shape = pair[0].shape[:-1]
        if margin is None:
            margin = _rounding(left, right)
        elif not isinstance(margin, int | float | np.number) or not margin >= 0:
            raise SettingsError(f"margin must be a number of at least 0, not {margin!r}", code="out_of_range")
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
        """The query as the core takes it, and the shape of the points; prepares the world."""
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
    """Eight units in the last place of the coarsest dtype among points, at their largest finite coordinate."""
    largest = 0.0
    coarsest = float(np.finfo(np.float64).eps)
    for array in points:
        if array.dtype.kind == "f":
            coarsest = max(coarsest, float(np.finfo(array.dtype).eps))
        finite = np.abs(array[np.isfinite(array)])
        if finite.size:
            largest = max(largest, float(finite.max()))
    return 8 * coarsest * largest
