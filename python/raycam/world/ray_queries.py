"""Queries of rays: first hits, occlusion, crossings."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from .. import _core
from .._core import Cancel
from ..arguments import (
    Bools,
    Floats,
    flag,
    limits,
    numbers,
    one_of,
    paired,
    rows_of,
    thread_count,
    triples,
    whole,
    words,
)
from ..errors import Notice, SettingsError, nearest
from ..io.fork_guard import no_fork
from ..notices import warn
from .chosen import Chosen, object_mask

__all__ = ["CrossingLimits", "RayLimits", "RayQueries"]

Facing = Literal["both", "front", "back", "material"]
Surface = Literal["first", "solid"]
Arrays = dict[str, npt.NDArray[Any]]

FIRST_HIT_FIELDS = ("t", "instance", "triangle", "barycentric", "normal", "position")
RAY_FIELDS = tuple(_core.ray_fields())
CROSSING_FIELDS = ("t", "instance", "triangle", "barycentric", "front")


class CrossingLimits(TypedDict, total=False):
    """Limits of `World.intersections` and `World.count_intersections`; see `World.cast_rays`."""

    t_min: npt.ArrayLike
    """The smallest ray parameter: one number, or one for each ray (default: 0)."""
    objects: Chosen | None
    """The objects that rays can hit, by number or name (default: all)."""
    exclude: Chosen | None
    """Objects that rays pass through, by number or name."""
    surface: Surface
    """"first" (default): rays hit every surface; "solid": only opaque surfaces."""
    facing: Facing
    """The sides of triangles that rays hit: "both" (default), "front", "back" or "material"."""
    threads: int | None
    """The number of threads (default: all that the process may use)."""


class RayLimits(CrossingLimits, total=False):
    """Limits of `World.cast_rays` and `World.occluded`; see `World.cast_rays`."""

    skip: tuple[npt.ArrayLike, npt.ArrayLike] | None
    """(instance, triangle): arrays of the triangle that each ray passes through."""
    exact: bool
    """False: use float32 instead of exact arithmetic (default: True)."""
    coherent: bool | None
    """True if neighbouring rays are similar (default: detected); changes the speed only."""
    times: npt.ArrayLike | None
    """The time of each ray, in seconds after the world's time (default: 0 for all rays)."""


