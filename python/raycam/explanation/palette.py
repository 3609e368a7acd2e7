"""Colours of the drawn figures: each symbol's colour in `viewer/client/figure.css`."""

from __future__ import annotations

__all__ = ["BRIGHT", "PALETTE", "SHADES"]

PALETTE = {
    "K": "#a34a00",
    "R": "#1b6e3c",
    "C": "#b0125c",
    "P": "#1f55c4",
    "x": "#c62828",
    "r": "#c62828",
    "t": "#00707a",
    "n": "#7a36c0",
    "a": "#1d4f9c",
    "u": "#7a36c0",
    "L": "#8a5a00",
    "axis": "#6b7180",
    "edge": "#1f5fbf",
}
"""The colour of each symbol and line on a light page."""
BRIGHT = {"P": "#8ab4ff", "r": "#ff8a80", "L": "#ffd166", "axis": "#8d93a1"}
"""The colours on a dark page, for lines over an image."""
SHADES = {"plane": ("#7a36c0", 0x22 / 255), "inside": ("#00707a", 0x2E / 255)}
"""The colour and the opacity of areas on a light page."""
