"""Messages: the table of valid messages, and invalid ones."""

from __future__ import annotations

import contextlib
import json
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from raycam.viewer import message_types
from raycam.viewer.client_messages import MESSAGES
from raycam.viewer.messages import BadMessage, field_types, packed, parse_message
from support.raises import raises

GOOD: dict[str, dict[str, Any]] = {
    "panes": {"names": ["", "front", "side", "top"]},
    "hello": {"width": 640, "height": 480, "ratio": 1.5, "session": ""},
    "size": {"width": 1, "height": 10000, "ratio": 2},
    "move": {
        "seq": 0,
        "R": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "C": [1, -2.5, 3],
        "fx": 500.5,
        "pivot": [0, 0, 0.5],
    },
    "home": {"seq": 2},
    "locate": {"id": 3, "image": 4, "u": 3.25, "v": -4},
    "ground": {"id": 4, "begin": [0, 0, 1], "end": [0, 1, 1.5], "foot": 0.05},
    "camera": {"seq": 1, "name": "front"},
    "photograph": {"name": "front"},
    "time": {"t": 0.5, "animation": ""},
    "variant": {"name": "red"},
    "side": {"seq": 3, "name": "front"},
    "look": {
        "light": "sun",
        "rotation": 90.5,
        "azimuth": -30,
        "elevation": 45.5,
        "ground": "shadow",
        "ground_color": "#123456",
        "backdrop": "color",
        "background": "#a0b1c2",
    },
    "look_image": {"use": "light", "file": "sky.hdr"},
    "restore_look": {},
    "framing": {"seq": 4, "zoom": 0.8, "fov": 45.5},
    "lens": {"fx": 500.5, "fy": 500, "cx": -1, "cy": 239.5, "distortion": [0.1, -0.02]},
    "pose": {"location": [1, -2.5, 3], "roll": 0, "pitch": 10.5, "yaw": -90},
    "overlay": {"cameras": True, "explained": False, "grid": True},
    "scan": {"lidar": "top"},
    "select": {"number": 0, "slot": -1, "tool": "move"},
    "select_light": {"number": 1},
    "texture": {"number": 0, "slot": 1, "texture": "normal", "file": "bumps.png"},
    "thumbnails": {"number": 2, "slot": 0},
    "keep_camera": {"name": "over the table"},
    "remove_camera": {"name": "front"},
    "gizmo": {"handle": "x", "stroke": 7, "begin": [1.5, 2], "end": [-3, 4]},
    "film": {"seconds": 2, "degrees": 360},
    "stop": {},
    "upload": {"name": "a.glb", "bytes": 3, "offset": 0, "data": "AAAA"},
    "open": {"name": "a.glb", "others": ["b.glb"]},
    "edit_material": {"number": 3, "slot": 1, "key": "roughness", "value": 0.5},
    "edit": {"kind": "object", "number": 3, "key": "visible", "value": False},
    "up": {"axis": "y"},
    "undo": {},
    "redo": {},
    "channel": {"name": "depth"},
    "display": {"exposure": -1.5, "view": "agx"},
    "quality": {"integrator": "path"},
    "probe": {"id": 7, "image": 4, "u": 0, "v": 1079},
    "pick": {"image": 4, "u": 0, "v": 1079},
    "hold": {"pixel": [24, 16]},
    "follow": {"mode": "detach"},
    "forget": {},
    "explain": {"id": 7, "image": 4, "u": 1919, "v": 0},
    "snapshot": {"format": "png"},
    "copy": {"format": "toml"},
    "ack": {"picture": 3},
    "control": {"id": 3, "value": 0.5},
    "planes": {"wanted": True},
    "tile": {"id": 7, "image": 4, "u": 0, "v": 1079, "width": 32, "height": 256},
    "visible": {"visible": False},
}
WRONG: list[Any] = [
    None,
    [],
    {},
    "x" * 2000,
    True,
    1.5,
    -1,
    2**60,
    float("nan"),
    float("inf"),
    "../../etc/passwd",
]
PATH = WRONG[-1]
TAKEN = {
    **{("locate", field): (1.5, -1) for field in ("u", "v")},
    ("move", "fx"): (1.5,),
    ("ground", "foot"): (1.5,),
    **{(kind, "ratio"): (1.5,) for kind in ("hello", "size")},
    ("display", "exposure"): (1.5, -1),
    ("planes", "wanted"): (True,),
    ("control", "value"): (True, 1.5, -1, PATH),
    **{("look", field): (1.5, -1) for field in ("rotation", "azimuth", "elevation")},
    ("time", "t"): (1.5,),
    **dict.fromkeys([("time", "animation"), ("variant", "name"), ("scan", "lidar")], (PATH,)),
    **{("lens", field): (1.5,) for field in ("fx", "fy")},
    **{("lens", field): (1.5, -1) for field in ("cx", "cy")},
    ("lens", "distortion"): ([],),
    ("open", "others"): ([],),
    ("panes", "names"): ([],),
    ("hold", "pixel"): ([],),
    **{("overlay", field): (True,) for field in ("cameras", "explained", "grid")},
    **{("pose", field): (1.5, -1) for field in ("roll", "pitch", "yaw")},
    ("film", "seconds"): (1.5,),
    ("upload", "data"): ("x" * 2000,),  # this text is valid base64
    ("film", "degrees"): (1.5, -1),
    **{(kind, "name"): (PATH,) for kind in ("upload", "open")},  # refused when the message is handled
    ("edit", "value"): ([], True, 1.5, -1, PATH),
    ("edit_material", "value"): (1.5, -1, PATH),
    **{(kind, "slot"): (-1,) for kind in ("edit_material", "select", "texture", "thumbnails")},  # all slots
    ("visible", "visible"): (True,),
    **{(kind, "file"): (PATH,) for kind in ("texture", "look_image")},  # refused when the message is handled
    ("framing", "zoom"): (1.5,),
    ("framing", "fov"): (1.5,),
    **{(kind, "name"): (PATH,) for kind in ("keep_camera", "remove_camera")},  # any text is a valid name
    **{(kind, "name"): (PATH,) for kind in ("camera", "photograph")},  # no camera has this name
    ("hello", "session"): (PATH,),  # the id is valid, but no such session exists
}
"""The values of `WRONG` that are valid for a field, by message and field."""
CASES = [(kind, field) for kind, made in MESSAGES.items() for field in field_types(made)]


