"""Drawings as SVG 1.1 text: lines, arrows, dots, images, and labels placed without overlaps."""

from __future__ import annotations

import base64
import html
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Point = Sequence[float] | npt.NDArray[np.float64]

SANS = "Helvetica, Arial, 'DejaVu Sans', sans-serif"
SERIF = "Georgia, 'DejaVu Serif', 'Times New Roman', serif"
MONO = "Menlo, Consolas, 'DejaVu Sans Mono', monospace"
NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not allow, not even escaped."""


def escape(text: str) -> str:
    """Escapes a text for XML; characters that XML does not allow become U+FFFD."""
    return html.escape(NOT_IN_XML.sub("\ufffd", text))


@dataclass(frozen=True)
class Label:
    """A text next to a point, preferably in the direction (dx, dy)."""

    at: Point
    text: str
    color: str
    towards: Point


@dataclass
class Svg:
    """A drawing with a width and a height in pixels; x points right, y down."""

    width: float
    height: float
    parts: list[str] = field(default_factory=list)

    def text_of(self) -> str:
        """The SVG file as text; narrower notebook cells scale it down."""
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
            f'width="{_n(self.width)}" height="{_n(self.height)}" '
            f'viewBox="0 0 {_n(self.width)} {_n(self.height)}" style="max-width: 100%; height: auto">\n'
            + "\n".join(self.parts)
            + "\n</svg>\n"
        )

    def rectangle(
        self, x: float, y: float, width: float, height: float, fill: str, stroke: str = "none"
    ) -> None:
        """Adds a rectangle, with slightly rounded corners if it has a stroke."""
        corner = 0 if stroke == "none" else 6
        self.parts.append(
            f'<rect x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}" rx="{corner}" '
            f'fill="{fill}" stroke="{stroke}"/>'
        )

    def line(
        self, p: Point, q: Point, color: str, width: float = 1.5, dash: str = "", opacity: float = 1.0
    ) -> None:
        """Draws a straight line with round ends; `dash` is as in stroke-dasharray."""
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        faint = f' opacity="{_n(opacity)}"' if opacity < 1 else ""
        self.parts.append(
            f'<line x1="{_n(p[0])}" y1="{_n(p[1])}" x2="{_n(q[0])}" y2="{_n(q[1])}" stroke="{color}" '
            f'stroke-width="{_n(width)}" stroke-linecap="round"{dashes}{faint}/>'
        )

    def arrow(self, p: Point, q: Point, color: str, width: float = 2.0, dash: str = "") -> None:
        """Draws a line from p to q with an arrowhead at q, which is smaller for short arrows."""
        dx, dy = q[0] - p[0], q[1] - p[1]
        length = math.hypot(dx, dy)
        if length < 1e-6:
            return
        head = min(5 * width, length / 2)
        dx, dy = dx / length * head, dy / length * head
        neck = (q[0] - dx, q[1] - dy)
        self.line(p, (q[0] - dx * 0.6, q[1] - dy * 0.6), color, width, dash)
        side = (-dy * 0.36, dx * 0.36)
        self.polygon(
            [q, (neck[0] + side[0], neck[1] + side[1]), (neck[0] - side[0], neck[1] - side[1])], color
        )

    def polyline(self, points: Sequence[Point], color: str, width: float, dash: str = "") -> None:
        """Draws straight lines from point to point with round ends; `dash` is as in `line`."""
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        places = " ".join(f"{_n(x)},{_n(y)}" for x, y in points)
        self.parts.append(
            f'<polyline points="{places}" fill="none" stroke="{color}" stroke-width="{_n(width)}" '
            f'stroke-linecap="round" stroke-linejoin="round"{dashes}/>'
        )

    def polygon(
        self,
        points: Sequence[Point],
        fill: str,
        opacity: float = 1.0,
        stroke: str = "none",
        width: float = 1.0,
    ) -> None:
        """Draws a filled polygon; `opacity` applies to the fill."""
        corners = " ".join(f"{_n(x)},{_n(y)}" for x, y in points)
        self.parts.append(
            f'<polygon points="{corners}" fill="{fill}" fill-opacity="{_n(opacity)}" stroke="{stroke}" '
            f'stroke-width="{_n(width)}" stroke-linejoin="round"/>'
        )

    def dot(self, p: Point, radius: float, fill: str, stroke: str = "none", width: float = 1.5) -> None:
        """Adds a disc."""
        self.parts.append(
            f'<circle cx="{_n(p[0])}" cy="{_n(p[1])}" r="{_n(radius)}" fill="{fill}" stroke="{stroke}" '
            f'stroke-width="{_n(width)}"/>'
        )

    def text(
        self,
        p: Point,
        text: str,
        size: float = 13,
        color: str = "#1d2330",
        *,
        anchor: str = "start",
        family: str = SANS,
        bold: bool = False,
        italic: bool = False,
        halo: bool = False,
    ) -> None:
        """Draws a line of text whose baseline starts at `p`, or is aligned by `anchor`.

        `halo` adds a white outline.
        """
        style = ' font-weight="bold"' if bold else ""
        style += ' font-style="italic"' if italic else ""
        letters = (
            f'<text x="{_n(p[0])}" y="{_n(p[1])}" font-family="{escape(family)}" font-size="{_n(size)}" '
            f'text-anchor="{anchor}" xml:space="preserve"{style}'
        )
        if (
            halo
        ):  # a separate element, because without support for paint-order the halo would hide the letters
            white = 'fill="#ffffff" stroke="#ffffff" stroke-width="4" stroke-linejoin="round"'
            self.parts.append(f'{letters} {white} aria-hidden="true">{escape(text)}</text>')
        self.parts.append(f'{letters} fill="{color}">{escape(text)}</text>')

    def png(self, x: float, y: float, width: float, height: float, png: bytes, pixelated: bool) -> None:
        """Adds an embedded PNG file."""
        data = base64.b64encode(png).decode("ascii")
        style = ' style="image-rendering:pixelated"' if pixelated else ""
        self.parts.append(
            f'<image x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}" '
            f'preserveAspectRatio="none"{style} xlink:href="data:image/png;base64,{data}"/>'
        )

    def labels(self, labels: Sequence[Label], strokes: Sequence[tuple[Point, Point]], box: Point) -> None:
        """Places every label with as little overlap as possible.

        The labels avoid `strokes` and earlier labels. `box` is (x, y, width, height), within which labels
        should stay.
        """
        ink: list[tuple[float, float]] = [
            (p[0] + (q[0] - p[0]) * i / steps, p[1] + (q[1] - p[1]) * i / steps)
            for p, q in strokes
            for steps in [max(1, int(math.dist(p, q) / 5))]
            for i in range(steps + 1)
        ]
        taken: list[tuple[float, float, float, float]] = []
        for label in labels:
            size = 16.0
            width, height = 0.56 * size * len(label.text), size
            wish = math.atan2(label.towards[1], label.towards[0])

            def label_box(
                angle: float, reach: float, at: Point = label.at, width: float = width, height: float = height
            ) -> tuple[float, float, float, float]:
                # The label's box is outside the circle of radius `reach` around the point, and touches the circle.
                dx, dy = math.cos(angle), math.sin(angle)
                x = at[0] + dx * (reach + width / 2) - width / 2
                y = at[1] + dy * (reach + height / 2) - height / 2
                return x, y, x + width, y + height

            def cost(angle: float, reach: float, wish: float = wish) -> float:
                x0, y0, x1, y1 = label_box(angle, reach)
                hidden = sum(x0 - 2 < x < x1 + 2 and y0 < y < y1 for x, y in ink)
                clash = sum(
                    max(0.0, min(x1, b[2]) - max(x0, b[0])) * max(0.0, min(y1, b[3]) - max(y0, b[1]))
                    for b in taken
                )
                beyond = (
                    max(0.0, box[0] - x0)
                    + max(0.0, box[1] - y0)
                    + max(0.0, x1 - box[0] - box[2])
                    + max(0.0, y1 - box[1] - box[3])
                )
                return hidden + clash / 4 + 20 * beyond + 1.5 * (1 - math.cos(angle - wish)) + reach / 12

            choices = [(wish + math.pi * k / 8, reach) for reach in (8, 16, 26) for k in range(16)]
            angle, reach = min(choices, key=lambda choice: cost(*choice))
            x0, y0, x1, y1 = label_box(angle, reach)
            taken.append((x0, y0, x1, y1))
            self.text(
                ((x0 + x1) / 2, y1 - 3.5),
                label.text,
                size,
                label.color,
                anchor="middle",
                family=SERIF,
                italic=True,
                halo=True,
            )


def _n(value: float) -> str:
    """Returns a number as text with at most two decimals."""
    return f"{value:.2f}".rstrip("0").rstrip(".")
