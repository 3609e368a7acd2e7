"""The messages of a client: one table of names, fields and ranges. What is not in it is refused.

A message of the server is a dict and a list of buffers. On the WebSocket: the length of the JSON as uint32, the JSON,
zeros up to a multiple of 4, and the buffers one after the other, whose lengths are `buffers` of the JSON.
"""

from __future__ import annotations

import json
import math
import re
import struct
from collections.abc import Callable, Sequence
from typing import Any

from ..render.frame import CHANNELS, VIEWS
from .scene.gizmo import HANDLES, TOOLS

__all__ = ["LONGEST", "MESSAGES", "BadMessage", "message_of", "packed"]

LONGEST = 64 * 1024
"""The bytes of a message of a client at most."""
WIDEST = (1920, 1080)
"""The pixels of a picture that a client may ask for at most."""

LONGEST_CHUNK = 60_000
"""The letters of a piece of an upload at most."""
BASE64 = re.compile(r"(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?")

Check = Callable[[Any], bool]


class BadMessage(ValueError):
    """A message that is not in the table; the text says why."""


def _whole(low: int, high: int) -> Check:
    return lambda value: type(value) is int and low <= value <= high


def _number(low: float, high: float) -> Check:
    return lambda value: type(value) in (int, float) and math.isfinite(value) and low <= value <= high


def _one_of(*words: str) -> Check:
    return lambda value: type(value) is str and value in words


def _text(most: int) -> Check:
    return lambda value: type(value) is str and len(value) <= most


def _flag(value: Any) -> bool:
    return type(value) is bool


def _numbers(most: int, low: float, high: float) -> Check:
    each = _number(low, high)
    return lambda value: type(value) is list and len(value) <= most and all(map(each, value))


def _vector(length: int, low: float, high: float) -> Check:
    each = _number(low, high)
    return lambda value: type(value) is list and len(value) == length and all(map(each, value))


def _base64(value: Any) -> bool:
    """Some bytes as base64."""
    return type(value) is str and len(value) <= LONGEST_CHUNK and BASE64.fullmatch(value) is not None


def _value(value: Any) -> bool:
    """A switch, a number, a short text or up to four numbers."""
    number = _number(-1e9, 1e9)
    return _flag(value) or number(value) or _text(64)(value) or _numbers(4, -1e9, 1e9)(value)


_seq = _whole(0, 2**53)
_pixel = {"u": _whole(0, WIDEST[0] - 1), "v": _whole(0, WIDEST[1] - 1)}

MESSAGES: dict[str, dict[str, Check]] = {
    "hello": {
        "width": _whole(1, 10000),
        "height": _whole(1, 10000),
        "ratio": _number(0.1, 10),
        "session": _text(64),
    },
    "size": {"width": _whole(1, 10000), "height": _whole(1, 10000), "ratio": _number(0.1, 10)},
    # dx and dy in pixels of the picture, steps or metres by the kind; u and v where the pointer is, or what to frame.
    "nav": {
        "seq": _seq,
        "kind": _one_of(
            "orbit", "pan", "dolly", "look", "move", "walk", "roll", "fit", "frame", "pivot", "home"
        ),
        "dx": _number(-1e4, 1e4),
        "dy": _number(-1e4, 1e4),
        "dz": _number(-1e4, 1e4),
        "u": _number(-1e4, 1e4),
        "v": _number(-1e4, 1e4),
    },
    "camera": {"name": _text(1000)},
    "time": {"t": _number(0, 1e6), "animation": _text(1000)},
    "variant": {"name": _text(1000)},
    # Pixels of the camera's own size; coefficients as its lens model has them.
    "lens": {
        **dict.fromkeys(("fx", "fy"), _number(1e-3, 1e7)),
        **dict.fromkeys(("cx", "cy"), _number(-1e7, 1e7)),
        "distortion": _numbers(32, -1e6, 1e6),
    },
    # Metres and degrees of the camera looked through.
    "pose": {
        "location": _vector(3, -1e9, 1e9),
        **dict.fromkeys(("roll", "pitch", "yaw"), _number(-1e4, 1e4)),
    },
    "overlay": {"cameras": _flag, "explained": _flag, "grid": _flag},
    "edit": {
        "kind": _one_of("object", "light"),
        "number": _whole(0, 10**6),
        "key": _one_of(
            *("visible", "color", "roughness", "metallic", "emission", "move", "turn", "scale", "strength")
        ),
        "value": _value,
    },
    # The object that is chosen, and the gizmo on it.
    "select": {"number": _whole(0, 10**6), "tool": _one_of("none", *TOOLS)},
    # A drag of a handle between two places of the picture; those of one stroke are one step of undo.
    "gizmo": {
        "handle": _one_of(*HANDLES),
        "stroke": _seq,
        "begin": _vector(2, -1e4, 1e4),
        "end": _vector(2, -1e4, 1e4),
    },
    "undo": {},
    "redo": {},
    "channel": {"name": _one_of(*CHANNELS)},
    "display": {"exposure": _number(-100, 100), "view": _one_of(*VIEWS)},
    "quality": {"integrator": _one_of("direct", "path")},
    "probe": {"id": _seq, **_pixel},
    "pick": _pixel,
    "explain": {"id": _seq, **_pixel},
    "snapshot": {"format": _one_of("png", "html", "npz", "glb", "toml")},
    # A turn around the pivot; of 0 degrees the world's own movement. Then its end before that.
    "film": {"seconds": _number(0.1, 60), "degrees": _number(-720, 720)},
    "stop": {},
    # A piece of a file that is dropped on the page, in order; then its opening.
    "upload": {
        "name": _text(100),
        "bytes": _whole(1, 2**28),
        "offset": _whole(0, 2**28),
        "data": _base64,
    },
    "open": {"name": _text(100)},
    "copy": {"format": _one_of("python", "toml", "command", "opencv", "colmap")},
    "ack": {"picture": _seq},
    "visible": {"visible": _flag},
}
"""The fields of every message, each required, and what they may be."""


def message_of(data: str | bytes) -> dict[str, Any]:
    """The message in a frame of the WebSocket. Raises `BadMessage`."""
    if not isinstance(data, str):
        raise BadMessage("messages are text")
    try:
        message = json.loads(data, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise BadMessage("messages are JSON") from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise BadMessage("messages are objects with a type")
    kind = message["type"]
    if kind not in MESSAGES:
        raise BadMessage("there is no message of this type")
    fields = MESSAGES[kind]
    if message.keys() - {"type"} != fields.keys():
        raise BadMessage(f"{kind} has the fields {', '.join(fields)}")
    for name, check in fields.items():
        if not check(message[name]):
            raise BadMessage(f"{kind}: {name} is of another type or out of range")
    return message


def _no_constant(word: str) -> None:
    raise ValueError(word)


def packed(message: dict[str, Any], buffers: Sequence[bytes] = ()) -> bytes:
    """A message of the server as a frame of the WebSocket."""
    text = json.dumps({**message, "buffers": [len(each) for each in buffers]}, allow_nan=False).encode()
    return b"".join([struct.pack("<I", len(text)), text, bytes(-len(text) % 4), *buffers])
