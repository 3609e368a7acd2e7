"""Keypoints: the pixels of object points, and the objects that occlude the points."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, floats, real, thread_count, wholes
from ..camera import Camera
from ..errors import SettingsError
from ..one_line import one_line
from ..render.arguments import camera_of, world_of
from ..world import World

__all__ = ["Keypoints", "keypoints"]


@one_line
@dataclass(frozen=True)
class Keypoints:
    """The projections of n points into one image."""

    points: Floats
    """Positions in the world [n, 3] at the time of exposure, metres; at time 0 for points without a pixel."""
    pixels: Floats
    """Pixel coordinates [n, 2]; NaN if the camera cannot project the point."""
    in_picture: Bools
    """True [n] for points whose pixel is inside the image."""
    visible: Bools
    """True [n] for points whose pixel is inside the image and that nothing occludes."""
    occluder: npt.NDArray[np.int32]
    """The object [n] that occludes the point, possibly the point's own; -1 without an occluder, and outside the
    image."""
    on_surface: Bools
    """True [n] for visible points that lie on the surface shown by their pixel, instead of in front of it."""


def keypoints(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None,
    points: npt.ArrayLike,
    objects: Sequence[int] | None = None,
    *,
    triangles: Sequence[int] | None = None,
    tolerance: float = 1e-4,
    threads: int | None = None,
) -> Keypoints:
    """Returns the pixels of `points` [n, 3], and the objects that occlude them.

    `world` and `camera` may be paths and names, as in `raycam.render`.

    `points` are world coordinates in metres. With `objects`, one object id for each point, they are in the coordinates
    of the objects' meshes and move with the objects. With `triangles`, one triangle id for each point, `points` are
    barycentric weights of the triangles' corners (as in the channels `instance`, `triangle` and `barycentric`); such
    points also follow meshes that deform. `threads` is the number of threads (default: all).

    A point is occluded by the first object that the camera's ray to it hits, if the hit is nearer by more than
    `tolerance` times the distance. With a rolling shutter, the time of each point and its occluder is the middle of the
    exposure of the line that shows the point.

    Raises `SettingsError` for unknown object or triangle ids, for weights whose sum is not 1, and for points in the
    coordinates of a skinned mesh.
    """
    world = world_of(world)
    camera = camera_of(world, camera)
    places = floats("points", points, ("n", 3))
    if triangles is not None and objects is None:
        raise SettingsError(
            "triangles require objects, one for each triangle, because triangle ids belong to an object's mesh",
            code="wrong_shape",
        )
    numbers = {
        name: None if given is None else wholes(name, given, 0, (1 << 31) - 1)
        for name, given in (("objects", objects), ("triangles", triangles))
    }
    for name, given in numbers.items():
        if given is not None and len(given) != len(places):
            raise SettingsError(
                f"{name} has {len(given)} entries for {len(places)} points; expected one entry for each point",
                code="wrong_shape",
            )
    found = _core.keypoints(
        (world._core, camera._core),
        places,
        numbers["objects"],
        numbers["triangles"],
        real("tolerance", tolerance, 0.0, what="a fraction of the distance"),
        thread_count(threads),
    )
    return Keypoints(**found, visible=found["in_picture"] & (found["occluder"] == -1))
