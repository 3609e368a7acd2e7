"""The chosen object of a session and its gizmo."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...world import World
from ..client_messages import Gizmo
from .contents import matrix_of_object, names_of_objects, visibilities
from .edits import Edits, material
from .gizmo import dragged, handles, middle_of

__all__ = ["Selection"]


class Selection:
    """The object that a client has chosen, the tool on it, and the drag that is under way."""

    def __init__(self, edits: Edits) -> None:
        self.number = 0
        self.tool = "none"
        self._edits = edits
        self._stroke: tuple[object, Floats] = (None, np.eye(4))
        """The drag, and the object's matrix at its begin."""
        self._middles: dict[tuple[int, int], Floats] = {}

    def choose(self, number: int, tool: str) -> None:
        """Chooses an object by its number; one that is not there is none."""
        self.number, self.tool = number, tool

    @property
    def world(self) -> World:
        """The world that is edited."""
        return self._edits.world

    def is_there(self) -> bool:
        """True if the object is in the world."""
        return self.number < self.world._core.object_count

    def about(self) -> dict[str, Any]:
        """Name and material of the object, as the message `selected` has them."""
        said = {"type": "selected", "number": self.number, "tool": self.tool, "material": {}}
        if self.is_there():
            said["name"] = names_of_objects(self.world)[self.number]
            said["visible"] = visibilities(self.world)[self.number]
            said["material"] = material(self.world, self.number)
        return said

    def handles(self, world: World, camera: Camera) -> list[dict[str, Any]]:
        """The gizmo over a picture of `camera`, on the object where it is in `world`."""
        if self.tool == "none" or not self._edits.allowed or not self.is_there():
            return []
        return handles(matrix_of_object(world, self.number), self._middle(), camera, self.tool)

    def drag(self, camera: Camera, message: Gizmo, session: str) -> None:
        """Moves, turns or scales the object as a drag of a handle requires. Raises `WorldError`."""
        if self.tool == "none" or not self.is_there():
            return
        stroke = (session, message.stroke)
        if stroke != self._stroke[0]:
            self._stroke = (stroke, matrix_of_object(self.world, self.number))
        before = self._stroke[1]
        begin, end = (np.array(place, np.float64) for place in (message.begin, message.end))
        after = dragged(before, self._middle(), camera, self.tool, message.handle, begin, end)
        if np.isfinite(after).all() and abs(np.linalg.det(after[:3, :3])) > 0:
            self._edits.place_object(self.number, after, stroke)

    def _middle(self) -> Floats:
        """The middle of the object in its mesh, which edits leave as it is."""
        key = (self.number, self.world.counts["triangles"])
        if key not in self._middles:
            self._middles[key] = middle_of(self.world, self.number)
        return self._middles[key]
