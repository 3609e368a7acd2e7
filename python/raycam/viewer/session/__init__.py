"""A client's session: the client's connection, view and images."""

from .connection import Connection
from .following import MOST_FOLLOWERS, MOST_FREE, Following
from .images import DEFAULT_SAMPLES, Images
from .pace import Pace
from .panes import Pane
from .sent_views import Pixel
from .session import Session
from .view import MAX_STILL_SIZE, Opened, View, lens_of, pose_of, world_at

__all__ = [
    "DEFAULT_SAMPLES",
    "MAX_STILL_SIZE",
    "MOST_FOLLOWERS",
    "MOST_FREE",
    "Connection",
    "Following",
    "Images",
    "Opened",
    "Pace",
    "Pane",
    "Pixel",
    "Session",
    "View",
    "lens_of",
    "pose_of",
    "world_at",
]