def said(message: str, /, **changed: Any) -> str:
    return json.dumps({"type": message, **GOOD[message], **changed})


def test_each_message_has_an_example() -> None:
    assert GOOD.keys() == MESSAGES.keys()


@pytest.mark.parametrize("kind", MESSAGES)
def test_valid_messages_are_accepted(kind: str) -> None:
    assert parse_message(said(kind)) == MESSAGES[kind](**GOOD[kind])


@pytest.mark.parametrize("kind", MESSAGES)
def test_missing_and_unknown_fields_are_refused(kind: str) -> None:
    with raises(BadMessage, mentions=[kind, *GOOD[kind]]):
        parse_message(said(kind, more=1))
    for field in GOOD[kind]:
        short = {"type": kind, **GOOD[kind]}
        del short[field]
        with raises(BadMessage, mentions=[kind, *GOOD[kind]]):
            parse_message(json.dumps(short))


@pytest.mark.parametrize(("kind", "field"), CASES)
@pytest.mark.parametrize("value", WRONG, ids=repr)
def test_values_of_wrong_type_or_range_are_refused(kind: str, field: str, value: Any) -> None:
    if any(type(value) is type(each) and value == each for each in TAKEN.get((kind, field), ())):
        assert getattr(parse_message(said(kind, **{field: value})), field) == value
        return
    with pytest.raises(BadMessage):
        parse_message(said(kind, **{field: value}))


@pytest.mark.parametrize(
    "data",
    [
        b"{}",
        "",
        "{",
        "[]",
        "null",
        "1",
        '"move"',
        "{}",
        '{"type": 1}',
        '{"type": "exec"}',
        "[" * 60000,
        "NaN",
    ],
)
def test_invalid_data_is_refused(data: str | bytes) -> None:
    with pytest.raises(BadMessage):
        parse_message(data)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: (
        st.lists(inner)
        | st.dictionaries(st.sampled_from(["type", "u", "v", "id", "name", "kind"]) | st.text(), inner)
    ),
    max_leaves=12,
)


@given(JSON, st.sampled_from(sorted(MESSAGES)))
def test_any_json_is_parsed_or_refused_with_bad_message(value: Any, kind: str) -> None:
    for each in (value, {**value, "type": kind} if isinstance(value, dict) else value):
        with contextlib.suppress(BadMessage):
            assert type(parse_message(json.dumps(each))) in MESSAGES.values()


@given(st.text())
def test_any_text_is_refused_with_bad_message(text: str) -> None:
    with pytest.raises(BadMessage):
        parse_message(text)


def test_buffers_start_at_a_multiple_of_four_bytes() -> None:
    data = packed({"type": "picture", "name": "é"}, [b"abc", b"", b"defg"])
    (length,) = struct.unpack_from("<I", data)
    message = json.loads(data[4 : 4 + length])
    assert message == {"type": "picture", "name": "é", "buffers": [3, 0, 4]}
    start = 4 + length + (-length % 4)
    assert start % 4 == 0
    assert data[start:] == b"abcdefg"


def test_typescript_types_are_up_to_date() -> None:
    text = message_types.PATH.read_text(encoding="utf-8")
    assert text == message_types.typescript(), "run: python -m raycam.viewer.message_types"


def test_huge_integers_are_refused() -> None:
    with pytest.raises(BadMessage):
        parse_message('{"type": "time", "t": 1' + "0" * 400 + ', "animation": ""}')
