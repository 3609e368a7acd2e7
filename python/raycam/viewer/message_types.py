"""The client's messages as TypeScript types.

`python -m raycam.viewer.message_types` writes `client/messages.d.ts`.
"""

from __future__ import annotations

import textwrap
import types
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from .client_messages import MESSAGES, OneOf
from .messages import field_types

__all__ = ["PATH", "typescript"]

PATH = Path(__file__).parent / "client" / "messages.d.ts"
MAX_LINE_LENGTH = 100
"""The maximum length of the lines that list all types, without indentation."""
PLAIN = {bool: "boolean", int: "number", float: "number", str: "string"}


def typescript() -> str:
    """The text of `client/messages.d.ts`."""
    parts = ["// Written by `python -m raycam.viewer.message_types`; change client_messages.py instead.\n"]
    for kind in MESSAGES.values():
        fields = [f'  type: "{kind.KIND}";']
        fields += [f"  {name}: {_type_of(annotation)};" for name, annotation in field_types(kind).items()]
        body = "\n".join(fields)
        parts.append(f"/** {kind.__doc__} */\nexport interface {kind.__name__} {{\n{body}\n}}\n")
    names = " | ".join(kind.__name__ for kind in MESSAGES.values())
    lines = textwrap.indent(textwrap.fill(names, MAX_LINE_LENGTH), "  ")
    parts.append(f"/** Any message of a client. */\nexport type ClientMessage =\n{lines};\n")
    return "\n".join(parts)


def _type_of(annotation: Any) -> str:
    """The TypeScript type of an annotated type."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return " | ".join(f'"{word}"' for word in arguments)
    if origin in (Union, types.UnionType):
        return " | ".join(_type_of(each) for each in arguments)
    if origin is Annotated:
        words = [word for limit in arguments[1:] if isinstance(limit, OneOf) for word in limit.words]
        return " | ".join(f'"{word}"' for word in words) or _type_of(arguments[0])
    if origin is list:
        return f"{_type_of(arguments[0])}[]"
    return PLAIN[annotation]


if __name__ == "__main__":
    PATH.write_text(typescript(), encoding="utf-8")
