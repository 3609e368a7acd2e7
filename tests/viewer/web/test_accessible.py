"""Live pages at two widths, in light and dark colours.

axe-core must find no violations, and pages must not overflow horizontally. Requires Chromium and axe-core.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from raycam.viewer.bundle import client_file
from raycam.viewer.web.live_page import lecture_page, playground_page
from support.axe import needs_axe, violations
from support.chromium import Tab, chromium
from support.node_core import needs_core

pytestmark = [pytest.mark.proof, needs_core, needs_axe]
PAGES = {
    "playground": (lambda: playground_page({"ball": "[[object]]\nsphere = { radius = 1 }\n"}), [""]),
    "lecture": (lecture_page, re.findall(r'<section id="(\w+)"', client_file("lecture/index.html"))),
}
SHOWN = (
    "document.documentElement.dataset.picture || "
    "document.getElementById('picture')?.dataset.samples || document.getElementById('status-picture')?.textContent"
)

TRANSITIONS_ENDED = (
    "Promise.all(document.getAnimations().map(({ finished }) => finished.catch(() => null))).then(() => null)"
)
"""Waits until transitions have ended, because colours in transition have other contrasts."""


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        yield made


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_pages_have_no_accessibility_violations(
    tab: Tab, tmp_path: Path, name: str, scheme: str, width: int
) -> None:
    make, parts = PAGES[name]
    path = tmp_path / "page.html"
    path.write_text(make(), encoding="utf-8")
    tab.show(width, 800, scheme, motion="reduce")  # figures that fade in have low contrasts for a moment
    tab.call("Page.navigate", url=path.as_uri())
    tab.wait(SHOWN)
    for part in parts:
        tab.evaluate(f"location.hash = {json.dumps(part)}")
        assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth"), (
            part
        )
    tab.evaluate(TRANSITIONS_ENDED)
    assert violations(tab) == []
