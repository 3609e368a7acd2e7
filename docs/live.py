"""Writes the pages that render by themselves: the playground and the interactive lecture."""

from pathlib import Path

from raycam.viewer.web.core import is_built
from raycam.viewer.web.live_page import lecture_page, playground_page

WORLDS = Path(__file__).parent / "worlds"
FIRST = "solids"
"""The world that the playground shows initially."""
FOLDER = "extra/live"
"""The folder of the pages, in the folder of the generated files."""
PAGES = {"playground": lambda: playground_page(examples()), "lecture": lecture_page}
MISSING = """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>raycam in a page</title><meta name="color-scheme" content="light dark"></head>
<body><main><h1>Not built</h1><p>This page renders by raycam compiled for WebAssembly, which this build of the
documentation lacks: <code>make web</code>, then <code>make docs</code>.</p></main></body>
</html>
"""


def examples() -> dict[str, str]:
    """Returns the texts of the playground's worlds by name.

    The first world is the one that the playground shows initially.
    """
    names = sorted((path.stem for path in WORLDS.glob("*.toml")), key=lambda name: (name != FIRST, name))
    return {name: (WORLDS / f"{name}.toml").read_text(encoding="utf-8") for name in names}


def write(folder: Path) -> None:
    """Writes the pages.

    If raycam was not built for pages, each page explains how to build it.
    """
    made = folder / FOLDER
    made.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        (made / f"{name}.html").write_text(page() if is_built() else MISSING, encoding="utf-8")
