"""Registry of job kinds: for each kind, the function that makes the frames of a package.

A module registers its kind when it is imported. A worker in another process receives only the kind's name, so
`frame_maker` imports the module that registers it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ..errors import JobError, Notice, nearest
from ..io.temp_stream import Piece
from ..world import World

__all__ = ["KINDS", "FrameMaker", "FrameMakerFactory", "Progress", "frame_maker", "register"]

Progress = Callable[[int, int], object]
FrameMaker = Callable[[int, Progress | None], tuple[Mapping[str, bytes | Iterable[Piece]], list[Notice]]]
"""`make(number, progress)` returns the files of a frame by name, and notices.

A file is bytes or, if it is large, an iterator of pieces. `progress` goes to `raycam.render`, where an
exception from it stops the frame.
"""
FrameMakerFactory = Callable[[World, Mapping[str, Any], int | None], FrameMaker]
"""`factory(world, settings, threads)` returns the `FrameMaker` of a package."""

MODULES = {
    "picture": "raycam.jobs.tiled_picture",
    "video": "raycam.video",
    "dataset": "raycam.dataset.job_units",
}
"""Kinds of raycam and the modules that register them."""

KINDS: dict[str, FrameMakerFactory] = {}
"""Registered kinds by name."""


def register(kind: str, factory: FrameMakerFactory) -> None:
    """Registers a kind of job: its name, and the factory of its frame maker."""
    KINDS[kind] = factory


def frame_maker(kind: str, world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
    """Returns the function that makes the frames of a package.

    Raises `JobError` for an unknown kind.
    """
    if kind not in KINDS and kind in MODULES:
        importlib.import_module(MODULES[kind])
    if kind not in KINDS:
        raise JobError(nearest("kind of job", kind, list(MODULES | KINDS)), code="unknown_name")
    return KINDS[kind](world, settings, threads)
