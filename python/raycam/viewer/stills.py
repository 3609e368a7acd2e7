"""Still pictures, from coarse to fine: the samples of a view that does not move."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from .._core import Cancel
from ..camera import Camera
from ..render import render
from ..render.frame import CHANNELS, Frame
from ..render.progressive import Progressive
from ..world import World

__all__ = ["COLORS", "SAMPLED", "TRUTH", "FromScratch", "Refinement", "Slices", "refinement", "truth"]

COLORS = ("color", "alpha", "coverage")
"""The channels that get better with samples."""
SAMPLED = (*COLORS, "error")
"""Those, and the estimate of their error, which is asked for alone: it costs samples."""
TRUTH = tuple(name for name in CHANNELS if name not in (*COLORS, "shadow", "error"))
"""The channels of the exact ray through the pixel's centre."""
FIRST, GROWTH = 4, 4
SLICE = 0.03  # seconds that anybody else waits at most
LONGEST_WAIT = 0.5  # seconds until a picture is shown although some of its pixels have no more samples


@dataclass(eq=False)
class Refinement:
    """A picture of a view that gets better with each step, up to `most` samples a pixel."""

    world: World
    camera: Camera
    integrator: str
    most: int
    threads: int | None
    channels: tuple[str, ...] = COLORS
    samples: int = field(default=0, init=False)
    """The samples of all pixels."""

    def refine(self, cancel: Cancel) -> Frame | None:
        """Takes a step; returns a frame where there is one to be shown. Raises `Cancelled`, which loses nothing."""
        raise NotImplementedError

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of `render` and `Progressive` alike, without the number of samples."""
        return {"integrator": self.integrator, "threads": self.threads, "channels": self.channels}


@dataclass(eq=False)
class Slices(Refinement):
    """A refinement by slices of a progressive picture: no sample is thrown away, and nobody waits for long."""

    _picture: Progressive | None = field(default=None, init=False)
    _told: float = field(default_factory=time.monotonic, init=False)

    def refine(self, cancel: Cancel) -> Frame | None:
        """Adds samples for a slice; returns a frame of another number of samples, or of this one after a while."""
        if self.samples >= self.most:
            return None
        if self._picture is None:  # not before: it may have to build a world's trees
            self._picture = Progressive(self.world, self.camera, samples=self.most, **self.settings)
        before = self.samples
        self.samples = self._picture.add_for(SLICE, cancel=cancel)
        now = time.monotonic()
        if self.samples == before and (before == 0 or now - self._told < LONGEST_WAIT):
            return None
        self._told = now
        return self._picture.frame()


class FromScratch(Refinement):
    """A refinement by pictures of 4, 16, 64, ... samples, each from scratch, for a camera with a background."""

    def refine(self, cancel: Cancel) -> Frame | None:
        """The frame of four times as many samples."""
        if self.samples >= self.most:
            return None
        samples = min(self.samples * GROWTH or FIRST, self.most)
        frame = render(self.world, self.camera, samples=samples, cancel=cancel, **self.settings)
        self.samples = samples
        return frame


def refinement(
    world: World,
    camera: Camera,
    integrator: str,
    most: int,
    threads: int | None,
    channels: tuple[str, ...] = COLORS,
) -> Refinement:
    """The refinement of a view, up to `most` samples."""
    made = Slices if camera.background is None else FromScratch
    return made(world, camera, integrator, most, threads, channels)


def truth(world: World, camera: Camera, channels: tuple[str, ...] = TRUTH, **settings: Any) -> Frame:
    """The channels of the exact rays, which do not change with samples."""
    return render(
        world, camera, integrator="flat", samples=1, channels=channels, ambient_occlusion=False, **settings
    )
