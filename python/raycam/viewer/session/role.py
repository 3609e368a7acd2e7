"""The rights of a session's client, and the session that it follows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from .images import Images

__all__ = ["Role"]


@dataclass
class Role:
    """The rights of a session, and its own view while it follows another session."""

    own_images: Images
    """The images of the session's own view."""
    space: tuple[int, int]
    """The space for the image in the client's window, device pixels."""
    allows_open: bool = False
    """True if the client may open files."""
    is_read_only: bool = False
    """True for a client that cannot change the world, although other clients can."""
    is_attached: bool = False
    """True while the session shows another session's view and images."""
    display: dict[str, Any] = field(default_factory=dict)
    """The leader's channel, display, time and held pixel that the client shows."""
    on_show: Callable[[], None] | None = None
    """Called after each change of the view."""
