"""The plan of a data set: its views, and functions that formats share."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import PurePosixPath
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..annotations.labels import Label, label
from ..arguments import Floats, plain_numbers
from ..camera import Camera
from ..errors import CameraError, Notice, SettingsError, nearest
from ..io.temp_stream import Piece
from ..randomize import Recipe
from ..render import render
from ..render.camera_seed import with_camera_seed
from ..render.frame import Frame
from ..sensors import Sensor
from ..world import Object, World
from .world_sequence import WorldSequence

__all__ = [
    "NO_LENSES",
    "Format",
    "Made",
    "Plan",
    "Shot",
    "check_cameras",
    "check_poses",
    "k_with_half_centers",
    "matrix_text",
    "png",
]

MAX_CACHED_WORLDS = 2
"""Number of cached worlds of a recipe; frames that are rendered at the same time belong to neighbouring worlds."""

NO_LENSES = (
    "use pinhole cameras without skew, or another format: coco or webdataset (any lens model), "
    "colmap or nerf (most lens models)"
)
"""Advice in the errors of formats that do not support lens models."""

Record = dict[str, Any]
Made = tuple[Mapping[str, bytes | Iterable[Piece]], Record]
"""A unit's files by name (large files in pieces), and its record for the index files as plain JSON."""
Index = Iterator[tuple[str, Iterable[bytes]]]


@dataclass(frozen=True)
class Format:
    """A format of data sets, a row of `raycam.dataset.FORMATS`."""

    make: Callable[[Plan, int], Made]
    """Returns the files of a unit of work; depends on plan and number only."""
    index: Callable[[Plan, Callable[[], Iterator[Record]]], Index]
    """Returns the index files, in pieces; each call of the given function iterates over the records of all units."""
    check: Callable[[Plan], None]
    """Raises `SettingsError` or `CameraError` for options and cameras that the format does not support."""
    options: Mapping[str, Any]
    """The options with their defaults."""
    units: Callable[[Plan], int] = field(default=lambda plan: len(plan.shots))
    """The number of units of work (default: one per view)."""
    many_worlds: bool = False
    """True if one data set may contain all worlds of a recipe; otherwise, each world has its own data set in a
    folder."""
    posed: bool = False
    """True if the format stores one pose and K for each image."""
    writes_lidars: bool = False
    """True if the format writes the scans of lidars itself, so that no NPZ files are written for them; such a format
    needs no camera."""
    notices: Callable[[Plan], list[Notice]] = field(default=lambda plan: [])
    """Notices, issued before rendering, about cameras that other programs read incorrectly from this format."""


@dataclass(frozen=True)
class View:
    """A camera and a time, for which one image of the data set is rendered.

    `time` is the time of the world in seconds, or None for a world without motion. For a rig that has no camera,
    `optional_camera` is None, and the view contains only the rig's sensors at one of its poses.
    """

    optional_camera: Camera | None
    """The camera; for a named camera of a recipe, the camera of the first world (poses differ between worlds). None
    for a rig that has no camera."""
    time: float | None
    world: int | None = None
    """The number of the recipe's world; None for a single world."""
    name: str | None = None
    """The name of the camera in the recipe's world; None if `camera` is the same for all worlds."""
    rig: tuple[int, str] | None = None
    """For a camera on a rig, the index of the rig's pose, and the camera's name on the rig."""
    body: tuple[Floats, Floats] | None = None
    """For a camera on a rig, the rotation body_from_world [3, 3] and the position [3] of the rig's body."""
    label: str | None = None
    """The camera's name, or None if it was given without a name."""
    image: str | None = None
    """The name of the camera's image in the camera's file, or None."""
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    """Sensors to sample at the time of this view, by name."""

    @property
    def camera(self) -> Camera:
        """The camera of a view that has one; raises `SettingsError` for a rig that has no camera."""
        if self.optional_camera is None:
            raise SettingsError(
                "the view's rig has no camera; check view.has_camera first", code="missing_camera"
            )
        return self.optional_camera

    @property
    def has_camera(self) -> bool:
        """False for a rig that has no camera."""
        return self.optional_camera is not None


