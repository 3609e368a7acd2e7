"""Worlds: loaded from a file, or built by hand."""

from .parts import Animation, Object, Video
from .point_queries import Topology
from .world import World

__all__ = ["Animation", "Object", "Topology", "Video", "World"]
