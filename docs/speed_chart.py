"""Draws `images/speed.svg`: the time to the same error beside Mitsuba 3 and Cycles, from the newest benchmark result.

python docs/speed_chart.py
"""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parent
RESULTS = DOCS.parent / "benchmarks" / "results"
COLUMNS = {
    "raycam ms": ("raycam", "#c8502d"),
    "Mitsuba ms": ("Mitsuba 3", "#8796a5"),
    "Cycles ms": ("Cycles", "#b9c2cb"),
}
WIDTH, BAR, GAP, LEFT, TOP = 720, 11, 12, 64, 64


def newest() -> Path:
    """The newest result with the times of all three."""
    return max(
        path for path in RESULTS.glob("*time_to_error.md") if "## With Cycles" in path.read_text("utf-8")
    )


def rows(text: str) -> list[tuple[str, list[float]]]:
    """Scenes with their milliseconds, in the order of `COLUMNS`, from the table under "With Cycles"."""
    table = [line for line in text.partition("## With Cycles")[2].splitlines() if line.startswith("|")]
    names = [cell.strip() for cell in table[0].strip("|").split("|")]
    wanted = [names.index(column) for column in COLUMNS]
    found = []
    for line in table[2:]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != len(names) or not all(re.fullmatch(r"[\d.]+", cells[place]) for place in wanted):
            break
        found.append((cells[0], [float(cells[place]) for place in wanted]))
    return found


def chart(found: list[tuple[str, list[float]]], source: str) -> str:
    """The chart as SVG; bars are of the time relative to raycam's."""
    largest = max(times[i] / times[0] for _, times in found for i in range(len(times)))
    scale = (WIDTH - LEFT - 90) / largest
    height = TOP + len(found) * (len(COLUMNS) * BAR + GAP) + 8
    text = 'font-family="sans-serif" font-size="11"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        f'<text x="10" y="18" font-family="sans-serif" font-size="13" fill="#222">Time to the same error, path traced,'
        f" in times of raycam's: shorter is better ({source}, 2 cores)</text>",
    ]
    for number, (name, color) in enumerate(COLUMNS.values()):
        x = LEFT + number * 110
        parts.append(f'<rect x="{x}" y="32" width="11" height="11" fill="{color}"/>')
        parts.append(f'<text x="{x + 16}" y="42" {text} fill="#222">{name}</text>')
    y = TOP
    for scene, times in found:
        parts.append(f'<text x="{LEFT - 8}" y="{y + 21}" {text} fill="#222" text-anchor="end">{scene}</text>')
        for (_, color), time in zip(COLUMNS.values(), times, strict=True):
            long = time / times[0] * scale
            parts.append(f'<rect x="{LEFT}" y="{y}" width="{long:.1f}" height="{BAR - 1}" fill="{color}"/>')
            parts.append(
                f'<text x="{LEFT + long + 4:.1f}" y="{y + 9}" {text} fill="#555">{time / times[0]:.1f}'
                f" ({time:g} ms)</text>"
            )
            y += BAR
        y += GAP
    return "\n".join([*parts, "</svg>"]) + "\n"


def main() -> None:
    """Writes the chart."""
    path = newest()
    (DOCS / "images" / "speed.svg").write_text(
        chart(rows(path.read_text("utf-8")), path.name[:10]), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
