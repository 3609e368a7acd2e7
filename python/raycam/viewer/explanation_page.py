"""The page of an explanation, in one file.

Its figures are the same as in the lecture and the live view.
"""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any

from .. import _core
from ..explanation.page_figure import lines_figure, page_figure
from ..explanation.scene_figure import light_lines, path_marks, tree_lines
from ..render.render import render
from .web.document import assembled, json_text

if TYPE_CHECKING:
    from ..explanation.explanation import Explanation, Subject

__all__ = ["explanation_page"]


def explanation_page(explanation: Explanation, of: Subject = "ray") -> str:
    """Returns the HTML text of a page with a pixel's rotatable figures and its steps."""
    text, figure = _part(explanation, of)
    column, row = explanation.pixel
    frame = render(explanation.world, explanation.camera, integrator="flat", samples=1, channels="color")
    picture = base64.b64encode(_core.encode_png(frame.to_srgb8())).decode()
    blocks = [
        f'<img id="picture" alt="The picture" src="data:image/png;base64,{picture}">',
        f'<script type="application/json" id="figure">{json_text(figure)}</script>',
        f'<pre tabindex="0" aria-label="Steps">{html.escape(text)}</pre>',
    ]
    about = "" if of == "ray" else f": the {of}"
    return assembled(f"Pixel ({column}, {row}) explained{about}", blocks, folder="explanation/")


def _part(explanation: Explanation, of: Subject) -> tuple[str, dict[str, Any]]:
    """The text and the figure of a subject."""
    if of == "light":
        light, path = explanation.lighting(), explanation.light_path()
        lines = light_lines(explanation.world, light, path)
        return f"{light}\n\n{path}", lines_figure(explanation, lines, path_marks(path))
    if of == "tree":
        tree = explanation.tree()
        return str(tree), lines_figure(explanation, tree_lines(explanation, tree), [])
    return str(explanation), page_figure(explanation)
