"""The notice that a view shows if the world's cameras do not show the world."""

from __future__ import annotations

from ...photos.placement import placement_notices
from ...world import World

__all__ = ["Misplaced"]

MAX_CHECKED = 24
"""Maximum number of cameras that are checked, evenly spaced in the list of cameras."""


class Misplaced:
    """The notices about the cameras of the world that is shown, which may have other axes or units than its objects."""

    def __init__(self) -> None:
        self.texts: tuple[str, ...] = ()
        self._world: World | None = None

    def check(self, world: World) -> tuple[str, ...]:
        """Checks a world, unless it is the world of the last call; returns the notices that are new."""
        if world is self._world:
            return ()
        self._world, before = world, self.texts
        cameras = list(world.cameras.items())
        step = -(-len(cameras) // MAX_CHECKED) or 1
        found = placement_notices(world, dict(cameras[::step])) if cameras else []
        self.texts = tuple(map(str, found))
        return self.texts if not before else ()
