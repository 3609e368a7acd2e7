"""The fit of a photograph to the others that show the same surface."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PhotographFit"]


@dataclass(frozen=True)
class PhotographFit:
    """The fit of a photograph to the others."""

    name: str
    """The photograph's name."""
    texels: int
    """The number of texels that it shows."""
    gain: tuple[float, float, float]
    """Factors of its linear red, green and blue, by which its colours were divided; 1 with exposure="off"."""
    shift_px: float
    """Its shift relative to the other photographs, the root mean square over its parts in pixels; NaN without
    overlap."""
    disagreement: float
    """Median difference of its luminance from the other photographs, relative to their luminance; NaN without
    overlap."""
