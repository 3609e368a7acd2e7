"""axe-core finds nothing in the page and the live view. Needs Chromium and RAYCAM_AXE, the path of its axe.min.js."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam.viewer.server import Server
from support.chromium import Tab, chromium

pytestmark = pytest.mark.proof
AXE = os.environ.get("RAYCAM_AXE", "")


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    if not Path(AXE).is_file():
        pytest.skip("RAYCAM_AXE names no axe.min.js (npm install axe-core)")
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        yield made


def violations(tab: Tab) -> list[Any]:
    """The rules that the page offends, and where."""
    tab.evaluate(f"{Path(AXE).read_text(encoding='utf-8')}; null")
    found: list[Any] = tab.evaluate(
        "axe.run(document).then(({violations}) => violations.map(({id, nodes}) => "
        "[id, nodes.map((each) => [each.html.slice(0, 160), each.failureSummary])]))"
    )
    return found


@pytest.mark.parametrize(
    ("scheme", "width"), [("light", 1280), ("dark", 1280), ("light", 360), ("dark", 360)]
)
def test_the_page_and_the_view_offend_no_rule(
    tab: Tab, server: Server, small_world: raycam.World, scheme: str, width: int, tmp_path: Path
) -> None:
    tab.show(width, 800, scheme)
    frame = raycam.render(small_world, small_world.camera("front"), channels="all", samples=4)
    frame.save(tmp_path / "x.html", world=small_world, compare=frame, explain=[(24, 16)])
    tab.open((tmp_path / "x.html").as_uri())
    assert violations(tab) == []
    tab.open(server.url)
    tab.wait("document.getElementById('status').textContent.includes('sample')")
    tab.press("g")
    assert violations(tab) == []
    tab.press("?")
    assert violations(tab) == []
    tab.evaluate("document.getElementById('help').close()")
    tab.press("p")
    tab.press("Enter")
    tab.wait("document.getElementById('explained').open")
    assert violations(tab) == []
    tab.evaluate("sessionStorage.clear()")
