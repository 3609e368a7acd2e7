"""Still pictures, from coarse to fine: the samples of a view that does not move."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from ..camera import Camera
from ..render import render
from ..render.frame import CHANNELS, Frame
from ..world import World

__all__ = ["COLORS", "TRUTH", "FromScratch", "Refinement", "truth"]

COLORS = ("color", "alpha", "coverage")
"""The channels that get better with samples."""
TRUTH = tuple(name for name in CHANNELS if name not in (*COLORS, "shadow", "error"))
"""The channels of the exact ray through the pixel's centre."""
FIRST, GROWTH = 4, 4

Progress = Callable[[int, int], object]


class Refinement(Protocol):
    """A picture that gets better with each step."""

    samples: int
    """The samples of the last step."""

    def refine(self, progress: Progress) -> Frame | None:
        """The frame after one more step, or None where it has the samples that were asked for.

        What `progress` raises ends the step, and the refinement stays as it was.
        """


class FromScratch:
    """A refinement by pictures of 4, 16, 64, ... samples, each from scratch: the bytes of `raycam.render`."""

    def __init__(self, world: World, camera: Camera, integrator: str, most: int, threads: int | None) -> None:
        self._world = world
        self._camera = camera
        self._settings: dict[str, Any] = {"integrator": integrator, "threads": threads}
        self._most = most
        self.samples = 0

    def refine(self, progress: Progress) -> Frame | None:
        """The frame of four times as many samples."""
        if self.samples >= self._most:
            return None
        samples = min(self.samples * GROWTH or FIRST, self._most)
        frame = render(
            self._world, self._camera, samples=samples, channels=COLORS, progress=progress, **self._settings
        )
        self.samples = samples
        return frame


def truth(world: World, camera: Camera, channels: tuple[str, ...] = TRUTH, **settings: Any) -> Frame:
    """The channels of the exact rays, which do not change with samples."""
    return render(
        world, camera, integrator="flat", samples=1, channels=channels, ambient_occlusion=False, **settings
    )
