"""A client of the live view that follows the protocol."""

from __future__ import annotations

import contextlib
import json
import struct
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from .patience import PATIENCE

SPACE = {"width": 48, "height": 32, "ratio": 1}
IN_IMAGE = ("probe", "pick", "explain", "locate", "tile")
"""The messages about a pixel, which contain the number of its image."""


class Client:
    """A client that follows the protocol and acknowledges images."""

    def __init__(self, socket: ClientConnection, session: str = "") -> None:
        self.socket = socket
        self.pictures: list[tuple[dict[str, Any], bytes]] = []
        self.image = 0
        """The number of the image that was received last."""
        self.say("hello", session=session, **SPACE)
        self.welcome = self.hear("welcome")[0]

    def say(self, kind: str, /, **fields: Any) -> None:
        if kind in IN_IMAGE:
            fields.setdefault("image", self.image)
        self.socket.send(json.dumps({"type": kind, **fields}))

    def next(self) -> tuple[dict[str, Any], list[bytes]]:
        """The next message, with its buffers."""
        data = self.socket.recv(timeout=PATIENCE)
        assert isinstance(data, bytes)
        (length,) = struct.unpack_from("<I", data)
        message = json.loads(data[4 : 4 + length])
        at = 4 + length + (-length % 4)
        buffers = []
        for size in message["buffers"]:
            buffers.append(data[at : at + size])
            at += size
        if message["type"] == "picture":
            self.pictures.append((message, buffers[0]))
            self.image = message["image"]
            # The server may have closed in the meantime, but earlier messages can still be read.
            with contextlib.suppress(ConnectionClosed):
                self.say("ack", picture=message["picture"])
        return message, buffers

    def hear(self, kind: str, **fields: Any) -> tuple[dict[str, Any], list[bytes]]:
        """The next message of a type with these fields; other messages are skipped."""
        while True:
            message, buffers = self.next()
            if message["type"] == kind and all(message.get(name) == value for name, value in fields.items()):
                return message, buffers
