"""Writes formulas as MathML, which browsers display without scripts or network requests."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert


def inline(writer: Any, node: nodes.math) -> None:
    """Writes a formula within a line."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def display(writer: Any, node: nodes.math_block) -> None:
    """Writes a formula on a separate line."""
    writer.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Entry point that Sphinx calls: registers the renderer for formulas."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
