"""The fit of a photograph to other photographs of the same surface."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PhotographFit"]


@dataclass(frozen=True)
class PhotographFit:
    """The fit of one photograph to the other photographs."""

    name: str
    """The photograph's name."""
    texels: int
    """The number of texels that the photograph shows."""
    gain: tuple[float, float, float]
    """Factors by which the photograph's linear red, green and blue were divided; 1 with exposure="off"."""
    shift_px: float
    """The photograph's shift relative to the other photographs, as the root mean square over its parts in pixels; NaN
    without overlap.
    """
    disagreement: float
    """Median difference of the photograph's luminance from the other photographs, relative to their luminance; NaN
    without overlap.
    """
