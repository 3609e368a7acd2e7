"""Accessibility of the page and the live view, checked with axe-core.

Requires Chromium and axe-core.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import raycam
from raycam.viewer.server import Server
from support.axe import needs_axe, violations
from support.chromium import Tab, chromium

pytestmark = [pytest.mark.proof, needs_axe]


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        yield made


@pytest.mark.parametrize(
    ("scheme", "width"), [("light", 1280), ("dark", 1280), ("light", 360), ("dark", 360)]
)
def test_page_and_live_view_have_no_accessibility_violations(
    tab: Tab, server: Server, small_world: raycam.World, scheme: str, width: int, tmp_path: Path
) -> None:
    tab.show(width, 800, scheme)
    frame = raycam.render(small_world, small_world.camera("front"), channels="all", samples=4)
    frame.save(tmp_path / "x.html", world=small_world, compare=frame, explain=[(24, 16)])
    tab.open((tmp_path / "x.html").as_uri())
    assert violations(tab) == []
    tab.evaluate("document.querySelector('#explanation-list button').click()")
    tab.wait("document.getElementById('explained').open")
    assert violations(tab) == []
    tab.open(server.url)
    tab.wait("document.getElementById('status').textContent.includes('sample')")
    tab.press("g")
    assert violations(tab) == []
    tab.press("?")
    assert violations(tab) == []
    tab.evaluate("sessionStorage.clear()")
