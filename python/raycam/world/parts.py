"""Records of a world's objects, video and animations."""

from __future__ import annotations

from dataclasses import dataclass

from ..arguments import Floats
from ..errors import WorldError


@dataclass(repr=False)
class Object:
    """A placed mesh of a world, an instance in the ground truth.

    Objects are read-only; `World.set_object` changes objects.
    """

    id: int
    """The object's value in the channel `instance`."""
    name: str
    """The object's name, unique within the world."""
    category: str | None
    """The object's class for data sets, or None."""
    mesh: int
    """The index of the mesh, which other objects may share."""
    triangles: int
    """The number of triangles of the mesh."""
    matrix: Floats
    """The affine transform world_from_mesh [4, 4], read-only."""
    visible: bool = True
    """False for an object that is excluded from images, shadows, light and queries."""
    shadow_catcher: bool = False
    """True for a shadow catcher: images with a transparent background or a background photo show only its shadows."""
    materials: tuple[str, ...] = ()
    """The name of the material in each material slot; `World.set_object` changes single slots with the key `slots`."""

    def __repr__(self) -> str:
        """Number, name, category, triangles and position as text."""
        x, y, z = (f"{value:.6g}" for value in self.matrix[:3, 3])
        category = "" if self.category is None else f", category {self.category!r}"
        marks = "" if self.visible else ", invisible"
        marks += ", shadow catcher" if self.shadow_catcher else ""
        return (
            f"Object {self.id} {self.name!r}{category}: {self.triangles} triangles of mesh {self.mesh} "
            f"at ({x}, {y}, {z}){marks}"
        )

    def __setattr__(self, name: str, value: object) -> None:
        """Raises `WorldError` with the call that changes the object."""
        if name not in self.__dict__ and name in self.__dataclass_fields__:
            object.__setattr__(self, name, value)  # set once, at creation
            return
        raise WorldError(
            f"objects are read-only; world.set_object({self.name!r}, {name}=...) changes the object",
            code="read_only",
        )

    def __delattr__(self, name: str) -> None:
        """Raises `WorldError`, because objects are read-only."""
        raise WorldError(
            f"objects are read-only; world.remove_object({self.name!r}) removes the object", code="read_only"
        )


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
    """The animation's name; empty if the file specifies no name."""
    duration: float
    """The time of the animation's last keyframe, in seconds."""
