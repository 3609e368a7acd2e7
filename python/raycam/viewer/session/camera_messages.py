"""The camera messages of a connection: at most one message per image while the camera moves."""

from __future__ import annotations

from typing import Any

__all__ = ["CameraMessages"]


class CameraMessages:
    """Decides when camera messages are sent. Calls are made under the connection's lock."""

    def __init__(self) -> None:
        self.last_move = 0
        """The number of the client's last camera move, which camera messages contain."""
        self._waiting: dict[str, Any] | None = None
        self._was_sent = False

    def reset(self) -> None:
        """Discards the waiting message; called if a new client connects."""
        self._waiting, self._was_sent = None, False

    def add(self, message: dict[str, Any], *, is_moving: bool) -> dict[str, Any] | None:
        """Returns the message if it must be sent immediately; otherwise stores it.

        The stored message replaces the message that waits.
        """
        waits = is_moving and self._was_sent
        self._waiting, self._was_sent = message if waits else None, True
        return None if waits else message

    def take(self) -> dict[str, Any] | None:
        """Returns the message that waits for the next image, or None.

        This method is called before each image is sent.
        """
        message, self._waiting = self._waiting, None
        self._was_sent = message is not None
        return message
