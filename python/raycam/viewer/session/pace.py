"""The size of images during motion, chosen by the render times of the last images."""

from __future__ import annotations

__all__ = ["Pace"]

TARGET = 0.040  # maximum seconds for a moving image
DIVISORS = (1, 2, 4)  # divisors of the still image's width and height
SLOW_S = 0.5  # seconds for an image of full size, above which an image of half the size is shown first
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
        sizes = _sizes(still)
        if self._seconds_per_pixel is None:
            return sizes[1]
        count = self._bytes_per_pixel.get(channel, 0.0)
        for width, height in sizes:
            if width * height * self._seconds_per_pixel <= TARGET and width * height * count <= MAX_BYTES:
                return width, height
        return sizes[-1]

    def settling_size(
        self, still: tuple[int, int], shown: tuple[int, int], *, reaches_full: bool
    ) -> tuple[int, int] | None:
        """Returns the size of the next image after a moving image and before the still image.

        `shown` is the size of the moving image. If an image of full size is slow, half the size is next. The last of
        these images has full size if `reaches_full` is True. The result is None if no image is due.
        """
        full, half, _ = _sizes(still)
        is_slow = full[0] * full[1] * (self._seconds_per_pixel or 0.0) > SLOW_S
        if is_slow and shown[0] < half[0]:
            return half
        return full if reaches_full and shown != full else None

    def measured(self, size: tuple[int, int], seconds: float, count: int = 0, channel: str = "color") -> None:
        """Records the render time and the bytes of an image."""
        self._bytes_per_pixel[channel] = count / (size[0] * size[1])
        new = seconds / (size[0] * size[1])
        old = self._seconds_per_pixel
        self._seconds_per_pixel = new if old is None else old + SMOOTHING * (new - old)


def _sizes(still: tuple[int, int]) -> list[tuple[int, int]]:
    """The sizes of moving images, the largest first."""
    return [(max(1, round(still[0] / each)), max(1, round(still[1] / each))) for each in DIVISORS]
