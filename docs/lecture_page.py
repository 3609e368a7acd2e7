"""Writes the page of `raycam learn` from `docs/lecture.md`.

    python docs/lecture_page.py

The page is `python/raycam/lecture/lecture.html`. It needs no network: figures are rendered by `figures.py`
and embedded, and formulas become MathML. The page's head contains the SHA-256 of the text, with which a test
detects an outdated page. Requires Pillow, markdown-it-py and latex2mathml.
"""

from __future__ import annotations

import base64
import hashlib
import html
import io
import re
import sys
import tempfile
from pathlib import Path

from markdown_it import MarkdownIt

DOCS = Path(__file__).resolve().parent
SOURCE = DOCS / "lecture.md"
PAGE = DOCS.parent / "python" / "raycam" / "lecture" / "lecture.html"
FENCE = re.compile(r"^```\{(figure|raw|literalinclude)\} ?(\S*)\n(.*?)^```$", re.M | re.S)
MAX_SIDE = 900
HEAD = """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>Making virtual worlds</title>
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<meta name="lecture-sha256" content="{digest}">
<style>
body {{ max-width: 46rem; margin: 2rem auto; padding: 0 1rem; font: 1.05rem/1.55 system-ui, sans-serif }}
pre {{ overflow: auto; padding: .8rem; font-size: .85rem }}
pre {{ background: color-mix(in srgb, currentColor 8%, transparent) }}
img, iframe {{ max-width: 100%; border: 0 }}
figure {{ margin: 1.5rem 0 }}
figcaption {{ opacity: .75; font-size: .9rem }}
math[display="block"] {{ margin: 1rem 0 }}
</style></head>
<body>
"""


def digest(text: str) -> str:
    """Returns the SHA-256 of the lecture's text."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def page(figures: Path) -> str:
    """Returns the page's HTML with the figures of a folder embedded."""
    from latex2mathml.converter import convert

    text = SOURCE.read_text(encoding="utf-8")
    markdown = MarkdownIt("commonmark", {"html": True})
    blocks: list[str] = []

    def keep(block: str) -> str:
        blocks.append(block)
        return f"<!--block {len(blocks) - 1}-->"

    def fence(found: re.Match[str]) -> str:
        kind, target, body = found.groups()
        if kind == "raw":
            return keep(body.replace("live/lecture.html", "live.html"))
        file = figures / Path(target).name
        if kind == "literalinclude":
            return keep(f"<pre>{html.escape(file.read_text(encoding='utf-8'))}</pre>")
        alt = re.search(r":alt: (.*)", body)
        caption = markdown.renderInline(re.sub(r"^:.*\n", "", body, flags=re.M).strip())
        image = f'<img src="{embedded(file)}" alt="{html.escape(alt[1] if alt else "")}">'
        return keep(f"<figure>{image}<figcaption>{caption}</figcaption></figure>")

    made = FENCE.sub(fence, text)
    made = re.sub(r"\$\$(.+?)\$\$", lambda found: keep(convert(found[1], display="block")), made, flags=re.S)
    made = re.sub(r"\$([^$\n]+)\$", lambda found: keep(convert(found[1])), made)
    made = re.sub(r"\[([^]]*)\]\((?!http)[^)]*\)", r"\1", made)  # links between pages of the documentation
    made = markdown.render(made)
    made = re.sub(r"(?:<p>)?<!--block (\d+)-->(?:</p>)?", lambda found: blocks[int(found[1])], made)
    return f"{HEAD.format(digest=digest(text))}{made}</body>\n</html>\n"


def embedded(file: Path) -> str:
    """Returns a figure as a data URI.

    SVG figures are unchanged; other figures become JPEG images with at most `MAX_SIDE` pixels per side.
    """
    from PIL import Image

    data, kind = file.read_bytes(), "svg+xml"
    if file.suffix != ".svg":
        with Image.open(file) as image:
            picture = image.convert("RGB")
        picture.thumbnail((MAX_SIDE, MAX_SIDE), Image.Resampling.LANCZOS)
        buffer, kind = io.BytesIO(), "jpeg"
        picture.save(buffer, "JPEG", quality=82, optimize=True)
        data = buffer.getvalue()
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"


def main() -> None:
    """Writes the page.

    Figures are read from the folder that is the first argument; without an argument, they are rendered.
    """
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(sys.argv[1] if sys.argv[1:] else folder)
        if not sys.argv[1:]:
            sys.path.insert(0, str(DOCS))
            import figures as maker

            maker.write(figures)
        PAGE.write_text(page(figures), encoding="utf-8")


if __name__ == "__main__":
    main()
