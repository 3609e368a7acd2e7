"""Counts the words of the documentation, and the share of internal decisions among them.

    python docs/words.py

The documentation consists of all pages that are built: the pages in docs/, and the reference, which is
generated from the code. Internal decisions are described in design.md. The lab notes, which record
measurements, are counted separately.
"""

from __future__ import annotations

import json
from pathlib import Path

import api
import worldfile
from raycam import _core

DOCS = Path(__file__).resolve().parent
MADE = {"_build", "_generated", "api", "images", "meshes"}
DECISIONS = "design.md"


def counted() -> dict[str, int]:
    """Returns the number of words of each page."""
    pages = [path for path in DOCS.rglob("*.md") if not MADE & set(path.relative_to(DOCS).parts)]
    found = {str(path.relative_to(DOCS)): len(path.read_text(encoding="utf-8").split()) for path in pages}
    for made in api.pages().values():
        found |= {f"reference/api/{page.name}.md": len(page.text.split()) for page in made}
    schema = worldfile.Reference(json.loads(_core.json_schema()))
    return found | {"reference/worldfile.md (made)": len(" ".join(schema.lines).split())}


def share() -> float:
    """Returns the words of design.md divided by the words of all pages that are built."""
    found = {name: count for name, count in counted().items() if not name.startswith("lab-notes")}
    return found[DECISIONS] / sum(found.values())


def main() -> None:
    """Prints the counts."""
    found = counted()
    notes = sum(count for name, count in found.items() if name.startswith("lab-notes"))
    print(f"built pages      {sum(found.values()) - notes} words")
    print(f"design.md        {found[DECISIONS]} words, {share():.1%}")
    print(f"lab notes        {notes} words, which are not part of built pages")


if __name__ == "__main__":
    main()
