"""Random numbers that depend only on the seed, the frame, the purpose and the pulse."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats

__all__ = ["PulseNumbers", "standard_normals"]

USES = {"distance": 1, "detection": 2, "azimuth": 3, "beam": 4}
"""Uses of random numbers; each has its own stream."""


def _generator(seed: int, frame: int, use: str, echo: int) -> np.random.Generator:
    mask = (1 << 64) - 1
    key = np.array([seed & mask, ((frame & 0xFFFFFFFF) << 32) | (USES[use] << 16) | echo], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key))


def standard_normals(count: int, seed: int, frame: int, use: str, echo: int = 0) -> Floats:
    """Returns one standard normal number per column or pulse of an echo, for one of `USES`."""
    return _generator(seed, frame, use, echo).standard_normal(count)


class PulseNumbers:
    """The random numbers of a frame's pulses.

    Each call returns the numbers of the pulses from `first` (included) to `stop` (excluded). A pulse has the
    same number in every call that includes it. Calls are fastest if their pulses ascend from call to call.
    """

    def __init__(self, seed: int, frame: int) -> None:
        self._seed, self._frame = seed, frame
        self._streams: dict[tuple[str, int], tuple[np.random.Generator, int]] = {}
        """For each use and echo: the generator, and the pulse to which its next number belongs."""

    def normals(self, use: str, echo: int, first: int, stop: int) -> Floats:
        """Returns a standard normal number per pulse, for `use` and `echo`, float64 [stop - first]."""
        return self._stream(use, echo, first, stop, "standard_normal")

    def uniforms(self, use: str, first: int, stop: int) -> Floats:
        """Returns one number from 0 to 1 per pulse, for `use`: float64 [stop - first]."""
        return self._stream(use, 0, first, stop, "random")

    def _stream(self, use: str, echo: int, first: int, stop: int, distribution: str) -> Floats:
        fresh = _generator(self._seed, self._frame, use, echo), 0
        generator, position = self._streams.get((use, echo), fresh)
        if position > first:
            generator, position = fresh
        draw = getattr(generator, distribution)
        draw(first - position)
        self._streams[use, echo] = generator, stop
        numbers: Floats = draw(stop - first)
        return numbers
