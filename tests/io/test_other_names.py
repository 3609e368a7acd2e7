"""Names of other libraries: errors for missing names suggest names that exist."""

from __future__ import annotations

import re
from typing import Any

import pytest
import raycam
from raycam import _core
from support.raises import raises

WORLD = raycam.World()
CAMERA = raycam.Camera.look_at([0, -4, 0], [0, 0, 0], size=(4, 3), fov=40)
FRAME = raycam.render(WORLD, CAMERA, channels="depth", samples=1)
TABLES = {kind: dict(_core.foreign_terms(kind)) for kind in ("raycam", "World", "Frame", "Camera")}
OWNERS: dict[str, Any] = {"raycam": raycam, "World": WORLD, "Frame": FRAME, "Camera": CAMERA}


@pytest.mark.parametrize("kind", TABLES)
def test_hints_for_missing_names_refer_to_existing_names(kind: str) -> None:
    for name, hint in TABLES[kind].items():
        with raises(AttributeError, mentions=[repr(name), hint]):
            getattr(OWNERS[kind], name)
        for owner, attribute in re.findall(r"\b(raycam|world|frame|camera|Camera)\.(\w+)", hint):
            there = {
                "raycam": raycam,
                "world": WORLD,
                "frame": FRAME,
                "camera": CAMERA,
                "Camera": raycam.Camera,
            }
            assert hasattr(there[owner], attribute), (name, hint)
        for channel in re.findall(r'frame\["(\w+)"\]', hint):
            assert channel in raycam.render(WORLD, CAMERA, channels=channel, samples=1)


def test_channel_as_an_attribute_raises_with_the_item_syntax() -> None:
    with raises(AttributeError, mentions=['frame["depth"]']):
        FRAME.depth  # type: ignore[attr-defined]  # noqa: B018


def test_unknown_name_raises_pythons_attribute_error() -> None:
    with raises(AttributeError, mentions=["'World'", "'objcts'"]) as caught:
        WORLD.objcts  # type: ignore[attr-defined]  # noqa: B018
    assert caught.value.name == "objcts"  # Python uses this attribute to suggest a name
    assert caught.value.obj is WORLD
    assert not hasattr(FRAME, "__array_interface__")
