"""What a data set is made of: the views of a world, one after the other, and what every format asks of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import SettingsError, nearest
from ..frame import Frame
from ..labels import Label, label
from ..render import render
from ..world import Object, World

__all__ = ["Format", "Made", "Plan", "Shot", "half", "matrix_text", "png"]

Record = dict[str, Any]
Made = tuple[dict[str, bytes], Record]
"""The files of a unit by name, and what the index of the data set has to know of it: plain JSON."""
Index = Iterator[tuple[str, Iterable[bytes]]]


@dataclass(frozen=True)
class Format:
    """A format of data sets: a row of `raycam.dataset.FORMATS`."""

    make: Callable[[Plan, int], Made]
    """The files of a unit of work, a pure function of plan and number."""
    index: Callable[[Plan, Callable[[], Iterator[Record]]], Index]
    """The files over all units, in parts; the function reads all records again each time."""
    check: Callable[[Plan], None]
    """Raises `SettingsError` or `CameraError` for what the format does not have."""
    options: Mapping[str, Any]
    """Its options with their defaults."""
    units: Callable[[Plan], int] = field(default=lambda plan: len(plan.shots))
    """How many units of work there are; a view each, where nothing else is said."""


@dataclass(frozen=True)
class View:
    """A camera, and the time in seconds at which it sees the world; None for the world as it stands."""

    camera: Camera
    time: float | None


class Plan:
    """The views of a data set, how they are rendered, and what is labelled in them."""

    def __init__(
        self,
        world: World,
        shots: Sequence[View],
        rendering: Mapping[str, Any],
        options: Mapping[str, Any],
        threads: int | None = None,
    ) -> None:
        if not shots:
            raise SettingsError("a data set of no views: give it cameras")
        self.world = world
        """The world."""
        self.shots = list(shots)
        """Every camera and its time."""
        self.rendering = dict(rendering)
        """What of `raycam.render` is not left to the world's file."""
        self.options = dict(options)
        """Those of the format."""
        self.threads = threads
        """How many work on a view."""

    def shot(self, number: int) -> Shot:
        """One view."""
        return Shot(self, number)

    @cached_property
    def objects(self) -> list[Object]:
        """All objects of the world."""
        return self.world.objects

    @cached_property
    def categories(self) -> dict[int, str]:
        """The categories by number; in a world without any, every object is of category 1, "object"."""
        return self.world.categories or {1: "object"}

    @cached_property
    def labelled(self) -> list[int]:
        """The objects that have a category; all of them where none has one."""
        return [item.id for item in self.objects if item.category is not None] or [
            item.id for item in self.objects
        ]

    def category(self, number: int) -> int:
        """The number of the category of a labelled object."""
        return self._category_ids[number]

    @cached_property
    def _category_ids(self) -> dict[int, int]:
        ids = {name: number for number, name in self.categories.items()}
        return {number: ids[self.objects[number].category or "object"] for number in self.labelled}


class Shot:
    """What one camera sees at one time; rendered when first asked."""

    def __init__(self, plan: Plan, number: int) -> None:
        self.plan = plan
        """The data set it is of."""
        self.number = number
        """Its place in it."""
        self.camera, self.time = plan.shots[number].camera, plan.shots[number].time
        """The camera, and the time in seconds or None."""

    @cached_property
    def world(self) -> World:
        """The world at this time."""
        return self.plan.world if self.time is None else self.plan.world.at(self.time)

    def render(self, channels: Sequence[str], camera: Camera | None = None) -> Frame:
        """The channels of a picture, as the plan wants it rendered."""
        rendering = {"threads": self.plan.threads, **self.plan.rendering}
        return render(self.world, camera or self.camera, channels=channels, frame=self.number, **rendering)

    def labels(self, instance: npt.NDArray[np.int32], margin: tuple[int, int] | None = None) -> list[Label]:
        """The labels of the labelled objects."""
        return label(
            self.world,
            self.camera,
            objects=self.plan.labelled,
            instance=instance,
            margin=margin,
            threads=self.plan.threads,
        )


def chosen(options: Mapping[str, Any], known: Mapping[str, Any], what: str) -> dict[str, Any]:
    """All known options, those given instead of their defaults; raises `SettingsError` for others."""
    for name in options:
        if name not in known:
            if not known:
                raise SettingsError(f"{name}: {what} has no options")
            raise SettingsError(nearest(f"option of {what}", name, list(known)))
    return {**known, **options}


def png(pixels: npt.NDArray[Any]) -> bytes:
    """A PNG file of uint8 or uint16 [height, width] or [height, width, channels]."""
    return _core.encode_png(np.ascontiguousarray(pixels))


def half(camera: Camera) -> npt.NDArray[np.float64]:
    """K with the centre of the first pixel at (0.5, 0.5)."""
    k = camera.K
    k[:2, 2] += 0.5 if camera.pixel_center == "integer" else 0.0
    return k


def whole_centers(camera: Camera) -> npt.NDArray[np.float64]:
    """K with the centre of the first pixel at (0, 0)."""
    k = camera.K
    k[:2, 2] -= 0.5 if camera.pixel_center == "half" else 0.0
    return k


def matrix_text(matrix: npt.NDArray[Any]) -> str:
    """All numbers of a matrix in a line, exactly."""
    return " ".join(repr(float(value)) for value in matrix.ravel())
