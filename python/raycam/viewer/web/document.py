"""The HTML text of the client's page.

The page is one file; its security policy allows only its own script.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ..bundle import bundle, client_file, style_sheet

if TYPE_CHECKING:
    from ...render.frame import Frame

__all__ = ["assembled", "filled", "json_text", "source_hash", "still_image", "title_text"]


def assembled(
    title: str, blocks: Iterable[str], scripts: str = "", workers: str = "", folder: str = ""
) -> str:
    """The HTML text of the page in the client folder `folder`; `blocks` are its data elements.

    `scripts` and `workers` are sources that the page's security policy allows in addition to its own script.
    """
    script, style = f"\n{bundle(f'{folder}main.js')}", f"\n{style_sheet(folder)}"
    policy = (
        f"default-src 'none'; script-src '{source_hash(script)}'{scripts}; style-src '{source_hash(style)}'; "
        f"img-src blob: data:; {workers}base-uri 'none'; form-action 'none'"
    )
    parts = {
        "head": f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        "title": title_text(title),
        "style": f"<style>{style}</style>",
        "data": "\n".join(blocks),
        "script": f'<script id="client">{script}</script>',
    }
    return filled(parts, f"{folder}index.html")


def filled(parts: Mapping[str, str], page: str = "index.html") -> str:
    """Returns the page's HTML with its parts inserted.

    Placeholders within the parts are not replaced.
    """
    pieces = []
    for piece in client_file(page).split("<!--"):
        name, end, rest = piece.partition("-->")
        pieces.append(parts[name] + rest if end else piece)
    return "".join(pieces)


def title_text(title: str) -> str:
    """A title as HTML; invalid characters become "?".

    Invalid characters occur in file names of other encodings.
    """
    return html.escape(title.encode("utf-8", "replace").decode())


def still_image(
    frame: Frame, exposure: float | None, view: str | None, title: str | None, channel: str | None = None
) -> str:
    """An element that shows the frame as a JPEG in browsers without JavaScript."""
    data = base64.b64encode(frame.to_jpeg(exposure, view, channel)).decode()
    alt = title_text(title or "The rendered image")
    return f'<noscript><img src="data:image/jpeg;base64,{data}" alt="{alt}"></noscript>'


def json_text(document: dict[str, Any]) -> str:
    """JSON that cannot end the script element around it."""
    return json.dumps(document, allow_nan=False).replace("<", "\\u003c")


def source_hash(text: str) -> str:
    """The hash of a script or style element's text, as a source in a content security policy."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
