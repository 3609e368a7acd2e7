"""The notice about cameras that do not show the world of a view."""

from __future__ import annotations

from ...photos.placement import placement_notices
from ...world import World

__all__ = ["PlacementCheck"]

MAX_CHECKED = 24
"""Maximum number of cameras that are checked, evenly spaced in the list of cameras."""


class PlacementCheck:
    """Checks that the cameras of a view's world show the world; they may have another up axis or unit."""

    def __init__(self) -> None:
        self.texts: tuple[str, ...] = ()
        """The notices about the world that was checked last."""
        self._world: World | None = None

    def check(self, world: World) -> tuple[str, ...]:
        """Checks a world, unless it is the world of the last call.

        Returns the notices if the previous world had none, and otherwise an empty tuple, so that edits of a misplaced
        world do not repeat them.
        """
        if world is self._world:
            return ()
        self._world, before = world, self.texts
        cameras = list(world.cameras.items())
        step = -(-len(cameras) // MAX_CHECKED) or 1
        found = placement_notices(world, dict(cameras[::step])) if cameras else []
        self.texts = tuple(map(str, found))
        return self.texts if not before else ()
