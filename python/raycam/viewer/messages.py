"""Messages as JSON: checks of client messages, and packing of server messages.

Client messages are checked against their dataclasses.

A server message is a dict and a list of buffers. On the WebSocket, it consists of the JSON's length as uint32, the
JSON, zeros up to a multiple of 4, and the buffers in order. `buffers` in the JSON contains the lengths of the buffers.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import types
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from .client_messages import MESSAGES, Length, Message, Range

__all__ = ["MAX_MESSAGE_BYTES", "BadMessage", "field_types", "packed", "parse_message"]

MAX_MESSAGE_BYTES = 64 * 1024
"""The longest message of a client."""

Check = Callable[[Any], bool]


class BadMessage(ValueError):
    """A message of a client that does not follow the protocol."""


def field_types(kind: type[Message]) -> dict[str, Any]:
    """The fields of a message class with their annotated types."""
    hints = get_type_hints(kind, include_extras=True)
    return {each.name: hints[each.name] for each in dataclasses.fields(kind)}


def _check_of(annotation: Any) -> Check:
    """Returns the check for values of an annotated type."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return lambda value: type(value) is str and value in arguments
    if origin in (Union, types.UnionType):
        checks = [_check_of(each) for each in arguments]
        return lambda value: any(check(value) for check in checks)
    if origin is Annotated:
        base, *limits = arguments
        if get_origin(base) is list:
            lengths = [each for each in limits if isinstance(each, Length)]
            (item,) = get_args(base)
            each_item = _limited(_check_of(item), [each for each in limits if isinstance(each, Range)])
            return lambda value: (
                type(value) is list
                and all(each.accepts(value) for each in lengths)
                and all(map(each_item, value))
            )
        return _limited(_check_of(base), limits)
    if annotation is float:
        return lambda value: type(value) in (int, float)
    return lambda value: type(value) is annotation


def _limited(check: Check, limits: Sequence[Any]) -> Check:
    return lambda value: check(value) and all(limit.accepts(value) for limit in limits)


CHECKS = {
    name: {field: _check_of(type_) for field, type_ in field_types(kind).items()}
    for name, kind in MESSAGES.items()
}
"""The checks of each message's fields."""


def parse_message(data: str | bytes) -> Message:
    """Parses the message in a WebSocket frame; raises `BadMessage` if it is malformed."""
    if not isinstance(data, str):
        raise BadMessage("expected a text message, got bytes")
    try:
        content = json.loads(data, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        raise BadMessage("expected a JSON message") from None
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise BadMessage("expected a JSON object with a type")
    given = content.pop("type")
    kind = MESSAGES.get(given)
    if kind is None:
        raise BadMessage(f"unknown message type {given[:80]!r}; expected one of {', '.join(MESSAGES)}")
    checks = CHECKS[kind.KIND]
    if content.keys() != checks.keys():
        raise BadMessage(f"{kind.KIND}: expected the fields {', '.join(checks) or '(none)'}")
    for name, check in checks.items():
        if not check(content[name]):
            raise BadMessage(f"{kind.KIND}.{name}: wrong type or out of range")
    return kind(**content)


def _refuse_constant(word: str) -> None:
    raise ValueError(word)


def packed(message: dict[str, Any], buffers: Sequence[bytes] = ()) -> bytes:
    """Returns a server message as a WebSocket frame."""
    text = json.dumps({**message, "buffers": [len(each) for each in buffers]}, allow_nan=False).encode()
    return b"".join([struct.pack("<I", len(text)), text, bytes(-len(text) % 4), *buffers])
