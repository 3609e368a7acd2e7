"""Writes the reference of codes: each code of a notice or error, with cause and remedy."""

from collections.abc import Mapping
from pathlib import Path

from raycam import codes


def table(entries: Mapping[str, codes.Code]) -> list[str]:
    """Returns the rows of a Markdown table of codes."""
    rows = [f"| `{name}` | {code.cause} | {code.remedy} |" for name, code in entries.items()]
    return ["| code | cause | remedy |", "|---|---|---|", *rows, ""]


def write(folder: Path) -> None:
    """Writes `codes.md`."""
    lines = ["## Notices", "", *table(codes.NOTICES), "## Errors", "", *table(codes.ERRORS)]
    (folder / "codes.md").write_text("\n".join(lines), encoding="utf-8")
