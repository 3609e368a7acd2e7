"""Edits of objects and lights in a view, with undo and redo.

Each edit creates a world that shares acceleration structures with the previous world, which undo restores. Worlds kept
for undo are copies without their own acceleration structures.
"""

from __future__ import annotations

import itertools
import math
import threading
import weakref
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from ...arguments import Floats, real
from ...camera import Camera
from ...errors import SettingsError, WorldError
from ...notices import collected
from ...world import World
from ...world.load import with_up_axis
from .contents import check_object, matrix_of_object, names_of_objects, visibilities
from .gizmo import middle_of, placed
from .light_edits import describe_light, edit_light
from .material_edits import edit_material
from .placement import matrix_of_placement, placement_of_matrix

__all__ = ["READ_ONLY", "Edits", "edited", "is_animated", "next_step_number"]

MOST_STEPS = 100
"""Maximum number of steps that can be undone."""
MOST_LISTED = 1000
"""Maximum number of objects and of lights listed by name."""
READ_ONLY = "this view is read-only, because it was started with edit=False; start it with edit=True"


next_step_number = itertools.count().__next__
"""Returns ascending numbers for steps of undo, in all views of this process."""


class Listener(Protocol):
    """A session that shows the world."""

    def rebase(self) -> None:
        """Shows the current world."""


