"""HTML tables, which notebooks show for objects at the end of a cell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["html_table"]

MAX_ROWS = 20
"""Maximum number of rows shown; further rows are counted."""
CELL = 'style="padding: 2px 14px 2px 0; text-align: left"'
"""The style of table cells. Without it, some notebooks, such as marimo, show cells without padding."""


def html_table(
    title: str, head: Sequence[str], rows: Iterable[Sequence[object]], notes: Sequence[str] = ()
) -> str:
    """Returns HTML with a bold title, a table of at most `MAX_ROWS` rows, and lines below.

    `head` contains the names of the columns, and `notes` are the lines below the table. All text is escaped.
    """
    from html import escape  # imported here, so that `import raycam` is fast

    every = list(rows)
    parts = [f"<div><b>{escape(title)}</b>"]
    if every:
        parts.append("<table><tr>" + "".join(f"<th {CELL}>{escape(name)}</th>" for name in head) + "</tr>")
        for row in every[:MAX_ROWS]:
            parts.append("<tr>" + "".join(f"<td {CELL}>{escape(str(value))}</td>" for value in row) + "</tr>")
        parts.append("</table>")
    more = [f"... and {len(every) - MAX_ROWS} more"] if len(every) > MAX_ROWS else []
    parts += [f"<div>{escape(line)}</div>" for line in [*more, *notes]]
    return "".join([*parts, "</div>"])
