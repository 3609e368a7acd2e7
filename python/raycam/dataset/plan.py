"""What a data set is made of: the views of a world, one after the other, and what every format asks of them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..annotations.labels import Label, label
from ..camera import Camera
from ..errors import CameraError, SettingsError, nearest
from ..io.temp_stream import Piece
from ..randomize import Recipe
from ..render import render
from ..render.frame import Frame
from ..world import Object, World

__all__ = [
    "NO_LENSES",
    "Format",
    "Made",
    "Plan",
    "Shot",
    "check_poses",
    "k_with_half_centers",
    "matrix_text",
    "png",
]

MAX_CACHED_WORLDS = 2
"""Worlds of a recipe that are kept: views at work at the same time are of neighbours."""

NO_LENSES = "give it pinhole cameras without skew; coco and webdataset have any, colmap and nerf most lenses"
"""What to do where a format has no lenses."""

Record = dict[str, Any]
Made = tuple[Mapping[str, bytes | Iterable[Piece]], Record]
"""The files of a unit by name, in pieces where they are large, and what the index of the data set has to know of it:
plain JSON."""
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
    many_worlds: bool = False
    """Whether a data set may be of the different worlds of a recipe; else each is one in a folder of its own."""
    posed: bool = False
    """Whether it says of each picture where its camera was: one pose, and K."""


@dataclass(frozen=True)
class View:
    """A camera, and the time in seconds at which it sees the world; None for the world as it stands."""

    camera: Camera
    """Where it is; of the world of a recipe, that of the first one, whose place others do not share."""
    time: float | None
    world: int | None = None
    """Which world of a recipe it sees."""
    name: str | None = None
    """Which camera of that world it is; None for `camera`, which is the same in all of them."""
    rig: tuple[int, str] | None = None
    """Of a camera on a rig, the number of the rig's pose among all, and the camera's name on the rig."""


class Plan:
    """The views of a data set, how they are rendered, and what is labelled in them."""

    def __init__(
        self,
        world: World,
        shots: Sequence[View],
        rendering: Mapping[str, Any],
        options: Mapping[str, Any],
        threads: int | None = None,
        recipe: Recipe | None = None,
        known: Plan | None = None,
    ) -> None:
        if not shots:
            raise SettingsError("a data set of no views: give it cameras")
        self.world = world
        """The world; of a recipe, the first one."""
        self.shots = list(shots)
        """Every camera and its time."""
        self.rendering = dict(rendering)
        """What of `raycam.render` is not left to the world's file."""
        self.options = dict(options)
        """Those of the format."""
        self.threads = threads
        """How many work on a view."""
        self.recipe = recipe
        """What the worlds of the views are made of, where they are not one."""
        self.whole = known
        """What this is a part of, whose categories it has: the data set of all worlds of a recipe."""
        self.watch: Callable[[int, int], object] | None = None
        """Told how far a picture is, some 50 times a second; what it raises stops it."""
        self._worlds: OrderedDict[int, World] = OrderedDict()
        self._lock = Lock()

    @cached_property
    def rigs(self) -> list[list[int]]:
        """The views of each pose of a rig, in their order; empty where the cameras are on none."""
        frames: dict[int, list[int]] = {}
        for number, view in enumerate(self.shots):
            if view.rig is not None:
                frames.setdefault(view.rig[0], []).append(number)
        return list(frames.values())

    def shot(self, number: int) -> Shot:
        """One view."""
        return Shot(self, number)

    def world_of(self, view: View) -> World:
        """The world that a view sees."""
        if view.world is not None and self.recipe is not None:
            with self._lock:  # views of one world follow each other, and may be made at the same time
                world = self._worlds.get(view.world)
                if world is None:
                    world = self._worlds[view.world] = self.recipe.world(view.world)
                    while len(self._worlds) > MAX_CACHED_WORLDS:
                        self._worlds.popitem(last=False)
            return world
        return self.world if view.time is None else self.world.at(view.time)

    @cached_property
    def objects(self) -> list[Object]:
        """All objects of the world."""
        return self.world.objects

    @cached_property
    def categories(self) -> dict[int, str]:
        """The categories by number; in a world without any, every object is of category 1, "object".

        Those of a recipe are all that its worlds may have.
        """
        return self._known or {1: "object"}

    @cached_property
    def _known(self) -> dict[int, str]:
        if self.whole is not None:
            return self.whole._known
        return self.world.categories if self.recipe is None else self.recipe.categories

    @cached_property
    def category_ids(self) -> dict[str, int]:
        """The numbers of the categories by name."""
        return {name: number for number, name in self.categories.items()}

    @cached_property
    def labelled(self) -> list[int]:
        """The objects that have a category; all of them where none has one."""
        return self.labelled_of(self.objects)

    def labelled_of(self, objects: Sequence[Object]) -> list[int]:
        """Those of the objects of one of its worlds."""
        return [item.id for item in objects if item.category is not None or not self._known]