class Edits:
    """The world that all sessions share, and the worlds for undo and redo."""

    def __init__(self, world: World, *, allowed: bool = True) -> None:
        self.world = world
        self.lock = threading.RLock()
        """Held while the world is replaced, and while a session starts with the world and begins to listen."""
        self._opened = world
        self.file_up = world.up
        """The up axis of the world before all edits."""
        self.allowed = allowed
        self._before: list[tuple[int, World]] = []
        self._after: list[tuple[int, World]] = []
        self._listeners: weakref.WeakSet[Any] = weakref.WeakSet()
        self._stroke: object = None

    @property
    def opened(self) -> World:
        """The world before all edits, with the current up axis."""
        if self._opened.up != self.world.up:
            self._opened = with_up_axis(self._opened, self.world.up)
        return self._opened

    def listen(self, listener: Listener) -> None:
        """Notifies `listener` of each change until it is garbage-collected."""
        with self.lock:
            self._listeners.add(listener)

    def forget(self, listener: Listener) -> None:
        """Stops notifying `listener`."""
        with self.lock:
            self._listeners.discard(listener)

    def edit(self, kind: str, number: int, key: str, value: Any) -> None:
        """Changes an object or a light.

        Raises `WorldError` for a change that is not possible; the world is then unchanged.
        """
        self._show_edited(lambda world: edited(world, kind, number, key, value))

    def edit_material(self, number: int, slot: int | None, key: str, value: Any) -> None:
        """Changes the material in a slot of an object; if `slot` is None, the materials in all slots.

        Raises `WorldError` and `SettingsError` for a change that is not possible; the world is then unchanged.
        """
        self._show_edited(lambda world: edit_material(world, number, slot, key, value))

    def place_object(self, number: int, matrix: Floats, stroke: object) -> None:
        """Sets an object's matrix; the changes of one drag are one undo step.

        Raises `WorldError` if an animation moves the object, and for an invalid matrix.
        """

        def place(world: World) -> None:
            if stroke != self._stroke:
                _require_placeable(world, number)
            world.set_object(number, matrix=matrix)

        self.change(place, stroke)

    def place_light(self, number: int, position: Floats, stroke: object) -> None:
        """Sets a light's position; the changes of one drag are one undo step.

        Raises `WorldError` for an unknown light and for a light without a position.
        """
        self._show_edited(lambda world: edit_light(world, number, "position", position.tolist()), stroke)

    def turn_light(self, number: int, direction: Floats, stroke: object) -> None:
        """Sets a light's direction; the changes of one drag are one undo step.

        Raises `WorldError` for an unknown light and for a light without a direction.
        """
        self._show_edited(lambda world: edit_light(world, number, "direction", direction.tolist()), stroke)

    def set_up(self, axis: str) -> None:
        """Sets the world's up axis, as an edit that can be undone."""
        self._show_edited(lambda world: with_up_axis(world, axis))

    def keep_camera(self, camera: Camera, name: str) -> str:
        """Adds a camera to the world, as an edit that can be undone; returns its name, which is new."""
        taken = self.world.cameras
        base = name or "view"
        own = next(each for i in itertools.count() if (each := f"{base} {i}" if i else base) not in taken)
        self.change(lambda world: world.add_camera(camera, own))
        return own

    def remove_camera(self, name: str) -> None:
        """Removes a camera of the world, as an edit that can be undone.

        Raises `WorldError` for an unknown camera.
        """
        self.change(lambda world: world.remove_camera(name))

    def change(self, function: Callable[[World], object], stroke: object = None) -> None:
        """Calls `function` with a copy of the world and shows the copy.

        Changes with the same `stroke` are one undo step.

        Raises the errors of `function` (the world is then unchanged) and `SettingsError` in a read-only view.
        """

        def edit(world: World) -> World:
            changed = world.copy()
            function(changed)
            return changed

        self._show_edited(edit, stroke)

    def _show_edited(self, edit: Callable[[World], World], stroke: object = None) -> None:
        """Shows the world that `edit` returns for the current world, as `change` does."""
        if not self.allowed:
            raise SettingsError(READ_ONLY, code="read_only")
        changed = edit(self.world)
        if stroke is not None and stroke == self._stroke:
            self._show(changed)
        else:
            self.replace(changed)
            self._stroke = stroke

    def replace(self, world: World) -> None:
        """Shows another world, as an edit that can be undone."""
        self._stroke = None
        self._before = [*self._before[-MOST_STEPS + 1 :], (next_step_number(), self.world.copy())]
        self._after = []
        self._show(world)

    def reload(self, world: World) -> int:
        """Shows the world of a changed file; returns the number of discarded edits.

        One undo restores these edits.
        """
        count = len(self._before)
        self._stroke = None
        self._before = [(next_step_number(), self.world.copy())] if count else []
        self._after = []
        self._opened, self.file_up = world, world.up
        self._show(world)
        return count

    def undo(self) -> None:
        """Undoes one edit; raises `WorldError` if there is no edit to undo."""
        if not self._before:
            raise WorldError("there is nothing to undo", code="nothing_to_undo")
        self._stroke = None
        number, world = self._before.pop()
        self._after.append((number, self.world.copy()))
        self._show(world)

    def redo(self) -> None:
        """Redoes one edit; raises `WorldError` at the last world."""
        if not self._after:
            raise WorldError("there is nothing to redo", code="nothing_to_undo")
        self._stroke = None
        number, world = self._after.pop()
        self._before.append((number, self.world.copy()))
        self._show(world)

    @property
    def undo_number(self) -> int:
        """The number of the step that `undo` undoes; -1 if there is no step."""
        return self._before[-1][0] if self._before else -1

    @property
    def redo_number(self) -> float:
        """The number of the step that `redo` repeats; infinity if there is no step."""
        return self._after[-1][0] if self._after else math.inf

    def _show(self, world: World) -> None:
        with self.lock:
            self.world = world
            listeners = list(self._listeners)
        for listener in listeners:
            listener.rebase()

    def about(self) -> dict[str, Any]:
        """The editable contents for the message `contents`.

        These are the first objects and lights, and the total numbers of objects and lights.
        """
        shown = list(zip(names_of_objects(self.world), visibilities(self.world), strict=True))
        lights = self.world.lights
        return {
            "type": "contents",
            "editable": self.allowed,
            "undo": len(self._before),
            "redo": len(self._after),
            "objects": [{"name": name, "visible": seen} for name, seen in shown[:MOST_LISTED]],
            "lights": [describe_light(each, number) for number, each in enumerate(lights[:MOST_LISTED])],
            "counts": [len(shown), len(lights)],
        }


