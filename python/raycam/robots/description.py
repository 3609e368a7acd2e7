"""Robot descriptions as plain data: links, joints, visuals and materials.

Lengths are in metres and angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..arguments import Floats
from ..errors import Notice

__all__ = ["JOINT_TYPES", "Geometry", "Joint", "JointType", "Link", "Material", "RobotDescription", "Visual"]

JointType = Literal["revolute", "continuous", "prismatic", "planar", "floating", "ball", "fixed"]
JOINT_TYPES: tuple[JointType, ...] = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")
"""The types of URDF; ball joints occur in MJCF."""


@dataclass(frozen=True)
class Material:
    """A material of a visual; parts that are None are not specified."""

    name: str = ""
    rgba: tuple[float, float, float, float] | None = None
    """Red, green, blue (sRGB) and opacity, each 0..1."""
    texture: str | None = None
    """The texture's file name as written in the description."""
    roughness: float | None = None
    """Roughness 0..1 of the principled material."""
    metallic: float | None = None
    """Metalness 0..1 of the principled material."""
    emission: tuple[float, float, float] | None = None
    """Emitted red, green, blue (sRGB), each 0..1."""


@dataclass(frozen=True)
class Geometry:
    """A shape: "box", "cylinder", "sphere", "capsule" or "mesh"."""

    kind: str
    size: tuple[float, ...] = ()
    """Box: three sides; cylinder and capsule: radius and length along z; sphere: radius. Empty for a mesh."""
    file: str = ""
    """The mesh's file name as written in the description."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors of the mesh's coordinates."""


@dataclass(frozen=True)
class Visual:
    """A shape of a link."""

    link_from_visual: Floats
    """The transform link_from_visual, [4, 4]."""
    geometry: Geometry
    material: Material
    line: int


@dataclass
class Link:
    """A rigid body with its visible shapes and its collision shapes."""

    name: str
    line: int
    visuals: list[Visual] = field(default_factory=list)
    collisions: list[Visual] = field(default_factory=list)


@dataclass
class Joint:
    """A joint, which places the link `child` relative to the link `parent`."""

    name: str
    type: JointType
    parent: str
    child: str
    line: int
    parent_from_joint: Floats
    """Transform [4, 4] at the joint's zero."""
    axis: Floats
    """Unit vector [3] in the joint's frame: the axis of rotation or translation, or the normal of a planar joint."""
    lower: float = -np.inf
    upper: float = np.inf
    mimic: tuple[str, float, float] | None = None
    """The followed joint, multiplier and offset."""
    joint_from_child: Floats | None = None
    """Transform [4, 4] of the child link in the joint's frame after its motion; None for the identity, as in URDF."""
    initial: tuple[float, ...] | None = None
    """The initial values; None for zero, or for the limit nearest to zero if zero is not allowed."""


@dataclass
class RobotDescription:
    """A robot: a tree of links and joints."""

    name: str
    file: str
    """The file's path, for messages."""
    links: dict[str, Link]
    joints: dict[str, Joint]
    """All joints by name, in the order of the file."""
    notices: list[Notice] = field(default_factory=list)
    document: str = field(default="", repr=False)
    """The text of the URDF, of a xacro file after its expansion; empty for other formats."""
