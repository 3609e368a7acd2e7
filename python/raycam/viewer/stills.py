"""Still images, progressively refined: the samples of a view that does not move."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import Cancel
from ..camera import Camera
from ..render.frame import CHANNELS, PASSES, Frame
from ..render.progressive import Progressive
from ..render.render import render
from ..srgb import LUMINANCE
from ..world import World

__all__ = [
    "COLORS",
    "LIT_CHANNELS",
    "SAMPLED",
    "TRUTH",
    "FromScratch",
    "Refinement",
    "Slices",
    "blended",
    "refinement",
    "shares",
    "truth",
]

COLORS = ("color", "alpha", "coverage")
"""The channels whose noise decreases with more samples."""
SAMPLED = (*COLORS, "error")
"""`COLORS` and the error estimate, which is rendered only on request, because it requires samples."""
LIT_CHANNELS = ("color", "error")
"""The channels that depend on light; the others describe the world without the studio."""
TRUTH = tuple(name for name in CHANNELS if name not in (*COLORS, "shadow", "error", *PASSES))
"""The channels of the exact ray through the pixel's centre."""
FIRST, GROWTH = 4, 4
SHARE_SAMPLES = 64
"""Samples per pixel of alpha and coverage, if they are rendered without light."""
Floats32 = npt.NDArray[np.float32]
SLICE = 0.03  # maximum seconds that other sessions wait
FIRST_WAIT = 0.5  # seconds of sampling until an image is shown although the samples have not doubled
WAIT_GROWTH = 1.4  # factor of FIRST_WAIT after each image, so that a slow refinement sends few images
SHOWING = 0.25  # maximum fraction of the time spent on showing images before the last one


@dataclass(eq=False)
class Refinement:
    """An image of a view that gains samples with each step, up to `most` samples per pixel."""

    world: World
    camera: Camera
    integrator: str
    most: int
    threads: int | None
    channels: tuple[str, ...] = COLORS
    options: dict[str, Any] = field(default_factory=dict)
    """More options of `render`."""
    first: int = 1
    """The samples per pixel of the first still image; earlier images are only for display."""
    samples: int = field(default=0, init=False)
    """The samples per pixel so far."""
    seconds: float = field(default=0.0, init=False)
    """The time that all steps took, in seconds."""
    change: tuple[float, int] | None = field(default=None, init=False)
    """(change, samples): the mean change of the luminance since an earlier image, relative to the mean luminance, and
    the earlier image's number of samples. The earlier image is the newest image with at most half of the current
    samples."""
    _luminances: list[tuple[int, Floats32]] = field(default_factory=list, init=False)

    def step(self, cancel: Cancel) -> Frame | None:
        """Executes a step and measures its time and change; returns a frame or None.

        Raises `Cancelled` when `cancel` is cancelled.
        """
        began = time.perf_counter()
        try:
            frame = self.refine(cancel)
        finally:
            self.seconds += time.perf_counter() - began
        if frame is not None:
            self._compare(frame["color"] @ LUMINANCE)
        return frame

    def _compare(self, luminance: Floats32) -> None:
        """Records an image, and its difference from the image with half as many samples."""
        halves = [each for each in self._luminances if 2 * each[0] <= self.samples]
        if halves:
            samples, before = halves[-1]
            mean = float(np.mean(np.abs(luminance), dtype=np.float64))
            change = float(np.mean(np.abs(luminance - before), dtype=np.float64))
            self.change = (change / mean if mean > 0 else 0.0, samples)
        if not self._luminances or self.samples >= 2 * self._luminances[-1][0]:
            self._luminances = [*self._luminances[-1:], (self.samples, luminance)]

    @property
    def is_early(self) -> bool:
        """True if the image has fewer samples than the first still image."""
        return self.samples < min(self.first, self.most)

    @property
    def rate(self) -> float:
        """The number of samples per second, over all pixels."""
        width, height = self.camera.size
        return self.samples * width * height / self.seconds if self.seconds > 0 else 0.0

    def refine(self, cancel: Cancel) -> Frame | None:
        """Executes a step; returns a frame if one should be shown.

        Raises `Cancelled` when `cancel` is cancelled; no samples are lost.
        """
        raise NotImplementedError

    @property
    def settings(self) -> dict[str, Any]:
        """The settings for `render` and `Progressive`, without the number of samples."""
        return {
            "integrator": self.integrator,
            "threads": self.threads,
            "channels": self.channels,
            **self.options,
        }


