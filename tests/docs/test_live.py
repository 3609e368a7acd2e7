"""Live pages next to the documentation, which render in the browser."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import raycam
from raycam.viewer.web import core

DOCS = Path(__file__).resolve().parents[2] / "docs"
sys.path.insert(0, str(DOCS))

import live  # noqa: E402


@pytest.mark.parametrize("name", live.examples())
def test_playground_example_shows_its_objects(name: str) -> None:
    world = raycam.load(DOCS / "worlds" / f"{name}.toml")
    with raycam.strict():
        frame = raycam.render(world, integrator="flat", samples=1, channels=["color", "instance"])
    assert len(set(frame["instance"].ravel().tolist()) - {-1}) >= min(len(world.objects), 3)


def test_playground_examples_are_ordered_and_linked_from_their_page() -> None:
    names = list(live.examples())
    assert names[0] == live.FIRST
    assert len(names) >= 5
    for name in live.PAGES:
        assert f"live/{name}.html" in (DOCS / f"{name}.md").read_text(encoding="utf-8")


def test_pages_without_the_core_name_the_build_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(core, "FOLDER", str(tmp_path / "nothing"))
    live.write(tmp_path)
    for name in live.PAGES:
        assert "make web" in (tmp_path / live.FOLDER / f"{name}.html").read_text(encoding="utf-8")
