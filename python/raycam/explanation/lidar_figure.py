"""Draws the figure of a lidar's beam.

The figure shows the beam's sub-rays with the surfaces, and the waveform with echoes and threshold.
"""

from __future__ import annotations

import math

import numpy as np

from .digits import number
from .lidar_steps import BeamSteps
from .svg import Svg

__all__ = ["beam_figure"]

INK, FAINT, RULE, THRESHOLD = "#1d2330", "#69707f", "#d9dce3", "#d9381e"
COLORS = ("#2456c8", "#e08a00", "#3f7d20", "#8e3ab5", "#0b7a75", "#b0306a")
WIDTH, HEIGHT, MARGIN = 1000.0, 620.0, 60.0
BEAM = (90.0, 290.0)
"""Top and bottom of the drawing of the beam."""
WAVE = (360.0, 560.0)
"""Top and bottom of the waveform."""
POINTS = 900


def beam_figure(e: BeamSteps) -> str:
    """Returns the figure as SVG text.

    Distances run to the right; heights across the beam are enlarged.
    """
    svg = Svg(WIDTH, HEIGHT)
    svg.rectangle(0, 0, WIDTH, HEIGHT, "#ffffff")
    svg.text((MARGIN, 34), f"Pulse {e.firing} of {e.lidar.title}, ring {e.ring}", 19, INK, bold=True)
    reach = max([*e.length.tolist(), *e.echo_length.tolist(), 1.0]) * 1.08
    colors = {name: COLORS[i % len(COLORS)] for i, name in enumerate(dict.fromkeys(e.names))}
    _beam(svg, e, reach, colors)
    _waveform(svg, e, reach)
    x = MARGIN
    for name, color in colors.items():
        svg.dot((x + 5, HEIGHT - 18), 5, color)
        svg.text((x + 16, HEIGHT - 13), name, 13, INK)
        x += 34 + 7.5 * len(name)
    return svg.text_of()


def _across(reach: float, distance: float) -> float:
    """Returns the x coordinate in the figure for a distance along the beam."""
    return MARGIN + (WIDTH - 2 * MARGIN) * distance / reach


def _beam(svg: Svg, e: BeamSteps, reach: float, colors: dict[str, str]) -> None:
    """Draws the sub-rays from the sensor to the surfaces.

    Sub-rays via mirrors and glass are drawn along the beam's axis.
    """
    top, bottom = BEAM
    middle = (top + bottom) / 2
    offsets = np.where(np.isfinite(e.offset), e.offset, 0.0)
    largest = float(np.abs(offsets).max(initial=0.0))
    scale = (bottom - top) / 2 / largest if largest > 0.0 else 0.0
    svg.text((MARGIN, top - 20), "Sub-rays and the surfaces that they meet", 14, FAINT)
    if largest > 0.0:
        text = f"largest distance from the axis: {number(1e3 * largest, 3)} mm"
        svg.text((WIDTH - MARGIN, top - 20), text, 13, FAINT, anchor="end")
    svg.line((MARGIN, middle), (WIDTH - MARGIN, middle), RULE, 1, "4 4")
    most = float(e.energy.max(initial=0.0))
    for row in np.argsort(-e.energy, kind="stable").tolist():
        end = (_across(reach, float(e.length[row])), middle - scale * float(offsets[row]))
        dash = "5 4" if e.bounces[row] else ""
        svg.line((MARGIN, middle), end, colors[e.names[row]], 1.2, dash, 0.5)
        share = math.sqrt(float(e.energy[row]) / most) if most > 0.0 else 0.0
        svg.dot(end, 2.5 + 4.5 * share, colors[e.names[row]], "#ffffff", 1)
    svg.dot((MARGIN, middle), 6, INK)
    if not len(e.ray):
        svg.text(
            (WIDTH / 2, middle - 10), "No surface in the beam returns light.", 14, FAINT, anchor="middle"
        )


def _waveform(svg: Svg, e: BeamSteps, reach: float) -> None:
    """Draws the waveform over the distance, with the echoes and the threshold."""
    top, bottom = WAVE
    svg.text((MARGIN, top - 20), "Returned energy over distance, and the echoes", 14, FAINT)
    distances = np.unique(np.concatenate([np.linspace(0.0, reach, POINTS), *_around(e)]))
    heights = e.waveform(distances)
    highest = float(heights.max(initial=0.0))
    limit = e.threshold
    most = max(highest, min(limit or 0.0, 2.0 * highest) if highest > 0.0 else limit or 0.0) * 1.1 or 1.0

    def place(distance: float, height: float) -> tuple[float, float]:
        return _across(reach, distance), bottom - (bottom - top) * min(height / most, 1.0)

    svg.polyline([place(x, y) for x, y in zip(distances.tolist(), heights.tolist(), strict=True)], INK, 1.6)
    svg.line((MARGIN, bottom), (WIDTH - MARGIN, bottom), FAINT, 1)
    _ticks(svg, reach, bottom)
    if limit is not None:
        beyond = limit > most
        y = place(0.0, limit)[1]
        svg.line((MARGIN, y), (WIDTH - MARGIN, y), THRESHOLD, 1.2, "6 4")
        text = f"threshold: E = {number(limit, 3)}{' (above the drawing)' if beyond else ''}"
        svg.text((WIDTH - MARGIN, y - 6), text, 12, THRESHOLD, anchor="end", halo=True)
    for length, reason in zip(e.echo_length.tolist(), e.lost, strict=True):
        x, y = place(length, float(e.waveform([length])[0]))
        svg.dot((x, y), 4.5, INK if reason == "kept" else "#ffffff", INK)
        label = f"{number(length, 5)} m" + ("" if reason == "kept" else f": {reason}")
        anchor = "end" if x > WIDTH - 220 else "start"
        svg.text(
            (x + (8 if anchor == "start" else -8), max(y - 8, top - 2)),
            label,
            12,
            INK,
            anchor=anchor,
            halo=True,
        )


def _around(e: BeamSteps) -> list[np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Returns the distances around each echo at which the waveform is drawn.

    Other distances are not drawn, because a pulse is narrow compared with the figure.
    """
    steps = np.linspace(-4.0, 4.0, 41) * e.sigma
    return [np.maximum(length + steps, 0.0) for length in e.echo_length.tolist()]


def _ticks(svg: Svg, reach: float, y: float) -> None:
    """Draws labels in metres along the axis."""
    rough = reach / 6
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough)
    for i in range(int(reach / step) + 1):
        x = _across(reach, i * step)
        svg.line((x, y), (x, y + 5), FAINT, 1)
        svg.text((x, y + 19), f"{number(i * step, 4)} m", 12, FAINT, anchor="middle")
