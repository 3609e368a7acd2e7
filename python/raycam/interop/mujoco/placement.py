"""Moves the objects of a world to the poses of a MuJoCo model's geoms or sites."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import _core
from ...arguments import Floats
from ...world import World
from .model import element_prefix

__all__ = ["RigidPlacement"]


class RigidPlacement:
    """The objects that show geoms, or those that show sites."""

    def __init__(self, kind: int, elements: list[tuple[int, int]]) -> None:
        """Collects the objects whose element has the type `kind` (`mjtObj`).

        `elements` contains the element of each object.
        """
        self._prefix = element_prefix(kind)
        self._numbers = [number for number, (of, _) in enumerate(elements) if of == kind]
        self._elements = np.array([elements[number][1] for number in self._numbers], np.int64)
        self._before: Floats | None = None

    def update(self, world: World, data: Any) -> None:
        """Moves the objects whose poses in `data` differ from the last update."""
        if not len(self._numbers):
            return
        poses = np.empty((len(self._numbers), 3, 4))
        poses[:, :, :3] = getattr(data, f"{self._prefix}_xmat")[self._elements].reshape(-1, 3, 3)
        poses[:, :, 3] = getattr(data, f"{self._prefix}_xpos")[self._elements]
        before = np.full_like(poses, np.nan) if self._before is None else self._before
        moved = np.flatnonzero((poses != before).reshape(len(poses), -1).any(axis=1))
        if not len(moved):
            return
        for i in moved:
            # `World.set_object` would check keys and notices, which takes longer than the change itself.
            _core.world_set_object(world._core, self._numbers[i], {"matrix": poses[i]})
        self._before = poses