class Shot:
    """What one camera sees at one time; rendered when first asked."""

    def __init__(self, plan: Plan, number: int) -> None:
        self.plan = plan
        """The data set it is of."""
        self.number = number
        """Its place in it."""
        self.view = plan.shots[number]
        """Its place among the views."""
        self.time = self.view.time
        """Its time in seconds, or None."""

    @cached_property
    def world(self) -> World:
        """The world at this time."""
        return self.plan.world_of(self.view)

    @cached_property
    def camera(self) -> Camera:
        """The camera."""
        return self.view.camera if self.view.name is None else self.world.camera(self.view.name)

    @cached_property
    def objects(self) -> list[Object]:
        """All objects of the world."""
        return self.plan.objects if self.plan.recipe is None else self.world.objects

    def category(self, number: int) -> int:
        """The number of the category of a labelled object."""
        return self.plan.category_ids[self.objects[number].category or "object"]

    def render(self, channels: Sequence[str], camera: Camera | None = None) -> Frame:
        """The channels of a picture, as the plan wants it rendered."""
        rendering = {"threads": self.plan.threads, **self.plan.rendering}
        return render(
            self.world,
            camera or self.camera,
            channels=channels,
            frame=self.number,
            progress=self.plan.watch,
            **rendering,
        )

    def channel(self, frame: Frame, name: str) -> npt.NDArray[Any]:
        """A channel of it, with the data set's own numbers of categories."""
        values = frame[name]
        if name != "category" or (self.plan.recipe is None and self.plan.whole is None):
            return values
        # A world numbers the categories that it has; the data set those that any world may have.
        found = np.full_like(values, -1)
        for number, category in self.world.categories.items():
            found[values == number] = self.plan.category_ids[category]
        return found

    def labels(self, instance: npt.NDArray[np.int32], margin: tuple[int, int] | None = None) -> list[Label]:
        """The labels of the labelled objects."""
        return label(
            self.world,
            self.camera,
            objects=self.plan.labelled_of(self.objects),
            instance=instance,
            margin=margin,
            threads=self.plan.threads,
        )


def resolve_options(options: Mapping[str, Any], known: Mapping[str, Any], what: str) -> dict[str, Any]:
    """All known options, those given instead of their defaults; raises `SettingsError` for others."""
    for name in options:
        if name not in known:
            if not known:
                raise SettingsError(f"{name}: {what} has no options")
            raise SettingsError(nearest(f"option of {what}", name, list(known)))
    return {**known, **options}


def check_poses(plan: Plan, format: str) -> None:
    """Raises `CameraError` for cameras that are nowhere, and for those that no single pose describes."""
    for number, view in enumerate(plan.shots):
        if view.camera.is_parallel:
            raise CameraError(
                f"camera {number} has parallel rays; {format} has K and a place for each camera, and this one has none"
            )
        shutter = view.camera.shutter
        if shutter is not None and shutter["readout"] > 0 and len(shutter["track"]) > 1:
            raise CameraError(
                f"camera {number} moves while its lines are read; {format} has one pose for each picture: coco and "
                "webdataset have none, or the whole camera"
            )


def png(pixels: npt.NDArray[Any]) -> bytes:
    """A PNG file of uint8 or uint16 [height, width] or [height, width, channels]."""
    return _core.encode_png(np.ascontiguousarray(pixels))


def k_with_half_centers(camera: Camera) -> npt.NDArray[np.float64]:
    """K with the centre of the first pixel at (0.5, 0.5)."""
    k = camera.K
    k[:2, 2] -= camera.corner
    return k


def k_with_integer_centers(camera: Camera) -> npt.NDArray[np.float64]:
    """K with the centre of the first pixel at (0, 0)."""
    k = camera.K
    k[:2, 2] -= 0.5 + camera.corner
    return k


def matrix_text(matrix: npt.NDArray[Any]) -> str:
    """All numbers of a matrix in a line, exactly."""
    return " ".join(repr(float(value)) for value in matrix.ravel())
