"""The reference of codes: every code of a notice or an error, with its cause and remedy."""

from collections.abc import Mapping
from pathlib import Path

from raycam import codes


def table(entries: Mapping[str, codes.Code]) -> list[str]:
    """The rows of a table of codes in Markdown."""
    rows = [f"| `{name}` | {code.cause} | {code.remedy} |" for name, code in entries.items()]
    return ["| code | cause | remedy |", "|---|---|---|", *rows, ""]


def write(folder: Path) -> None:
    """Make `codes.md`."""
    lines = ["## Notices", "", *table(codes.NOTICES), "## Errors", "", *table(codes.ERRORS)]
    (folder / "codes.md").write_text("\n".join(lines), encoding="utf-8")