class RayQueries:
    """Base class of `World` with the queries of rays."""

    __slots__ = ()

    _core: _core.World

    def cast_rays(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        t_max: npt.ArrayLike = np.inf,
        fields: Iterable[str] = FIRST_HIT_FIELDS,
        cancel: Cancel | None = None,
        **limits: Unpack[RayLimits],
    ) -> Arrays:
        """Returns the closest hit of each ray `origin + t * direction` with `t_min` <= t <= `t_max`.

        `origins` and `directions` are [..., 3] in world coordinates and broadcast as in NumPy. Directions need not be
        normalised. `t_min` (default 0) and `t_max` are one number or one for each ray; they may be negative or
        infinite. Returns the arrays named in `fields`, in the shape of the rays:

        ============== ================ ================================================================ =====
        t              float64 [...]    ray parameter, in lengths of the direction                       +inf
        instance       int32 [...]      number of the object                                             -1
        triangle       int32 [...]      index of the triangle in its mesh                                -1
        barycentric    float64 [..., 3] weights of the corners, at least 0 and of sum 1                  0
        normal         float64 [..., 3] the triangle's unit normal, on the side that the ray comes from  0
        position       float64 [..., 3] the hit point in the world                                       NaN
        front          bool [...]       the ray hits the front, where the corners are counter-           False
                                        clockwise; mirrored objects keep their outside
        distance       float64 [...]    t times the length of the direction                              +inf
        shading_normal float64 [..., 3] unit normal interpolated from the corners, on the same side      0
        uv             float64 [..., 2] texture coordinates, v down; NaN without any                     NaN
        material       int32 [...]      as in the channel `material`                                     -1
        category       int32 [...]      as in the channel `category`                                     -1
        albedo         float32 [..., 3] base colour with its texture, linear                             0
        roughness      float32 [...]    perceptual roughness with its texture; 1 without a glossy lobe   0
        metallic       float32 [...]    1 for metals, with its texture                                   0
        emission       float32 [..., 3] radiance emitted against the ray, linear, W/(m² sr)              0
        reflectance    float32 [...]    texture of reflectances for lidars; NaN without such a texture   NaN
        ============== ================ ================================================================ =====

        The last column is the value of a miss. The first six are the default. Rays that are not finite or have a zero
        direction are misses.

        `objects` and `exclude` select the objects that rays can hit, by number or name. `skip=(instance, triangle)`,
        one pair for each ray, ignores the triangle on which the ray starts (as returned by an earlier hit); triangle
        -1 ignores the whole object, instance -1 ignores nothing. `facing` accepts hits on one side only: "front",
        "back", or "material" (one-sided materials from the front). `surface="solid"` ignores transparent surfaces, as
        in images.

        Triangles include their edges: a ray through an edge or a corner hits the triangle; a ray in its plane does
        not. Hits are exact for the given float64 numbers (exact predicates, Shewchuk 1997), for absolute coordinates
        from 1e-36 to 1e37; `t` and the weights have errors of at most one unit in the last place. Among several hits,
        the smallest (t, instance, triangle) is returned; but of objects in the same plane, up to eight rounding units
        of float32, the last object is hit, as in images.

        `exact=False` uses float32 instead. It is up to 1.6 times as fast for coherent rays, but a hit that is nearer
        than 1e-6 of the world's size to an edge, to the ray's start or to another surface may be missed or replaced
        by the other surface. It requires t_min = 0 and the default `objects`, `skip`, `facing` and `surface`.
        `coherent` states whether neighbouring rays are similar (None: detected); it affects the speed only.

        `times` is one time for all rays, or one for each ray, in seconds after the world's time T (see `World.at`). Ray
        i has the same hit as in `world.at(T + times[i])`, also with `exact=False`. If objects follow keyframes, only
        the objects within reach of the rays are placed at each distinct time. With other animations and `exact=False`,
        the world is prepared once for each distinct time. Worlds without motion need no additional time. An animated
        world for which no time is set is static, with a notice.

        `cancel` is a `raycam.Cancel`; cancelling it from another thread ends the call with `Cancelled`.

        Raises `SettingsError` for a wrong shape, limits that are NaN and unknown fields (with the nearest name), and
        `WorldError` for unknown objects.
        """
        query, shape = self._rays(origins, directions, t_max, limits, RayLimits)
        found = _core.world_cast_rays(self._core, query, _fields(fields), cancel)
        if len(shape) == 1:
            return found
        return {name: array.reshape((*shape, *array.shape[1:])) for name, array in found.items()}

    def occluded(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_max: npt.ArrayLike = np.inf,
        **limits: Unpack[RayLimits],
    ) -> Bools:
        """Returns True [...] for rays that hit anything at `t_min` <= t <= `t_max`.

        Arguments, rules and errors are those of `cast_rays`.
        """
        query, shape = self._rays(origins, directions, t_max, limits, RayLimits)
        return _core.world_occluded(self._core, query).reshape(shape)

    def intersections(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        t_max: npt.ArrayLike = np.inf,
        max_hits: int | None = None,
        fields: Iterable[str] = CROSSING_FIELDS,
        **limits: Unpack[CrossingLimits],
    ) -> Arrays:
        """Returns all crossings of each ray with surfaces.

        Ray points are `origin + t * direction` with `t_min` <= t <= `t_max`. Arguments are those of `cast_rays`;
        `max_hits` limits the result to the first crossings of each ray. Returns

        ======= ============= ========================================================================
        offsets int64 [n + 1] crossings of ray i are `offsets[i]:offsets[i + 1]`; n rays, in C order
        ray     int64 [m]     the ray of each crossing
        ...     [m], [m, k]   the fields of `cast_rays` named in `fields`, by default t, instance,
                              triangle, barycentric and front
        ======= ============= ========================================================================

        sorted by (ray, t, instance, triangle).

        Each ray is moved by an infinitesimal vector (e, e², e³) (simulation of simplicity, Edelsbrunner and Mücke
        1990), so it never meets an edge or a corner, and never starts on a surface. A ray through an edge or corner
        that triangles share therefore crosses the surface once, or 0 or 2 times at a silhouette. A line crosses a
        closed mesh an even number of times. A ray in the plane of a triangle does not cross the triangle. Duplicate
        faces are two surfaces. With `t_min=0`, a crossing at the ray's start is included if the moved start is before
        it. The arithmetic is exact, as in `cast_rays`.
        """
        if max_hits is not None:
            max_hits = whole("max_hits", max_hits, 0, 2**62)
        query, _ = self._rays(origins, directions, t_max, limits, CrossingLimits)
        return _core.world_intersections(self._core, query, max_hits, _fields(fields))

    def count_intersections(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        t_max: npt.ArrayLike = np.inf,
        signed: bool = False,
        **limits: Unpack[CrossingLimits],
    ) -> npt.NDArray[np.int32]:
        """Returns the number of crossings of each ray, int32 [...], by the rules of `intersections`.

        The rays, `t_max`, `limits` and errors are as in `cast_rays`. With `signed`, the result is the number
        of crossings that leave minus the number of crossings that enter (through the front of a triangle).
        For closed oriented meshes, it is the winding number around the ray's origin.
        """
        query, shape = self._rays(origins, directions, t_max, limits, CrossingLimits)
        return _core.world_count_intersections(self._core, query, flag("signed", signed)).reshape(shape)

    def _rays(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_max: npt.ArrayLike,
        given: RayLimits | CrossingLimits,
        allowed: type,
    ) -> tuple[dict[str, Any], tuple[int, ...]]:
        """Prepares the world; returns the query for the core, and the shape of the rays."""
        keys: dict[str, Any] = dict(given)
        for name in keys.keys() - allowed.__annotations__.keys():
            raise SettingsError(nearest("argument", name, list(allowed.__annotations__)), code="unknown_key")
        threads, coherent, skip = thread_count(keys.get("threads")), keys.get("coherent"), keys.get("skip")
        starts, ways = paired(
            ("origins", triples("origins", origins)), ("directions", triples("directions", directions))
        )
        shape = starts.shape[:-1]
        facing, surface = keys.get("facing", "both"), keys.get("surface", "first")
        query = {
            "origins": rows_of(starts),
            "directions": rows_of(ways),
            "t_min": limits("t_min", keys.get("t_min", 0.0), shape),
            "t_max": limits("t_max", t_max, shape),
            "exact": flag("exact", keys.get("exact", True)),
            "coherent": None if coherent is None else flag("coherent", coherent),
            "objects": object_mask(self._core, keys.get("objects"), keys.get("exclude")),
            "skip": None if skip is None else _skipped(skip, shape),
            "facing": one_of("facing", facing, ("both", "front", "back", "material")),
            "surface": one_of("surface", surface, ("first", "solid")),
            "times": self._ray_times(keys.get("times"), shape),
            "threads": threads,
        }
        with no_fork():
            self._core.prepare(threads)
        return query, shape

    def _ray_times(self, times: npt.ArrayLike | None, shape: tuple[int, ...]) -> Floats | None:
        """The times of rays, float64 [n]; warns if they have no effect on a moving world."""
        if times is None:
            return None
        if self._core.is_animated and self._core.time is None:
            text = "times have no effect, because no time is set for the animated world; use world.at(time)"
            warn(Notice(text, "unused_times"))
        array = limits("times", times, shape)
        if len(array) == 1:
            array = np.full(math.prod(shape), array[0])
        return array


