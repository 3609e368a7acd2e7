"""The selected object of a session and its gizmo."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...world import World
from ..client_messages import Gizmo
from .contents import materials_of_object, matrix_of_object, names_of_objects, visibilities
from .edits import Edits, is_animated
from .floor_handle import FLOOR_HANDLE, drag_on_floor, floor_handle
from .gizmo import dragged, handles, middle_of
from .material_edits import describe_material, list_slots
from .overlay import polylines
from .placement import placement_of_matrix
from .sun_handle import center_of_objects, sun_handles, turn_sun
from .textures import list_textures

__all__ = ["Selection"]

OUTLINE_COLOR = "#ff9f1a"
OUTLINE_PIECES = 8
"""Number of pieces of an outline's edge, which a lens bends."""


class Selection:
    """The object selected by a client, its tool, and the current drag."""

    def __init__(self, edits: Edits) -> None:
        self.number = 0
        self.tool = "none"
        self.slot: int | None = 0
        """The selected material slot of the object; None if all slots are selected."""
        self.light: int | None = None
        """The selected light, whose position or direction has handles; None if an object is selected."""
        self._edits = edits
        self._stroke: tuple[object, Floats] = (None, np.eye(4))
        """The drag in progress, and the object's matrix at the beginning of the drag."""
        self._middles: dict[tuple[int, int], Floats] = {}
        self._center: tuple[World | None, Floats] = (None, np.zeros(3))
        """A world and the centre of its objects, around which the handles of suns are drawn."""

    def choose(self, number: int, tool: str, slot: int | None = 0) -> None:
        """Selects an object by its number, and its material slot; clears the selection if the object does not exist."""
        self.number, self.tool, self.slot, self.light = number, tool, slot, None

    def choose_light(self, number: int) -> None:
        """Selects a light by its number instead of an object."""
        self.light = number

    @property
    def world(self) -> World:
        """The edited world."""
        return self._edits.world

    def is_there(self) -> bool:
        """True if the object is in the world."""
        return self.number < self.world._core.object_count

    def about(self) -> dict[str, Any]:
        """The object's properties, materials and textures for the message `selected`."""
        said = {"type": "selected", "number": self.number, "tool": self.tool, "material": {}}
        if self.is_there():
            said["name"] = names_of_objects(self.world)[self.number]
            said["visible"] = visibilities(self.world)[self.number]
            said["slots"] = list_slots(self.world, self.number)
            said["slot_count"] = len(materials_of_object(self.world, self.number))
            said["slot"] = -1 if self.slot is None else self.slot
            said["material"] = describe_material(self.world, self.number, self.slot or 0)
            said["animated"] = is_animated(self.world, self.number)
            said["place"] = placement_of_matrix(matrix_of_object(self.world, self.number), self.world.up)
            said["textures"] = list_textures(self.world, self.number, self.slot or 0)
        return said

    def handles(self, world: World, camera: Camera) -> list[dict[str, Any]]:
        """Returns the outline and the gizmo of the object in `world`.

        Both are lines over an image of `camera`.
        """
        if self.light is not None:
            return self._light_handles(world, camera, self.light)
        if self.tool == "none" or not self.is_there():
            return []
        if self.tool == "outline":
            return self._outline(world, camera)
        if not self._edits.allowed or is_animated(self.world, self.number):
            return []
        return self._outline(world, camera) + handles(
            matrix_of_object(world, self.number), self._middle(), camera, self.tool
        )

    def _light_handles(self, world: World, camera: Camera, number: int) -> list[dict[str, Any]]:
        """Returns the handles that move a light, or turn a sun.

        A light without position and direction has no handles.
        """
        if not self._edits.allowed:
            return []
        place = _place_of_light(world, number)
        direction = _direction_of_sun(world, number)
        if direction is not None:
            return sun_handles(self._center_of(world), direction, camera)
        if place is None:
            return []
        below = floor_handle(world, place[:3, 3], camera)
        return [*below, *handles(place, np.zeros(3), camera, "move")]

    def _outline(self, world: World, camera: Camera) -> list[dict[str, Any]]:
        """The edges of the object's bounds."""
        if not visibilities(world)[self.number]:
            return []
        corners = world.triangles(self.number).reshape(-1, 3)
        corners = corners[np.isfinite(corners).all(axis=1)]
        if not len(corners):
            return []
        low, high = corners.min(axis=0), corners.max(axis=0)
        share = np.linspace(0, 1, OUTLINE_PIECES + 1)[:, None]
        edges = []
        for axis in range(3):
            for corner in range(4):
                begin = low.copy()
                for bit, other in enumerate(each for each in range(3) if each != axis):
                    if corner >> bit & 1:
                        begin[other] = high[other]
                end = begin.copy()
                end[axis] = high[axis]
                edges.append(begin + share * (end - begin))
        lines = polylines(edges, camera)
        return [{"name": "", "color": OUTLINE_COLOR, "thin": True, "lines": lines}] if lines else []

    def drag(self, camera: Camera, message: Gizmo, session: str) -> None:
        """Moves, turns or scales the object by a drag of a handle.

        Raises the errors of `Edits.place_object`.
        """
        stroke = (session, message.stroke)
        if self.light is not None:
            self._drag_light(camera, message, stroke, self.light)
            return
        if self.tool in ("none", "outline") or not self.is_there() or message.handle == FLOOR_HANDLE:
            return
        if stroke != self._stroke[0]:
            self._stroke = (stroke, matrix_of_object(self.world, self.number))
        before = self._stroke[1]
        begin, end = (np.array(place, np.float64) for place in (message.begin, message.end))
        after = dragged(before, self._middle(), camera, self.tool, message.handle, begin, end)
        if np.isfinite(after).all() and abs(np.linalg.det(after[:3, :3])) > 0:
            self._edits.place_object(self.number, after, stroke)

    def _drag_light(self, camera: Camera, message: Gizmo, stroke: object, number: int) -> None:
        """Moves a light or turns a sun by a drag of a handle.

        Raises the errors of `Edits.place_light` and `Edits.turn_light`.
        """
        if _direction_of_sun(self.world, number) is not None:
            self._drag_sun(camera, message, stroke, number)
            return
        place = _place_of_light(self.world, number)
        if place is None:
            return
        if stroke != self._stroke[0]:
            self._stroke = (stroke, place)
        begin, end = (np.array(each, np.float64) for each in (message.begin, message.end))
        before = self._stroke[1]
        if message.handle == FLOOR_HANDLE:
            after = drag_on_floor(self.world, before[:3, 3], camera, begin, end)
        else:
            after = dragged(before, np.zeros(3), camera, "move", message.handle, begin, end)[:3, 3]
        if np.isfinite(after).all():
            self._edits.place_light(number, after, stroke)

    def _drag_sun(self, camera: Camera, message: Gizmo, stroke: object, number: int) -> None:
        """Turns a sun by a drag of a circle; raises the errors of `Edits.turn_light`."""
        if message.handle not in ("x", "y", "z"):
            return
        if stroke != self._stroke[0]:
            self._stroke = (stroke, np.asarray(_direction_of_sun(self.world, number)))
        begin, end = (np.array(each, np.float64) for each in (message.begin, message.end))
        center = self._center_of(self.world)
        after = turn_sun(center, self._stroke[1], camera, message.handle, begin, end)
        if np.isfinite(after).all():
            self._edits.turn_light(number, after, stroke)

    def _center_of(self, world: World) -> Floats:
        """The centre of a world's objects, which is computed once for each world."""
        if self._center[0] is not world:
            self._center = (world, center_of_objects(world))
        return self._center[1]

    def _middle(self) -> Floats:
        """The centre of the object in its mesh's coordinates, which edits do not change."""
        key = (self.number, self.world.counts["triangles"])
        if key not in self._middles:
            self._middles[key] = middle_of(self.world, self.number)
        return self._middles[key]


def _place_of_light(world: World, number: int) -> Floats | None:
    """Returns the translation [4, 4] to a light's position.

    The result is None if the light does not exist or has no position.
    """
    lights = world.lights
    position = lights[number].get("position") if number < len(lights) else None
    if position is None:
        return None
    place = np.eye(4)
    place[:3, 3] = position
    return place


def _direction_of_sun(world: World, number: int) -> Floats | None:
    """The direction [3] of a sun's light; None if the light does not exist or is not a sun."""
    lights = world.lights
    if number >= len(lights) or lights[number].get("type") != "sun":
        return None
    return np.asarray(lights[number]["direction"], float)
