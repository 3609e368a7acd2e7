"""Checks of pages with axe-core, a library of accessibility rules.

`.ci/client` installs axe-core.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from .chromium import Tab

__all__ = ["needs_axe", "violations"]

AXE = Path(sys.prefix, "axe-core-4.14.1/node_modules/axe-core/axe.min.js")
needs_axe = pytest.mark.skipif(not AXE.is_file(), reason="axe-core is not installed; run: .ci/client .venv")


def violations(tab: Tab) -> list[Any]:
    """The violated rules and their elements."""
    tab.evaluate(f"{AXE.read_text(encoding='utf-8')}; null")
    found: list[Any] = tab.evaluate(
        "axe.run(document).then(({violations}) => violations.map(({id, nodes}) => "
        "[id, nodes.map((each) => [each.html.slice(0, 160), each.failureSummary])]))"
    )
    return found