def _fields(names: Iterable[str]) -> list[str]:
    """The names of fields, after they have been checked."""
    if isinstance(names, tuple) and all(isinstance(name, str) for name in names):
        return _checked_fields(names)
    return words("field", names, RAY_FIELDS)


@functools.lru_cache(maxsize=16)
def _checked_fields(names: tuple[str, ...]) -> list[str]:
    return words("field", names, RAY_FIELDS)


def _skipped(
    skip: tuple[npt.ArrayLike, npt.ArrayLike], shape: tuple[int, ...]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Ignored objects and triangles, int32 [n] each."""
    try:
        pair = tuple(skip)
    except TypeError:
        pair = ()
    if len(pair) != 2:
        raise SettingsError(
            f"skip must be (instance, triangle), one for each ray, not {skip!r}", code="wrong_shape"
        )
    both = []
    for name, values in zip(("skip[0]", "skip[1]"), pair, strict=True):
        array = numbers(name, values)
        if array.dtype.kind not in "iu" and array.size:
            raise SettingsError(
                f"{name} must be whole numbers, not of dtype {array.dtype}", code="wrong_type"
            )
        try:
            spread = np.broadcast_to(array, shape)
        except ValueError:
            raise SettingsError(
                f"{name} must be one number or one for each ray {list(shape)}, not {list(array.shape)}",
                code="wrong_shape",
            ) from None
        limit = np.iinfo(np.int32)
        if spread.size and not (limit.min <= spread.min() and spread.max() <= limit.max):
            raise SettingsError(
                f"{name} must be indices of objects and triangles in the range of int32", code="wrong_type"
            )
        both.append(np.ascontiguousarray(spread, dtype=np.int32).reshape(-1))
    return both[0], both[1]
