"""Keypoints: where a camera sees points of objects, and what hides them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arrays import Bools, Floats, floats, whole
from ..camera import Camera
from ..errors import SettingsError
from ..world import World

__all__ = ["Keypoints", "keypoints"]


@dataclass(frozen=True)
class Keypoints:
    """Points in one picture, [n] of them."""

    points: Floats
    """Where they are in the world [n, 3] when they are seen, metres; without an image, as the world stands."""
    pixels: Floats
    """Their images [n, 2]; NaN where the camera has none."""
    in_picture: Bools
    """Whether their image lies inside of the picture."""
    visible: Bools
    """Whether it does, and nothing lies before them."""
    occluder: npt.NDArray[np.int32]
    """The object that lies before them, which may be their own; -1 where none does, and outside."""
    on_surface: Bools
    """Whether they are visible, and what is seen there is a surface at their place, and not one behind it."""


def keypoints(
    world: World,
    camera: Camera,
    points: npt.ArrayLike,
    objects: Sequence[int] | None = None,
    *,
    triangles: Sequence[int] | None = None,
    tolerance: float = 1e-4,
    threads: int | None = None,
) -> Keypoints:
    """The images of `points` [n, 3], and what hides them.

    `points` are in the world, or with `objects`, one for each, in the coordinates of their meshes, and go where the
    objects go. With `triangles`, one for each, they are weights of the triangles' corners (as in the channels
    `instance`, `triangle` and `barycentric`), and go where the corners go: so do points of meshes that bend.

    The camera's own ray to a point finds the object before it: what lies nearer than the point by more than `tolerance`
    times the distance. Of a world that moves while the camera reads line after line, a point is seen by the line that
    finds it, at the place where it is in the middle of that line's exposure, and what hides it is there then.

    Raises `SettingsError` for numbers that there are not, for weights whose sum is not 1, and for points in the
    coordinates of a mesh that a skin bends.
    """
    places = floats("points", points, ("n", 3))
    if triangles is not None and objects is None:
        raise SettingsError(
            "triangles need objects, one for each: a triangle has its number in its object's mesh"
        )
    numbers = {
        name: None if given is None else [whole(name, number, 0, (1 << 31) - 1) for number in given]
        for name, given in (("objects", objects), ("triangles", triangles))
    }
    for name, given in numbers.items():
        if given is not None and len(given) != len(places):
            raise SettingsError(f"{name} has {len(given)} entries for {len(places)} points")
    found = _core.keypoints(
        (world._core, camera._core), places, numbers["objects"], numbers["triangles"], tolerance, threads
    )
    return Keypoints(**found, visible=found["in_picture"] & (found["occluder"] == -1))
