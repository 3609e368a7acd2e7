"""The views of the images that were sent last, which a client may still show."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from .view import View

__all__ = ["MAX_SENT_VIEWS", "Pixel", "SentViews"]

MAX_SENT_VIEWS = 32
"""Maximum number of stored views. Requests about an older image, which a slow client may show, are out of date."""
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
        self.newest = (0, -1)
        """The number and the version of the newest image; (0, -1) before the first image."""
        self.camera = 0
        """The number of the first image with the newest image's camera."""
        self._views: dict[int, View] = {}

    def add(self, view: View, version: int) -> int:
        """Stores the view of an image that is sent, and returns the image's number.

        The views of a world that is no longer shown are dropped.
        """
        newest, newest_version = self.newest
        before = self.find(newest)
        number = newest if version == newest_version else next(NUMBERS)
        if before is None or view.camera != before.camera:
            self.camera = number
        kept = [
            (each, sent)
            for each, sent in self._views.items()
            if each != number and sent.opened.edits is view.opened.edits
        ]
        self._views = dict([*kept, (number, view)][-MAX_SENT_VIEWS:])
        self.newest = (number, version)
        return number

    def find(self, number: int) -> View | None:
        """The view of an image; None if the image is older than the stored views."""
        return self._views.get(number)
