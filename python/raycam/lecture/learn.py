"""Writes the lecture, its live exercises and its notebooks into a folder."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

__all__ = ["write_lecture"]

WITHOUT_LIVE = (
    "<p>(The interactive page requires a raycam wheel, or <code>make web</code> in a source tree.)</p>"
)


def write_lecture(folder: Path) -> list[Path]:
    """Writes the lecture's pages and notebooks, and returns their paths.

    The pages are `live.html` and `lecture.html`. The first path is the page to open.

    Notebooks that exist are kept, because they may contain answers. Without the WebAssembly core, which wheels
    contain, the interactive page `live.html` is omitted, and the lecture's text contains the remedy.
    """
    from ..viewer.web.core import is_built
    from ..viewer.web.live_page import lecture_page

    folder.mkdir(parents=True, exist_ok=True)
    files = resources.files(__package__)
    text = files.joinpath("lecture.html").read_text(encoding="utf-8")
    written = [folder / "lecture.html"]
    if is_built():
        written.insert(0, folder / "live.html")
        written[0].write_text(lecture_page(), encoding="utf-8")
    else:
        text = re.sub(r"<p>[^<]*<a href=\"live\.html\">.*?</p>", WITHOUT_LIVE, text, flags=re.S)
    written[-1].write_text(text, encoding="utf-8")
    for notebook in sorted(files.joinpath("notebooks").iterdir(), key=lambda file: file.name):
        target = folder / notebook.name
        if notebook.name.endswith(".ipynb"):
            if not target.exists():
                target.write_bytes(notebook.read_bytes())
            written.append(target)
    return written
