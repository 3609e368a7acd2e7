"""axe-core, the rules of accessible pages: `AXE_CORE=.../axe.min.js make proof` names its file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from .chromium import Tab

__all__ = ["needs_axe", "violations"]

AXE = Path(os.environ.get("AXE_CORE", "none"))
needs_axe = pytest.mark.skipif(not AXE.is_file(), reason="AXE_CORE names no axe.min.js: npm install axe-core")


def violations(tab: Tab) -> list[Any]:
    """The rules that the page offends, and where."""
    tab.evaluate(f"{AXE.read_text(encoding='utf-8')}; null")
    found: list[Any] = tab.evaluate(
        "axe.run(document).then(({violations}) => violations.map(({id, nodes}) => "
        "[id, nodes.map((each) => [each.html.slice(0, 160), each.failureSummary])]))"
    )
    return found
