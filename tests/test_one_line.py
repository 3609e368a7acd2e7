"""Reprs of objects with arrays: one line each, for arrays of any size."""

from __future__ import annotations

import dataclasses
import inspect
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.one_line import counted, one_line

SQUARE = np.zeros((64, 64, 3), np.uint8)


def make_keypoints() -> Any:
    world = raycam.data.spot()
    return raycam.keypoints(world, world.default_camera(), np.random.default_rng(0).random((500, 3)))


MAKERS = {
    "Texture": lambda: raycam.Texture(SQUARE, repeat=4),
    "Keypoints": make_keypoints,
    "Topology": lambda: raycam.data.spot().topology(0),
    "Box3D": lambda: raycam.box3d(raycam.data.spot(), 0),
    "Background": lambda: raycam.Background(SQUARE),
    "Object": lambda: raycam.data.spot().objects[0],
    "Label": lambda: raycam.label(raycam.data.spot(), raycam.data.spot().default_camera())[0],
}


@pytest.mark.parametrize("name", MAKERS)
def test_repr_of_each_result_is_one_short_line(name: str) -> None:
    text = repr([MAKERS[name]()])
    assert "\n" not in text
    assert len(text) < 500
    assert name in text


def test_repr_shows_dtype_shape_and_non_default_values() -> None:
    assert repr(raycam.Texture(SQUARE, repeat=4)) == "Texture(image=uint8[64, 64, 3], repeat=4)"
    assert repr(raycam.Texture("a.png")) == "Texture(image='a.png')"


def test_public_classes_with_arrays_have_a_repr_of_one_line() -> None:
    for name in dir(raycam):
        kind = getattr(raycam, name)
        if inspect.isclass(kind) and dataclasses.is_dataclass(kind):
            holds_arrays = any(
                "NDArray" in str(f.type) or "Floats" in str(f.type) for f in dataclasses.fields(kind)
            )
            generated = kind.__repr__.__code__.co_filename.endswith(("reprlib.py", "dataclasses.py"))
            assert not (holds_arrays and generated), f"{name} prints its arrays in full"


def test_one_line_shortens_all_kinds_of_values() -> None:
    @one_line
    @dataclass(frozen=True)
    class Holder:
        small: Any
        large: Any
        maps: Any
        items: Any
        text: Any
        same: Any = 5
        _hidden: Any = None

    holder = Holder(
        np.array([1, 2.5]), np.ones((3, 3)), {"a": np.ones(9)}, tuple(range(50)), "x\n" * 99, _hidden=3
    )
    assert repr(holder).startswith(
        "Holder(small=[1, 2.5], large=float64[3, 3], maps={a: float64[9]}, items=50 items, text='x"
    )
    assert "\n" not in repr(holder)
    assert "same" not in repr(holder)
    assert "hidden" not in repr(holder)


def test_counted_nouns_have_a_plural_except_for_one() -> None:
    assert [counted(number, "camera") for number in (0, 1, 2)] == ["0 cameras", "1 camera", "2 cameras"]
