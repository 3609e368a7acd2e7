"""Records of a world's objects, video and animations."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Floats


@dataclass(frozen=True)
class Object:
    """A placed mesh of a world, an instance in the ground truth."""

    id: int
    """The object's value in the channel `instance`."""
    name: str
    """The object's name, unique within the world."""
    category: str | None
    """The object's class for data sets; None for none."""
    mesh: int
    """The index of the mesh, which other objects may share."""
    triangles: int
    """The number of triangles of the mesh."""
    matrix: Floats
    """The affine transform world_from_mesh [4, 4]."""


@dataclass(frozen=True)
class Video:
    """The video of a world: frame n shows `world.at(n / fps)`."""

    fps: float
    """Frames per second."""
    seconds: float
    """The duration."""
    frames: int
    """The number of frames."""


@dataclass(frozen=True)
class Animation:
    """An animation of a world: `world.at(time, animation=name)` with 0 <= time <= duration."""

    name: str
    """The animation's name; empty for an unnamed one."""
    duration: float
    """The time of its last keyframe, in seconds."""