def edited(world: World, kind: str, number: int, key: str, value: Any) -> World:
    """Returns a copy of a world with a changed object or light.

    Keys of objects: `visible` (bool), `isolate` (True hides all others, False shows all), `move` (metres [3]), `turn`
    (degrees about up) and `scale` (a factor), around the centre of its mesh. `place` is an index and a value in the
    object's placement: location, roll, pitch, yaw in degrees, scales. `edit_light` describes the keys of lights.
    Raises `WorldError` if the change is not possible, for example if an animation moves the object, and
    `SettingsError` for an invalid value.
    """
    if kind == "light":
        return edit_light(world, number, key, value)
    check_object(world, number)
    changed = world.copy()
    if key == "visible" and isinstance(value, bool):
        changed.set_object(number, visible=value)
    elif key == "isolate" and isinstance(value, bool):
        for other in range(world._core.object_count):
            changed.set_object(other, visible=other == number or not value)
    elif key in ("move", "turn", "scale"):
        _require_placeable(world, number)
        changed.set_object(number, matrix=_placed(world, number, key, value))
    elif key == "place":
        _require_placeable(world, number)
        changed.set_object(number, matrix=_with_number(world, number, value))
    else:
        raise SettingsError(
            f"object key {key} cannot be set to {str(value)[:80]}: the key is unknown, or the value has a wrong type",
            code="unknown_key",
        )
    return changed


def is_animated(world: World, number: int) -> bool:
    """True if a video or an animation moves the object, so that another pose has no effect."""
    if world.video is None and not world.animations:
        return False
    moved, step = world.copy(), np.eye(4)
    step[:3, 3] = 1.0
    with collected():  # the notice that animations replace the pose concerns only this copy
        moved.set_object(number, matrix=step @ matrix_of_object(world, number))
    before, after = (matrix_of_object(each.at(0.0), number) for each in (world, moved))
    return bool(np.array_equal(before, after))


def _require_placeable(world: World, number: int) -> None:
    """Raises `WorldError` if an animation moves the object."""
    if number < world._core.object_count and is_animated(world, number):
        name = names_of_objects(world)[number] or str(number)
        raise WorldError(
            f"object {name}: cannot be moved, because an animation of the file moves it",
            code="conflicting_values",
        )


def _with_number(world: World, number: int, value: Any) -> Floats:
    """Returns the matrix of an object after one number of its placement is changed.

    Raises `SettingsError` for a malformed value, and `WorldError` for a sheared object.
    """
    if not isinstance(value, list) or len(value) != 2 or value[0] not in range(9):
        raise SettingsError("place: expected an index from 0 to 8 and a number", code="wrong_shape")
    place = placement_of_matrix(matrix_of_object(world, number), world.up)
    if place is None:
        raise WorldError(
            "the object is sheared, so its position, rotation and scale cannot be edited as numbers; drag its handles "
            "instead",
            code="conflicting_values",
        )
    place[int(value[0])] = float(value[1])
    return matrix_of_placement(place, world.up)


def _placed(world: World, number: int, key: str, value: Any) -> Floats:
    """The matrix of an object after it is moved, turned or scaled."""
    matrix = matrix_of_object(world, number)
    step = np.eye(4)
    if key == "move":
        if not isinstance(value, list) or len(value) != 3:
            raise SettingsError("move must be three numbers, in metres", code="wrong_shape")
        step[:3, 3] = value
        return np.asarray(step @ matrix)
    if key == "scale":
        step[:3, :3] *= real(key, value, 1e-6, 1e6, what="a factor")
    else:
        angle = math.radians(real(key, value, what="an angle in degrees"))
        c, s = math.cos(angle), math.sin(angle)
        first, second = (0, 1) if world.up == "z" else (2, 0)
        step[first, first] = step[second, second] = c
        step[first, second], step[second, first] = -s, s
    middle = placed(matrix, middle_of(world, number))
    step[:3, 3] = middle - step[:3, :3] @ middle
    return np.asarray(step @ matrix)
