"""The size of images during motion, chosen by the render times of the last images."""

from __future__ import annotations

__all__ = ["Pace"]

TARGET = 0.040  # maximum seconds for a moving image
DIVISORS = (1, 2, 4)  # divisors of the still image's width and height
SMOOTHING = 0.4  # weight of the newest measurement in the running mean
MAX_BYTES = 100_000
"""Target size in bytes of a moving image; at `MAX_MOVING_RATE`, 24 such images are sent per second."""


class Pace:
    """Chooses the next moving image's size.

    The size depends on the time and the bytes of the last moving images.
    """

    def __init__(self) -> None:
        self._seconds_per_pixel: float | None = None
        self._bytes_per_pixel: dict[str, float] = {}

    def begin_like(self, other: Pace) -> None:
        """Copies the measurements of another view of the same world."""
        self._seconds_per_pixel = other._seconds_per_pixel
        self._bytes_per_pixel = dict(other._bytes_per_pixel)

    def size(self, still: tuple[int, int], channel: str = "color") -> tuple[int, int]:
        """Returns the size of the next moving image: the still image's size, a half or a quarter."""
        sizes = [tuple(max(1, round(side / divisor)) for side in still) for divisor in DIVISORS]
        if self._seconds_per_pixel is None:
            return sizes[1][0], sizes[1][1]
        count = self._bytes_per_pixel.get(channel, 0.0)
        for width, height in sizes:
            if width * height * self._seconds_per_pixel <= TARGET and width * height * count <= MAX_BYTES:
                return width, height
        return sizes[-1][0], sizes[-1][1]

    def measured(self, size: tuple[int, int], seconds: float, count: int = 0, channel: str = "color") -> None:
        """Records the render time and the bytes of an image."""
        self._bytes_per_pixel[channel] = count / (size[0] * size[1])
        new = seconds / (size[0] * size[1])
        old = self._seconds_per_pixel
        self._seconds_per_pixel = new if old is None else old + SMOOTHING * (new - old)
