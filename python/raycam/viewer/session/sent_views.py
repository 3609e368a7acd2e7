"""The views of the images that were sent last, which a client may still show."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from .view import View

__all__ = ["MAX_SENT_VIEWS", "Pixel", "SentViews"]

MAX_SENT_VIEWS = 4
"""Maximum number of stored views: two unacknowledged images, an image that waits, and the image before these."""
NUMBERS = itertools.count(1)
"""The numbers of all images in this process, so that images of different sessions have different numbers."""


@dataclass(frozen=True)
class Pixel:
    """A clicked pixel, and the view of the image in which it was clicked."""

    view: View
    u: int
    v: int


class SentViews:
    """The views of the newest images, by the numbers that these images' messages contain.

    The images of one version show the same camera and world, and have the same number. The render thread calls `add`;
    all threads call `find`.
    """

    def __init__(self) -> None:
        self.number = 0
        """The number of the newest image; 0 before the first image."""
        self.version = -1
        """The version of the newest image."""
        self.camera = 0
        """The number of the first image with the newest image's camera."""
        self._views: dict[int, View] = {}

    def add(self, view: View, version: int) -> int:
        """Stores the view of an image that is sent, and returns the image's number.

        The views of a world that is no longer shown are dropped.
        """
        before = self.find(self.number)
        number = self.number if version == self.version else next(NUMBERS)
        if before is None or view.camera != before.camera:
            self.camera = number
        kept = [
            (each, sent)
            for each, sent in self._views.items()
            if each != number and sent.opened.edits is view.opened.edits
        ]
        self._views = dict([*kept, (number, view)][-MAX_SENT_VIEWS:])
        self.version, self.number = version, number
        return number

    def find(self, number: int) -> View | None:
        """The view of an image; None if the image is older than the stored views."""
        return self._views.get(number)
