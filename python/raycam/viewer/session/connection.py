"""The connection of a session to its client: outgoing messages, and unacknowledged images."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from .camera_messages import CameraMessages

__all__ = ["MAX_UNACKNOWLEDGED", "Connection", "Send"]

MAX_UNACKNOWLEDGED = 2
"""Maximum number of images that a client may have received without a confirmation."""

MAX_MOVING_RATE = 2.4e6
"""Bytes per second of moving images: 19.2 Mbit/s."""

MAX_FOLLOWERS_RATE = 12.5e6
"""Bytes per second of moving images to all followers together: 100 Mbit/s."""

Send = Callable[[dict[str, Any], Sequence[bytes]], None]


class Connection:
    """Sends messages to the session's client while it is connected."""

    def __init__(self) -> None:
        self.id = secrets.token_urlsafe(24)
        """The session's id, with which a client resumes it."""
        self.film_stop = threading.Event()
        """Set to stop the video that is being rendered."""
        self.wants_planes = False
        """True if the client compares images or chose a range: finished images are sent as exact numbers."""
        self._is_plane_due = False
        """True if the next still image is sent as exact numbers, although it may not be finished."""
        self.followers: tuple[Connection, ...] = ()
        """The connections of the followers that receive this client's images, if this client leads."""
        self.cameras = CameraMessages()
        self._latest: tuple[dict[str, Any], Sequence[bytes]] | None = None
        self._pending: tuple[dict[str, Any], Sequence[bytes]] | None = None
        """The newest image, if it waits until earlier images have been confirmed."""
        self._sharing = threading.Lock()
        self._free_at = self._followers_free_at = 0.0
        self._send: Send | None = None
        self._visible = True
        self._sent = 0
        self._acknowledged = 0

    def open(self, send: Send) -> None:
        """Starts sending messages with `send`."""
        self._send = send
        with self._sharing:
            self._sent = self._acknowledged = 0
            self._pending = None
            self.cameras.reset()
        self.wants_planes = self._is_plane_due = False

    def request_planes(self, wanted: bool) -> bool:
        """Sets whether images are sent as exact numbers, from the next image on.

        Returns True if the setting changed.
        """
        if wanted == self.wants_planes:
            return False
        self.wants_planes = self._is_plane_due = wanted
        return True

    def needs_exact(self, is_finished: bool) -> bool:
        """True if a still image is to be sent as exact numbers; `mark_exact_sent` follows."""
        return self.wants_planes and (is_finished or self._is_plane_due)

    def mark_exact_sent(self) -> None:
        """Records that exact numbers were sent; they are sent again only when an image is finished."""
        self._is_plane_due = False

    def close(self) -> None:
        """Drops the client; messages are discarded until `open`."""
        self._send = None

    @property
    def is_open(self) -> bool:
        """True while a client is connected."""
        return self._send is not None

    @property
    def is_ready(self) -> bool:
        """True if the client or one of its followers is visible and can receive another image."""
        return self._has_room or any(each._has_room for each in self.followers)

    @property
    def _has_room(self) -> bool:
        return self.is_open and self._visible and self._sent - self._acknowledged < MAX_UNACKNOWLEDGED

    @property
    def may_move(self) -> bool:
        """True if another moving image can be sent without exceeding `MAX_MOVING_RATE`."""
        return time.monotonic() >= self._free_at

    def note_moving(self, count: int) -> None:
        """Records the bytes of a moving image, which delay the next moving image."""
        self._free_at = time.monotonic() + count / MAX_MOVING_RATE

    @property
    def sent(self) -> int:
        """The number of images that were sent to this client."""
        return self._sent

    @property
    def acknowledged(self) -> int:
        """The number of images that the client has confirmed."""
        return self._acknowledged

    def send(self, message: dict[str, Any], buffers: Sequence[bytes] = ()) -> None:
        """Sends a message, if a client is connected."""
        send = self._send
        if send is not None:
            send(message, buffers)

    def send_camera(self, message: dict[str, Any], *, is_moving: bool = False) -> None:
        """Sends a camera message. While the camera moves, at most one message is sent per image."""
        with self._sharing:
            now = self.cameras.add(message, is_moving=is_moving)
        if now is not None:
            self.send(now)

    def number_image(self) -> tuple[int, dict[str, Any] | None]:
        """Returns the number of the next image, and the camera message that waits for this image.

        The client will acknowledge the number.
        """
        self._sent += 1
        return self._sent, self.cameras.take()

    def _send_image(
        self, number: int, camera: dict[str, Any] | None, message: dict[str, Any], buffers: Sequence[bytes]
    ) -> None:
        """Sends an image, after the camera message that waited for it."""
        if camera is not None:
            self.send(camera)
        self.send({**message, "picture": number}, buffers)

    def broadcast(self, message: dict[str, Any]) -> None:
        """Sends a message to the client and its followers."""
        for each in (self, *self.followers):
            each.send(message)

    def send_image(self, message: dict[str, Any], buffers: Sequence[bytes]) -> None:
        """Sends an image to the client and its followers.

        Each client receives the image with a number, and later acknowledges this number.

        A client that is not ready receives the image later, unless a newer image replaces it. Followers skip images in
        motion that exceed `MAX_FOLLOWERS_RATE`.
        """
        self._deliver(message, buffers)
        followers = self.followers
        self._latest = (message, buffers)
        now = time.monotonic()
        if not followers or (message["moving"] and now < self._followers_free_at):
            return
        count = len(followers) * sum(map(len, buffers))
        self._followers_free_at = now + count / MAX_FOLLOWERS_RATE
        for each in followers:
            each._deliver(message, buffers)

    def send_pane(self, message: dict[str, Any], buffers: Sequence[bytes]) -> None:
        """Sends the image of a pane; the client acknowledges it like any other image."""
        with self._sharing:
            number, camera = self.number_image()
        self._send_image(number, camera, message, buffers)

    def send_latest(self, follower: Connection) -> None:
        """Sends the newest image to a client that has begun to follow."""
        if self._latest is not None:
            follower._deliver(*self._latest)

    def _deliver(self, message: dict[str, Any], buffers: Sequence[bytes]) -> None:
        """Sends an image, or keeps it until the client is ready."""
        with self._sharing:
            self._pending = (message, buffers)
        self._send_pending()

    def _send_pending(self) -> None:
        with self._sharing:
            if self._pending is None or not self._has_room:
                return
            (message, buffers), self._pending = self._pending, None
            number, camera = self.number_image()
        self._send_image(number, camera, message, buffers)

    def acknowledge(self, number: int) -> None:
        """Records that the client has received the images up to `number`."""
        with self._sharing:
            self._acknowledged = max(self._acknowledged, min(number, self._sent))
        self._send_pending()

    def set_visible(self, visible: bool) -> None:
        """Pauses images while the page is hidden."""
        self._visible = visible
        self._send_pending()
