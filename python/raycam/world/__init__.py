"""Worlds: loaded from a file or built in Python."""

from .parts import Animation, Object, Video
from .point_queries import Topology
from .world import World

__all__ = ["Animation", "Object", "Topology", "Video", "World"]