class Plan:
    """The views of a data set, their rendering, and their labelled objects."""

    def __init__(
        self,
        world: World,
        shots: Sequence[View],
        rendering: Mapping[str, Any],
        options: Mapping[str, Any],
        threads: int | None = None,
        recipe: Recipe | WorldSequence | None = None,
        known: Plan | None = None,
    ) -> None:
        if not shots:
            raise SettingsError("the data set has no views; pass at least one camera", code="missing_value")
        self.world = world
        """The world; for a recipe, the first world."""
        self.shots = list(shots)
        """The views."""
        self.rendering = dict(rendering)
        """The given arguments of `raycam.render`."""
        self.options = dict(options)
        """The options of the format."""
        self.threads = threads
        """The number of threads for a view."""
        self.recipe = recipe
        """The source of many worlds, a recipe or a caller's worlds; None for a single world."""
        self.whole = known
        """For a plan of one world of a recipe, the plan of all its worlds, which determines the categories."""
        self.watch: Callable[[int, int], object] | None = None
        """The `progress` of `raycam.render`; an exception from it stops the image."""
        self._worlds: OrderedDict[int, World] = OrderedDict()
        self._lock = Lock()

    @cached_property
    def rigs(self) -> list[list[int]]:
        """The view numbers of each pose of a rig, in the order of the poses; empty without rigs."""
        frames: dict[int, list[int]] = {}
        for number, view in enumerate(self.shots):
            if view.rig is not None:
                frames.setdefault(view.rig[0], []).append(number)
        return list(frames.values())

    @cached_property
    def views_of_world(self) -> int:
        """The number of views of each world of a recipe, which come one after another."""
        return sum(view.world == self.shots[0].world for view in self.shots)

    @cached_property
    def picture_names(self) -> list[str]:
        """The image names without ending: the source images' names, or else six-digit numbers."""
        names: dict[str, None] = {}
        known: set[str] = set()
        for number, view in enumerate(self.shots):
            parts = (
                []
                if view.image is None
                else PurePosixPath(view.image.replace("\\", "/")).with_suffix("").parts
            )
            kept = [part.replace(":", "_") for part in parts if part not in ("/", ".", "..")]
            name = "/".join(kept) or f"{number:06d}"
            # Names are compared without case, because some file systems do not distinguish upper and lower case.
            name = name if name.casefold() not in known else f"{name}_{number:06d}"
            known.add(name.casefold())
            names[name] = None
        return list(names)

    def picture_name(self, number: int) -> str:
        """Returns the name of a view's image without ending."""
        return self.picture_names[number]

    def shot(self, number: int) -> Shot:
        """The shot of a view."""
        return Shot(self, number)

    def world_of(self, view: View) -> World:
        """The world of a view, at its time."""
        if view.world is not None and self.recipe is not None:
            with self._lock:  # several views of one world may be processed at the same time
                world = self._worlds.get(view.world)
                if world is None:
                    world = self._worlds[view.world] = self.recipe.world(view.world)
                    while len(self._worlds) > MAX_CACHED_WORLDS:
                        self._worlds.popitem(last=False)
            return world
        return self.world if view.time is None else self.world.at(view.time)

    @cached_property
    def objects(self) -> list[Object]:
        """The objects of the world."""
        return self.world.objects

    @cached_property
    def categories(self) -> dict[int, str]:
        """The categories by id; without categories, every object has category 1, "object".

        For a recipe, these are all categories that its worlds may have.
        """
        return self._known or {1: "object"}

    @cached_property
    def _known(self) -> dict[int, str]:
        if self.whole is not None:
            return self.whole._known
        return self.world.categories if self.recipe is None else self.recipe.categories

    @cached_property
    def category_ids(self) -> dict[str, int]:
        """The ids of the categories by name."""
        return {name: number for number, name in self.categories.items()}

    @cached_property
    def labelled(self) -> list[int]:
        """The ids of the objects with a category.

        If no object has a category, these are the ids of all objects. Shadow catchers are always omitted.
        """
        return self.labelled_of(self.objects)

    def labelled_of(self, objects: Sequence[Object]) -> list[int]:
        """Returns the ids of the labelled objects among a world's objects."""
        return [item.id for item in objects if _is_labelled(item, bool(self._known))]


def _is_labelled(item: Object, categorised: bool) -> bool:
    return not item.shadow_catcher and (item.category is not None or not categorised)


