"""What a world tells of its parts."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Floats


@dataclass(frozen=True)
class Object:
    """A placed mesh of a world: what the ground truth calls an instance."""

    id: int
    """Its number in the channel `instance`."""
    name: str
    """Unique within the world."""
    category: str | None
    """Its class, for data sets."""
    mesh: int
    """The number of its mesh, which other objects may share."""
    triangles: int
    """How many triangles its mesh has."""
    matrix: Floats
    """The affine transform world_from_mesh [4, 4]."""


@dataclass(frozen=True)
class Video:
    """What `[video]` of a world says: frame n shows `world.at(n / fps)`."""

    fps: float
    """Frames per second."""
    seconds: float
    """Its length."""
    frames: int
    """How many frames it has."""


@dataclass(frozen=True)
class Animation:
    """What moves a world: `world.at(time, animation=name)` with 0 <= time <= duration."""

    name: str
    """Empty where the file gives none."""
    duration: float
    """The time of its last keyframe, in seconds."""
