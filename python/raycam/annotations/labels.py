"""Labels of what a camera sees: masks, boxes and visible fractions of objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arrays import Bools, Floats, whole
from ..camera import Camera
from ..errors import SettingsError
from ..render import render
from ..world import World

__all__ = ["Box3D", "Label", "box3d", "label"]

Region = tuple[int, int, int, int]


@dataclass(frozen=True)
class Box3D:
    """The smallest box around an object whose edges run along the axes of its mesh.

    Of a sheared object they run along those of the rotation nearest to its transform.
    """

    rotation: Floats
    """world_from_box [3, 3]: its columns are the box's axes."""
    center: Floats
    """Its middle [3] in the world, metres."""
    size: Floats
    """Its full edges [3] along its axes, metres."""

    @property
    def corners(self) -> Floats:
        """Its corners [8, 3] in the world: corner i is at the far end of axis k where bit k of i is set."""
        signs = (np.arange(8)[:, None] >> np.arange(3) & 1) - 0.5
        return self.center + signs * self.size @ self.rotation.T


@dataclass(frozen=True)
class Label:
    """One object in one picture. Boxes are (x, y, width, height) in pixels from the picture's top left corner."""

    object: int
    """Its number in the channel `instance`."""
    name: str
    """Its name in the world."""
    category: str | None
    """Its category in the world."""
    category_id: int
    """The number of its category in the channel `category`, -1 for none."""
    region: Region
    """x, y, width and height of the part of the picture and its margin that the masks show."""
    amodal_mask: Bools
    """Which pixel centres of `region` [height, width] would show it if nothing stood before it."""
    visible_mask: Bools
    """Which of them do show it."""
    box3d: Box3D
    """The box around it in the world."""
    size: tuple[int, int]
    """Width and height of the picture."""

    @property
    def amodal_box(self) -> Region:
        """The smallest box around the amodal mask; it may reach beyond the picture."""
        return self.region

    @cached_property
    def visible_box(self) -> Region | None:
        """The smallest box around the visible mask; None where nothing of it is seen."""
        rows, columns = (np.flatnonzero(self.visible_mask.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        left, top = self.region[0] + int(columns[0]), self.region[1] + int(rows[0])
        return left, top, int(columns[-1] - columns[0]) + 1, int(rows[-1] - rows[0]) + 1

    @cached_property
    def amodal_pixels(self) -> int:
        """How many pixels the amodal mask has, those in the margin included."""
        return int(np.count_nonzero(self.amodal_mask))

    @cached_property
    def visible_pixels(self) -> int:
        """How many pixels show it."""
        return int(np.count_nonzero(self.visible_mask))

    @property
    def visible_fraction(self) -> float:
        """The visible part of the amodal mask: what hides it and the picture's edge both count."""
        return self.visible_pixels / self.amodal_pixels

    @cached_property
    def truncated_fraction(self) -> float:
        """The part of the amodal mask that lies beyond the picture's edge, as far as the margin shows it."""
        return 1.0 - int(np.count_nonzero(self.in_picture(self.amodal_mask))) / self.amodal_pixels

    def in_picture(self, mask: Bools) -> Bools:
        """A mask of `region` as one of the whole picture, [height, width]."""
        width, height = self.size
        whole_mask = np.zeros((height, width), dtype=bool)
        x, y, w, h = self.region
        left, top, right, bottom = max(x, 0), max(y, 0), min(x + w, width), min(y + h, height)
        if left < right and top < bottom:
            whole_mask[top:bottom, left:right] = mask[top - y : bottom - y, left - x : right - x]
        return whole_mask


def label(
    world: World,
    camera: Camera,
    *,
    objects: Sequence[int] | None = None,
    instance: npt.NDArray[np.int32] | None = None,
    margin: tuple[int, int] | None = None,
    threads: int | None = None,
) -> list[Label]:
    """The labels of those of `objects` (default: all) that would be seen if nothing stood before them.

    Masks are of the exact rays through the pixels' centres: the visible ones as in the channel `instance` (which is
    rendered where it is not given), the amodal ones of each object alone. `margin` columns and rows around the picture
    count to the amodal masks (default: as wide and high as the picture on every side, as the BOP toolkit has it). Of a
    world that moves while the camera reads line after line, each line is of its own time, as in the picture; `box3d`
    is of the middle.

    Raises `SettingsError` for objects there are not, and an `instance` that does not have the size of the picture.
    """
    known = world.objects
    names = world.categories
    ids = {name: number for number, name in names.items()}
    wanted = (
        list(range(len(known)))
        if objects is None
        else [whole("object", i, 0, len(known) - 1) for i in objects]
    )
    width, height = camera.size
    if instance is None:
        instance = render(world, camera, integrator="flat", samples=1, channels="instance", threads=threads)[
            "instance"
        ]
    elif instance.shape != (height, width):
        raise SettingsError(
            f"instance has the shape {list(instance.shape)}, expected {[height, width]}: that of the camera's picture"
        )
    space = (
        (width, height)
        if margin is None
        else (whole("margin", margin[0], 0, 1 << 16), whole("margin", margin[1], 0, 1 << 16))
    )
    found = []
    for number, (x, y, w, h), amodal in _core.silhouettes(world._core, camera._core, wanted, space, threads):
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
                box3d(world, number),
                camera.size,
            )
        )
    return found


def box3d(world: World, number: int) -> Box3D:
    """The box around an object in the world; raises `SettingsError` where there is no such object.

    Source: the nearest rotation is the orthogonal polar factor, N. J. Higham, Computing the Polar Decomposition, 1986.
    """
    rotation, center, size = _core.oriented_box(world._core, whole("object", number, 0, 1 << 31))
    return Box3D(np.array(rotation), np.array(center), np.array(size))