class Shot:
    """One view: its world and camera, rendered on request."""

    def __init__(self, plan: Plan, number: int) -> None:
        self.plan = plan
        """The plan of the data set."""
        self.number = number
        """The number of the view in the plan."""
        self.view = plan.shots[number]
        """The view."""
        self.time = self.view.time
        """The time in seconds, or None."""

    @cached_property
    def world(self) -> World:
        """The world at the view's time."""
        return self.plan.world_of(self.view)

    @cached_property
    def camera(self) -> Camera:
        """The camera of the view, with the background that its recipe draws."""
        view, recipe = self.view, self.plan.recipe
        camera = view.camera if view.name is None else self.world.camera(view.name)
        if recipe is None or view.world is None or camera.background is not None:
            return camera
        return camera.with_background(recipe.background(view.world, self.background_key))

    @property
    def background_key(self) -> str:
        """The name that selects the view's background in a recipe's random stream."""
        return self.view.name or f"camera {self.number % self.plan.views_of_world}"

    @property
    def background_name(self) -> str | None:
        """The file name of the background image that the recipe draws for the view, or None."""
        recipe, world = self.plan.recipe, self.view.world
        return None if recipe is None or world is None else recipe.background_name(world, self.background_key)

    @cached_property
    def objects(self) -> list[Object]:
        """The objects of the world."""
        return self.plan.objects if self.plan.recipe is None else self.world.objects

    def category(self, number: int) -> int:
        """The category id of a labelled object."""
        return self.plan.category_ids[self.objects[number].category or "object"]

    def render(self, channels: Sequence[str], camera: Camera | None = None, index: int = 0) -> Frame:
        """Renders channels of the view with the settings of the plan.

        If `camera` is given, the image shows the view's world at the same time through that camera. `index`
        is the camera's number at this time; each number has independent noise.
        """
        rendering = {"threads": self.plan.threads, **self.plan.rendering}
        rendering = with_camera_seed(rendering, index)
        return render(
            self.world,
            camera or self.camera,
            channels=channels,
            frame=self.number,
            progress=self.plan.watch,
            **rendering,
        )

    def channel(self, frame: Frame, name: str) -> npt.NDArray[Any]:
        """A channel of a frame; `category` is converted to the category ids of the data set."""
        values = frame[name]
        if name != "category" or (self.plan.recipe is None and self.plan.whole is None):
            return values
        # A world's ids number its own categories; the data set's ids number the categories of all worlds.
        found = np.full_like(values, -1)
        for number, category in self.world.categories.items():
            found[values == number] = self.plan.category_ids[category]
        return found

    def labels(self, instance: npt.NDArray[np.int32], margin: tuple[int, int] | None = None) -> list[Label]:
        """Returns the labels of the view's labelled objects; the arguments are as in `raycam.label`."""
        return label(
            self.world,
            self.camera,
            objects=self.plan.labelled_of(self.objects),
            instance=instance,
            margin=margin,
            threads=self.plan.threads,
        )


def resolve_options(options: Mapping[str, Any], known: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Returns the given options, completed with the defaults in `known`.

    Numbers of NumPy and other libraries become Python numbers. Raises `SettingsError` for unknown options.
    """
    for name in options:
        if name not in known:
            if not known:
                raise SettingsError(f"unknown option {name}: {what} has no options", code="unknown_key")
            raise SettingsError(nearest(f"option of {what}", name, list(known)), code="unknown_key")
    return {**known, **plain_numbers(options)}


def check_cameras(plan: Plan, kind: Format, format: str) -> None:
    """Raises `SettingsError` for a rig that has no camera, if the format stores images."""
    if kind.writes_lidars or all(view.has_camera for view in plan.shots):
        return
    raise SettingsError(
        f"{format} requires a camera on each rig; for rigs with lidars only, use semantickitti, nuscenes or mcap",
        code="missing_camera",
    )


def check_poses(plan: Plan, format: str) -> None:
    """Raises `CameraError` for parallel rays, and for moving cameras with a rolling shutter."""
    for number, view in enumerate(plan.shots):
        if not view.has_camera:
            continue
        if view.camera.is_parallel:
            raise CameraError(
                f"camera {number} has parallel rays, but {format} requires K and a centre for each camera",
                code="unsupported_camera",
            )
        shutter = view.camera.shutter
        if shutter is not None and shutter["readout"] > 0 and len(shutter["track"]) > 1:
            raise CameraError(
                f"camera {number} has a rolling shutter, but {format} stores one pose for each image; use "
                "coco or webdataset",
                code="unsupported_camera",
            )


def png(pixels: npt.NDArray[Any], *, fast: bool = False) -> bytes:
    """Encodes uint8 or uint16 [height, width] or [height, width, channels] as PNG.

    `fast` takes less time, but the file is larger.
    """
    return _core.encode_png(np.ascontiguousarray(pixels), fast=fast)


def k_with_half_centers(camera: Camera) -> npt.NDArray[np.float64]:
    """Returns the intrinsics K with the centre of the first pixel at (0.5, 0.5)."""
    k = camera.K.copy()
    k[:2, 2] -= camera.corner
    return k


def k_with_integer_centers(camera: Camera) -> npt.NDArray[np.float64]:
    """Returns the intrinsics K with the centre of the first pixel at (0, 0)."""
    k = camera.K.copy()
    k[:2, 2] -= 0.5 + camera.corner
    return k


def matrix_text(matrix: npt.NDArray[Any]) -> str:
    """Returns the numbers of a matrix in one line, without rounding."""
    return " ".join(repr(float(value)) for value in matrix.ravel())
