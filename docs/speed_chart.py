"""Draws `images/speed.svg`: times to equal error, compared with Mitsuba 3 and Cycles.

    python docs/speed_chart.py

The times come from the newest benchmark results and are relative to raycam's times. Scenes with difficult
light come first.
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
WIDTH, BAR, GAP, LEFT, TOP, HEAD = 720, 9, 9, 70, 62, 30
LONGEST = 12.0
"""The length of the longest bar, relative to raycam's time. Longer bars are cut, and labelled with their value."""

Rows = list[tuple[str, list[float]]]


def newest(name: str, heading: str) -> Path:
    """Returns the newest result with this name that contains the heading."""
    return max(path for path in RESULTS.glob(f"*{name}.md") if f"## {heading}" in path.read_text("utf-8"))


def table(text: str) -> list[dict[str, str]]:
    """Returns the rows of the first table in a text, as dicts by column name."""
    lines = [line for line in text.splitlines() if line.startswith("|") or not line.strip()]
    lines = "\n".join(lines).strip().partition("\n\n")[0].splitlines()
    head, _, *body = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line]
    return [dict(zip(head, cells, strict=True)) for cells in body]


def hard_rows(text: str) -> Rows:
    """Returns each scene with difficult light, with the times of Mitsuba and Cycles.

    Times are processor times relative to raycam's.
    """
    others, _, cycles = text.partition("## Beside Cycles")
    gains = {row["scene"]: float(row["gain over cycles"]) for row in table(cycles)}
    return [
        (row["scene"], [1.0, float(row["gain over mitsuba"]), gains[row["scene"]]])
        for row in table(others)
        if row["scene"] in gains
    ]


def open_rows(text: str) -> Rows:
    """Returns the other scenes, with times from the table below "With Cycles"."""
    found = []
    for row in table(text.partition("## With Cycles")[2]):
        times = [row[column] for column in COLUMNS]
        if all(re.fullmatch(r"[\d.]+", time) for time in times):
            found.append((row["scene"], [float(time) / float(times[0]) for time in times]))
    return found


def chart(groups: dict[str, Rows]) -> str:
    """Returns the chart as SVG: for each group, a heading and the scenes."""
    scale = (WIDTH - LEFT - 60) / LONGEST
    count = sum(map(len, groups.values()))
    height = TOP + len(groups) * HEAD + count * (len(COLUMNS) * BAR + GAP)
    text = 'font-size="11"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
        'font-family="sans-serif" font-size="9" fill="#444">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        '<text x="10" y="18" font-size="13" fill="#222">Time to the same error, path traced, '
        "in times of raycam's: longer is slower</text>",
    ]
    for number, (name, color) in enumerate(COLUMNS.values()):
        x = LEFT + number * 110
        parts.append(f'<rect x="{x}" y="32" width="11" height="11" fill="{color}"/>')
        parts.append(f'<text x="{x + 16}" y="42" {text} fill="#222">{name}</text>')
    y = TOP
    for heading, rows in groups.items():
        parts.append(f'<text x="10" y="{y + 14}" {text} font-weight="bold" fill="#222">{heading}</text>')
        y += HEAD
        for scene, times in rows:
            parts.append(
                f'<text x="{LEFT - 8}" y="{y + 17}" {text} fill="#222" text-anchor="end">{scene}</text>'
            )
            for (_, color), time in zip(COLUMNS.values(), times, strict=True):
                long = min(time, LONGEST) * scale
                said = f"{time:.1f}" if time >= 0.95 or time == 1.0 else f"{time:.2f}"
                said = f"{said}, cut" if time > LONGEST else said
                parts.append(
                    f'<rect x="{LEFT}" y="{y}" width="{long:.1f}" height="{BAR - 1}" fill="{color}"/>'
                )
                parts.append(f'<text x="{LEFT + long + 4:.1f}" y="{y + 8}">{said}</text>')
                y += BAR
            y += GAP
    return "\n".join([*parts, "</svg>"]) + "\n"


def main() -> None:
    """Writes the chart."""
    hard, other = newest("light_in_turn_hard_others", "Beside Cycles"), newest("time_to_error", "With Cycles")
    groups = {
        f"Closed rooms, caustics, lamps behind glass ({hard.name[:10]}, processor time)": hard_rows(
            hard.read_text("utf-8")
        ),
        f"Open scenes ({other.name[:10]}, two cores)": open_rows(other.read_text("utf-8")),
    }
    (DOCS / "images" / "speed.svg").write_text(chart(groups), encoding="utf-8")


if __name__ == "__main__":
    main()
