"""The page of an explanation: one file with the same figures as in the lecture and the live view."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING

from .. import _core
from ..explanation.page_figure import page_figure
from ..render.render import render
from .web.document import assembled, json_text

if TYPE_CHECKING:
    from ..explanation import Explanation

__all__ = ["explanation_page"]


def explanation_page(explanation: Explanation) -> str:
    """The HTML text of a page with the explanation's rotatable figures and its steps."""
    column, row = explanation.pixel
    frame = render(explanation.world, explanation.camera, integrator="flat", samples=1, channels="color")
    picture = base64.b64encode(_core.encode_png(frame.to_srgb8())).decode()
    blocks = [
        f'<img id="picture" alt="The picture" src="data:image/png;base64,{picture}">',
        f'<script type="application/json" id="figure">{json_text(page_figure(explanation))}</script>',
        f'<pre tabindex="0" aria-label="Steps">{html.escape(str(explanation))}</pre>',
    ]
    return assembled(f"Pixel ({column}, {row}) explained", blocks, folder="explanation/")
