"""Labels of the objects in an image: masks, boxes and visible fractions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import (
    Bools,
    Floats,
    numbers,
    one_of,
    product,
    several,
    thread_count,
    whole,
    wholes,
)
from ..camera import Camera
from ..errors import SettingsError
from ..one_line import one_line
from ..render import render
from ..render.arguments import camera_of, world_of
from ..world import World
from ..world.parts import Object

__all__ = ["Box3D", "Label", "box3d", "join_labels", "label"]

Region = tuple[int, int, int, int]


@one_line
@dataclass(frozen=True)
class Box3D:
    """The smallest box around an object; the box's edges are parallel to the mesh's axes.

    The box of a sheared object is aligned with the rotation nearest to its transform.
    """

    rotation: Floats
    """The rotation world_from_box [3, 3]; its columns are the box's axes in the world."""
    center: Floats
    """The centre [3] in the world, metres."""
    size: Floats
    """The edge lengths [3] along the axes, metres."""

    @property
    def corners(self) -> Floats:
        """The box's corners [8, 3] in the world, in metres.

        Corner i is at the far end of axis k if bit k of i is set.
        """
        signs = (np.arange(8)[:, None] >> np.arange(3) & 1) - 0.5
        return self.center + product(signs * self.size, self.rotation.T)


@dataclass(frozen=True)
class Label:
    """One object in one image.

    Boxes are (x, y, width, height) in pixels from the image's top left corner.
    """

    object: int
    """The object's id in the channel `instance`."""
    name: str
    """The object's name in the world."""
    category: str | None
    """The object's category in the world, or None."""
    category_id: int
    """The category's id in the channel `category`; -1 without a category."""
    region: Region
    """The rectangle (x, y, width, height) that the masks cover, in pixels; it may extend into the margin."""
    amodal_mask: Bools
    """True for the pixel centres of `region` [height, width] that would show the object if nothing occluded it."""
    visible_mask: Bools
    """True for the pixel centres of `region` [height, width] that show the object."""
    box3d: Box3D
    """The oriented box around the object in the world."""
    size: tuple[int, int]
    """The image's (width, height) in pixels."""

    @property
    def amodal_box(self) -> Region:
        """The bounding box of the amodal mask; it may reach beyond the image."""
        return self.region

    @cached_property
    def visible_box(self) -> Region | None:
        """The bounding box of the visible mask; None for an object that is not visible."""
        rows, columns = (np.flatnonzero(self.visible_mask.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        left, top = self.region[0] + int(columns[0]), self.region[1] + int(rows[0])
        return left, top, int(columns[-1] - columns[0]) + 1, int(rows[-1] - rows[0]) + 1

    @cached_property
    def amodal_pixels(self) -> int:
        """The number of pixels of the amodal mask, including the margin."""
        return int(np.count_nonzero(self.amodal_mask))

    @cached_property
    def visible_pixels(self) -> int:
        """The number of pixels that show the object."""
        return int(np.count_nonzero(self.visible_mask))

    @property
    def visible_fraction(self) -> float:
        """The fraction of the amodal mask that is visible.

        Occluders and the image's edge both reduce the fraction.
        """
        return self.visible_pixels / self.amodal_pixels

    @cached_property
    def truncated_fraction(self) -> float:
        """The fraction of the amodal mask that is outside the image.

        Parts beyond the margin are not counted.
        """
        return 1.0 - int(np.count_nonzero(self.in_picture(self.amodal_mask))) / self.amodal_pixels

    def __repr__(self) -> str:
        """The object, its category, its visible fraction and its box, in one line."""
        box = "hidden" if self.visible_box is None else f"visible_box={self.visible_box}"
        return (
            f"Label {self.object} {self.name!r}, category {self.category!r}: {self.visible_pixels} of"
            f" {self.amodal_pixels} pixels visible, {box}"
        )

    def in_picture(self, mask: Bools) -> Bools:
        """Returns a mask of `region` as a mask of the whole image, [height, width]."""
        width, height = self.size
        whole_mask = np.zeros((height, width), dtype=bool)
        x, y, w, h = self.region
        left, top, right, bottom = max(x, 0), max(y, 0), min(x + w, width), min(y + h, height)
        if left < right and top < bottom:
            whole_mask[top:bottom, left:right] = mask[top - y : bottom - y, left - x : right - x]
        return whole_mask


def join_labels(labels: Sequence[Label], name: str) -> Label:
    """Returns one label for the parts of an object: the union of the masks, under a new name.

    All other values, such as the id and the oriented box, come from the first part.
    """
    first = labels[0]
    left, top = (min(item.region[axis] for item in labels) for axis in (0, 1))
    right, bottom = (max(item.region[axis] + item.region[axis + 2] for item in labels) for axis in (0, 1))
    amodal, visible = np.zeros((2, bottom - top, right - left), bool)
    for item in labels:
        x, y, width, height = item.region
        part = np.s_[y - top : y - top + height, x - left : x - left + width]
        amodal[part] |= item.amodal_mask
        visible[part] |= item.visible_mask
    return replace(
        first,
        name=name,
        region=(left, top, right - left, bottom - top),
        amodal_mask=amodal,
        visible_mask=visible,
    )


def label(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None = None,
    *,
    objects: Sequence[int | str] | None = None,
    instance: npt.NDArray[np.int32] | None = None,
    margin: tuple[int, int] | None = None,
    threads: int | None = None,
) -> list[Label]:
    """Returns a label for each of the `objects` with a nonempty amodal mask.

    By default, `objects` are all objects except shadow catchers. `world` and `camera` are as in `render`. Masks
    belong to the exact rays through the pixels' centres. The visible mask comes from the channel `instance`, which is
    rendered if not given; the amodal mask shows each object alone. Amodal masks extend `margin` columns and rows
    beyond the image (default: the image's width and height on every side, as in the BOP toolkit). With a rolling
    shutter, each line has its own time, as in the image; `box3d` belongs to the middle of the exposure. `threads` is
    the number of threads (default: all).

    Raises `SettingsError` for unknown objects, and if `instance` does not have the image's size.
    """
    world = world_of(world)
    camera = camera_of(world, camera)
    known = world.objects
    names = world.categories
    ids = {name: number for number, name in names.items()}
    wanted = (
        [item.id for item in known if not item.shadow_catcher]
        if objects is None
        else [_number(known, one) for one in several("objects", objects, "ids or names")]
    )
    width, height = camera.size
    if instance is None:
        instance = render(world, camera, integrator="flat", samples=1, channels="instance", threads=threads)[
            "instance"
        ]
    instance = numbers("instance", instance)
    if instance.shape != (height, width) or instance.dtype.kind not in "iu":
        raise SettingsError(
            f"instance has the shape {list(instance.shape)} and the dtype {instance.dtype}; expected whole numbers "
            f"{[height, width]}, the size of the camera's image",
            code="wrong_shape",
        )
    columns, rows = (width, height) if margin is None else wholes("margin", margin, 0, 1 << 16, count=2)
    found = []
    silhouettes = _core.silhouettes(world._core, camera._core, wanted, (columns, rows), thread_count(threads))
    boxes = _boxes(world, [number for number, _, _ in silhouettes])
    for (number, (x, y, w, h), amodal), box in zip(silhouettes, boxes, strict=True):
        visible = np.zeros_like(amodal)
        left, top, right, bottom = max(x, 0), max(y, 0), min(x + w, width), min(y + h, height)
        if left < right and top < bottom:
            visible[top - y : bottom - y, left - x : right - x] = instance[top:bottom, left:right] == number
        item = known[number]
        category = -1 if item.category is None else ids[item.category]
        found.append(
            Label(
                number,
                item.name,
                item.category,
                category,
                (x, y, w, h),
                amodal,
                visible,
                box,
                camera.size,
            )
        )
    return found


def _number(known: Sequence[Object], which: int | str) -> int:
    """Converts an object's id or name to its id; raises `SettingsError` for an unknown object."""
    if isinstance(which, str):
        names = {item.name: item.id for item in known}
        return names[one_of("object", which, list(names))]
    return whole("object", which, 0, len(known) - 1)


def box3d(world: World | str | os.PathLike[str], number: int | str) -> Box3D:
    """Returns the oriented box around an object of the world.

    `number` is the object's id or name. Raises `SettingsError` for an unknown object.

    Source: the nearest rotation is the orthogonal polar factor, N. J. Higham, Computing the Polar Decomposition, 1986.
    """
    world = world_of(world)
    return _boxes(world, [_number(world.objects, number)])[0]


def _boxes(world: World, numbers: list[int]) -> list[Box3D]:
    """Returns the oriented boxes around objects of the world, by valid ids."""
    found = _core.oriented_boxes(world._core, numbers)
    return [Box3D(np.array(rotation), np.array(center), np.array(size)) for rotation, center, size in found]
