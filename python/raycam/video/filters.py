"""FFmpeg's filters between images and encoders."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from av import VideoFrame

__all__ = ["Filters", "Picture", "as_rate"]

Picture = npt.NDArray[np.uint8]
"""An image [height, width, 3] in 8-bit sRGB, or [height, width, 4] with opacity and unpremultiplied colours."""


def as_rate(fps: float) -> Fraction:
    """Returns the frame rate as the ratio that files store."""
    return Fraction(fps).limit_denominator(10_000)


class Filters:
    """A chain of FFmpeg's filters: images in, frames out.

    `inputs` are the pixel formats and sizes of the first filter's inputs. `chain` are filters with their options.
    """

    def __init__(
        self, rate: Fraction, inputs: list[tuple[str, tuple[int, int]]], chain: list[tuple[str, str]]
    ) -> None:
        """Builds the chain."""
        import av.filter

        graph = av.filter.Graph()
        self._rate = rate
        self._inputs = [
            graph.add_buffer(width=width, height=height, format=av.VideoFormat(name), time_base=1 / rate)
            for name, (width, height) in inputs
        ]
        links = [graph.add(name, options) for name, options in chain] + [graph.add("buffersink")]
        for number, start in enumerate(self._inputs):
            start.link_to(links[0], 0, number)
        for one, next_one in pairwise(links):
            one.link_to(next_one)
        self._out = links[-1]
        graph.configure()
        self._graph = graph
        self._count = 0

    def push(self, picture: Picture) -> list[VideoFrame]:
        """Adds an image; returns the frames that are ready."""
        from av import VideoFrame

        frame = VideoFrame.from_ndarray(picture, format="rgba" if picture.shape[2] == 4 else "rgb24")
        frame.pts, frame.time_base = self._count, 1 / self._rate
        self._count += 1
        self._inputs[0].push(frame)
        return self._ready()

    def set_second(self, frame: VideoFrame) -> None:
        """Sets the only frame of the second input."""
        frame.pts, frame.time_base = 0, 1 / self._rate
        self._inputs[1].push(frame)
        self._inputs[1].push(None)

    def finish(self) -> list[VideoFrame]:
        """Ends the input; returns the remaining frames."""
        self._inputs[0].push(None)
        return self._ready()

    def _ready(self) -> list[VideoFrame]:
        import av

        frames: list[VideoFrame] = []
        while True:
            try:
                frame = self._out.pull()
            except (av.BlockingIOError, av.EOFError):
                return frames
            if not isinstance(frame, av.VideoFrame):  # for mypy: video filters return video frames
                raise TypeError(f"{frame!r} is not an image")
            frames.append(frame)
