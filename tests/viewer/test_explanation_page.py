"""The page of an explanation. `make proof` draws it in Chromium."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Literal

import pytest
import raycam
from raycam import cli
from support.chromium import Tab

CAMERA = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=40)


def test_page_contains_steps_and_figure(small_world: raycam.World, tmp_path: Path) -> None:
    explanation = raycam.explain(small_world, CAMERA, (24, 16))
    explanation.save_figure(tmp_path / "explain.html")
    text = (tmp_path / "explain.html").read_text(encoding="utf-8")
    assert "<title>Pixel (24, 16) explained</title>" in text
    found = re.search(r'<script type="application/json" id="figure">(.*?)</script>', text)
    assert found
    assert len(json.loads(found[1])["triangle"]) == 9
    assert "P⁺ x" in text
    assert not re.search(r'(?:src|href)="(?!data:)', text)


@pytest.mark.parametrize("subject", ["light", "tree"])
def test_pages_of_light_and_tree_contain_their_lines(
    small_world: raycam.World, tmp_path: Path, subject: Literal["light", "tree"]
) -> None:
    explanation = raycam.explain(small_world, CAMERA, (24, 16))
    explanation.save_figure(tmp_path / "explain.html", of=subject)
    text = (tmp_path / "explain.html").read_text(encoding="utf-8")
    assert f"<title>Pixel (24, 16) explained: the {subject}</title>" in text
    found = re.search(r'<script type="application/json" id="figure">(.*?)</script>', text)
    assert found
    drawn = {line["color"] for line in json.loads(found[1])["lines"]}
    assert drawn == ({"r", "L"} if subject == "light" else {"r", "P"})
    assert ("ONE PATH OF LIGHT" if subject == "light" else "THE TREE") in text


def test_command_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = tmp_path / "box.toml"
    world.write_text(
        "[[object]]\nbox = { size = 1 }\n\n[camera]\nsize = [32, 24]\nlocation = [3, 0, 1]\nyaw = 180\nfov = 40\n"
    )
    page = tmp_path / "explain.html"
    assert cli.main(["explain", str(world), "--pixel", "16", "12", "--figure", str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert "explain.html" in capsys.readouterr().out


@pytest.mark.proof
@pytest.mark.parametrize("subject", ["ray", "light", "tree"])
def test_figures_are_drawn_and_rotate(
    tab: Tab, small_world: raycam.World, tmp_path: Path, subject: Literal["ray", "light", "tree"]
) -> None:
    raycam.explain(small_world, CAMERA, (24, 16)).save_figure(tmp_path / "explain.html", of=subject)
    tab.call("Page.navigate", url=(tmp_path / "explain.html").as_uri())
    tab.wait("document.querySelectorAll('canvas').length === 2")
    tab.wait("[...document.querySelectorAll('canvas')].every((each) => each.dataset.labels)")
    before = tab.evaluate("document.querySelector('canvas').dataset.labels")
    tab.evaluate("document.querySelector('canvas').focus()")
    tab.press("ArrowRight")
    tab.wait(f"document.querySelector('canvas').dataset.labels !== {json.dumps(before)}")
