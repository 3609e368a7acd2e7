"""Live pages, which render in the browser: their contents, and invalid arguments."""

from __future__ import annotations

import base64
import json
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam import _core
from raycam.viewer.web import core
from raycam.viewer.web.live_page import playground_page
from support.raises import fault, raises

GLUE = "let wasm_bindgen = null;"


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> bytes:
    """A stand-in for the built core."""
    data = bytes(range(256)) * 20
    (tmp_path / core.GLUE).write_text(GLUE)
    (tmp_path / core.CORE).write_bytes(core.deflated(data))
    monkeypatch.setattr(core, "FOLDER", str(tmp_path))
    return data


def element(page: str, name: str) -> str:
    """The text of the element with this id."""
    (found,) = re.findall(rf'<script [^>]*id="{name}">(.*?)</script>', page, re.S)
    return str(found)


def unpacked(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text), -15)


def test_live_page_contains_the_core_the_world_and_the_camera(
    built: bytes, small_world: raycam.World, tmp_path: Path
) -> None:
    camera = raycam.Camera.look_at([3, 3, 2], [0, 0, 0], size=(40, 30), fov=50)
    frame = raycam.render(small_world, camera, integrator="flat", samples=1)
    path = tmp_path / "x.html"
    frame.save(path, world=small_world, live=True, exposure=1.5, view="agx", title="</script>")
    page = path.read_text(encoding="utf-8")
    assert element(page, "core-glue") == GLUE
    assert unpacked(element(page, "core-wasm")) == core.core_bytes() == built
    options = json.loads(element(page, "core-options"))
    assert (options["exposure"], options["view"], options["title"]) == (1.5, "agx", "</script>")
    world = raycam.World._of(_core.world_from_bytes(unpacked(element(page, "core-world")), None, ""))
    assert np.array_equal(world.camera(options["camera"]).P, camera.P)
    assert list(world.cameras) == [*small_world.cameras, options["camera"]]
    assert len(small_world.cameras) == 2
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert "default-src 'none'" in policy
    assert "connect-src" not in policy
    assert "'wasm-unsafe-eval'" in policy
    assert not re.search(r"(?:src|href)=\"?https?:", page)


def test_live_page_does_not_duplicate_a_camera_of_the_world(
    built: bytes, small_world: raycam.World, tmp_path: Path
) -> None:
    frame = raycam.render(small_world, "side", integrator="flat", samples=1)
    frame.save(tmp_path / "x.html", world=small_world, live=True)
    options = json.loads(element((tmp_path / "x.html").read_text(encoding="utf-8"), "core-options"))
    assert options["camera"] == "side"


def test_unsupported_live_pages_are_refused(built: bytes, small_world: raycam.World, tmp_path: Path) -> None:
    frame = raycam.render(small_world, "side", integrator="flat", samples=1)
    for options, word in [
        ({}, fault("missing_value", "world=world")),
        ({"world": small_world, "explain": [(1, 1)]}, fault("conflicting_values", "explain")),
        ({"world": small_world, "compare": frame}, fault("conflicting_values", "compare")),
        ({"world": small_world, "half": True}, fault("conflicting_values", "half")),
    ]:
        with raises(raycam.errors.SettingsError, **word):
            frame.save(tmp_path / "x.html", live=True, **options)
    assert not (tmp_path / "x.html").exists()


def test_missing_core_raises_with_the_build_command(
    small_world: raycam.World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(core, "FOLDER", str(tmp_path / "nothing"))
    frame = raycam.render(small_world, "side", integrator="flat", samples=1)
    with raises(raycam.errors.SettingsError, code="missing_dependency"):
        frame.save(tmp_path / "x.html", world=small_world, live=True)


def test_playground_contains_its_examples(built: bytes) -> None:
    page = playground_page({"a": "[[object]]\nbox = { size = 1 }  # </script>\n"})
    assert json.loads(element(page, "core-options"))["playground"][0]["name"] == "a"
    assert "</script>" in json.loads(element(page, "core-options"))["playground"][0]["text"]
