"""The images of a session: images during motion, then a still image.

The still image gets more and more samples.
"""

from __future__ import annotations

import time

from ..._core import Cancel
from ...render.frame import Frame
from ..stills import COLORS, SAMPLED, Refinement, refinement
from .pace import Pace
from .sent_views import SentViews
from .view import View

__all__ = ["DEFAULT_SAMPLES", "Images"]

DEFAULT_SAMPLES = {"direct": 64, "path": 256}
"""Samples per pixel of a finished still image."""


class Images:
    """The shown images of the current version, and the refinement of the still image."""

    def __init__(self, samples: int | None = None, threads: int | None = None) -> None:
        self.threads = threads
        self.pace = Pace()
        self.version = 0
        """Counts the changes of the view; images of older versions are never sent after images of newer versions."""
        self.touched = 0.0
        """The monotonic time of the last change."""
        self.cancel = Cancel()
        """Stops the image that is being rendered for this version."""
        self.still: Frame | None = None
        """The newest image with samples of this version."""
        self.samples = samples
        """The samples per pixel of a finished image; None for `DEFAULT_SAMPLES`."""
        self._refinement: Refinement | None = None
        self._moved = -1
        self.settling_size: tuple[int, int] | None = None
        """The size of the next image before the still image, whose first samples take long; None if none is due."""
        self.preview: Frame | None = None
        """The moving image of this version in full size, which is blended with the first samples."""
        self._shown: tuple[int, str] = (-1, "")
        self.sent = SentViews()

    def restart(self) -> None:
        """Starts a new version; its first image is a moving image: fast, with one sample."""
        self.version += 1
        self.cancel.cancel()
        self.cancel = Cancel()
        self.touched = time.monotonic()
        self._refinement = None
        self.still = self.preview = None

    def delay(self, seconds: float) -> None:
        """Delays the next still image by `seconds`, after a failure."""
        self.touched = time.monotonic() + seconds

    def samples_of(self, view: View) -> int:
        """The samples per pixel with which the still image is finished."""
        return self.samples or DEFAULT_SAMPLES[view.integrator]

    def refinement_of(self, view: View) -> Refinement:
        """The refinement of this version, which is created if necessary."""
        if self._refinement is None:
            self._refinement = refinement(
                view.shown,
                view.still_camera,
                view.integrator,
                self.samples_of(view),
                self.threads,
                self._channels(view),
                {**view.render_options, **view.look.behind},
                view.look.first_samples,
            )
        return self._refinement

    @staticmethod
    def _channels(view: View) -> tuple[str, ...]:
        """The channels of a still image; with a look, coverage and alpha exclude the look's floor."""
        if view.channel == "error":
            return SAMPLED
        return COLORS if view.shown is view.world else ("color",)

    @property
    def progress(self) -> Refinement | None:
        """The refinement of this version, if one has started."""
        return self._refinement

    def keep_still(self, version: int, frame: Frame) -> bool:
        """Stores a still image, unless its version is out of date.

        Returns True if the image was stored.
        """
        if version != self.version:
            return False
        self.still = frame
        return True

    @property
    def is_moving(self) -> bool:
        """True if no image of this version was shown yet."""
        return self._moved != self.version

    def mark_moved(self, version: int, settling_size: tuple[int, int] | None = None) -> None:
        """Records that a moving image of a version was sent.

        The moving image is followed by an image of `settling_size` (width, height), unless `settling_size` is
        None.
        """
        self._moved = version
        self.settling_size = settling_size

    def keep_preview(self, version: int, frame: Frame) -> None:
        """Stores a moving image of full size, unless its version is out of date."""
        if version == self.version:
            self.preview = frame

    def is_shown(self, channel: str | None = None) -> bool:
        """True if a still image of this version was sent: of `channel`, or of any channel."""
        return self._shown[0] == self.version and channel in (None, self._shown[1])

    def mark_shown(self, version: int, channel: str) -> None:
        """Records that a still image of a version was sent."""
        self._shown = (version, channel)

    def show_moving_again(self) -> None:
        """Marks the images as not sent, because the exposure or the view transform has changed.

        The moving image is sent again only if there is no still image yet.
        """
        self._shown = (-1, "")
        if self.still is None:
            self._moved = -1

    def show_again(self) -> None:
        """Sends the still image again: the client chose another channel, or reconnected."""
        self._shown = (-1, "")