@dataclass(eq=False)
class Slices(Refinement):
    """A refinement that adds samples to a progressive image in short time slices.

    No sample is discarded, and delays are short.
    """

    _picture: Progressive | None = field(default=None, init=False)
    _told: int = field(default=0, init=False)
    """The number of samples per pixel of the last returned frame."""
    _given: float | None = field(default=None, init=False)
    """The time at which the last step returned a frame; None if the step shows no frame."""
    _showing: float = field(default=0.0, init=False)
    """Time in seconds for showing the last frame, measured at the next step."""
    _shown: int = field(default=0, init=False)
    """Number of frames since the samples doubled; the time until the next frame grows with this number."""
    _spent: float = field(default=0.0, init=False)
    """Time spent on samples since the last frame, in seconds."""

    def refine(self, cancel: Cancel) -> Frame | None:
        """Adds samples for a slice; returns a frame, or None if no frame is due.

        A frame is due if the samples have doubled or are complete, or after a while.
        """
        if self.samples >= self.most:
            return None
        started = time.monotonic()
        if self._given is not None:
            self._showing, self._given = started - self._given, None
        if self._picture is None:  # the first image may wait for acceleration structures
            self._picture = Progressive(self.world, self.camera, samples=self.most, **self.settings)
        self.samples = self._picture.add_for(SLICE, cancel=cancel)
        self._spent += time.monotonic() - started
        if not self._is_worth_showing():
            return None
        self._shown = 0 if self.samples >= 2 * self._told else self._shown + 1
        frame = self._picture.frame()
        self._told, self._spent, self._given = self.samples, 0.0, time.monotonic()
        return frame

    def _is_worth_showing(self) -> bool:
        """True if a frame is due; too many frames would delay the last frame."""
        if self.samples >= self.most or (self._told == 0 and self.samples > 0):
            return True
        affordable = self._spent >= self._showing / SHOWING
        if self.samples >= 2 * self._told > 0:
            return affordable
        return self._told > 0 and affordable and self._spent >= FIRST_WAIT * WAIT_GROWTH**self._shown


class FromScratch(Refinement):
    """A refinement by images of 4, 16, 64, ... samples, each rendered from scratch.

    This class is used if the camera has a background.
    """

    def refine(self, cancel: Cancel) -> Frame | None:
        """Renders the frame with four times as many samples."""
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
    options: dict[str, Any] | None = None,
    first: int = 1,
) -> Refinement:
    """The refinement of a view, up to `most` samples per pixel.

    `options` are further options of `render`.
    """
    options = options or {}
    made = FromScratch if "background" in options or camera.background is not None else Slices
    return made(world, camera, integrator, most, threads, channels, options, first)


def blended(
    preview: npt.NDArray[np.uint8], image: npt.NDArray[np.uint8], share: float
) -> npt.NDArray[np.uint8]:
    """Returns two sRGB images [h, w, 3] blended, with `image` weighted by `share` (0 to 1).

    sRGB values, unlike radiance, limit the weight of single bright samples.
    """
    mixed = preview + np.float32(share) * (image.astype(np.float32) - preview)
    return np.rint(mixed).astype(np.uint8)


def shares(world: World, camera: Camera, **settings: Any) -> Frame:
    """Returns alpha and coverage of a world, which do not depend on its light."""
    return render(
        world,
        camera,
        integrator="flat",
        samples=SHARE_SAMPLES,
        channels=COLORS[1:],
        ambient_occlusion=False,
        **settings,
    )


def truth(world: World, camera: Camera, channels: tuple[str, ...] = TRUTH, **settings: Any) -> Frame:
    """The channels of the exact rays, which do not change with samples."""
    return render(
        world, camera, integrator="flat", samples=1, channels=channels, ambient_occlusion=False, **settings
    )
