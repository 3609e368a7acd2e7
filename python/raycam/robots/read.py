"""Reading of robot files by their ending."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, SettingsError
from .description import RobotDescription
from .mjcf import CompiledModel, is_mjcf, read_mjcf
from .resolve import FileResolver, read_bytes
from .sdf import read_sdf
from .sdf_cameras import SdfCamera
from .sdf_lights import SdfLight
from .urdf import read_urdf
from .xacro import expand_xacro
from .xml_tree import ROOT_BYTES, XmlLimits, parse_xml, root_tag

__all__ = ["SUFFIXES", "RobotModel", "has_robot_root", "read_robots"]

SUFFIXES = (".urdf", ".xacro", ".sdf", ".xml")
"""Endings of robot files."""
XML_ROOTS = ("robot", "sdf")
"""Root elements of URDF and SDF in .xml files."""


@dataclass
class RobotModel:
    """A robot in a file, with its pose and its cameras."""

    description: RobotDescription
    world_from_root: Floats
    """Pose [4, 4] in the file; the identity for URDF."""
    cameras: list[SdfCamera]
    lights: list[SdfLight] = field(default_factory=list)
    """The lights of the file, with the first robot."""
    mujoco: CompiledModel | None = None
    """The compiled model of an MJCF file, which contains its shapes, cameras and lights; None for files of other
    formats.
    """


def has_robot_root(path: str | os.PathLike[str]) -> bool:
    """Returns True if the root element of an .xml file is that of MJCF, URDF or SDF.

    Raises `OSError` if the file cannot be read.
    """
    with Path(path).open("rb") as file:
        tag = root_tag(file.read(ROOT_BYTES))
    return is_mjcf(tag) or tag in XML_ROOTS


def read_robots(
    path: str | os.PathLike[str], files: FileResolver, xacro_args: Mapping[str, str] | None = None
) -> list[RobotModel]:
    """Reads the robots of a file: one robot, or each model of an SDF file.

    The root element of an .xml file determines whether it is MJCF, URDF or SDF. `xacro_args` are arguments of a xacro
    file.

    Raises `OSError`, `FormatError` with file and line for a malformed file and for other endings, `SettingsError` for
    `xacro_args` of another file, and the errors of `expand_xacro`.
    """
    name, suffix = os.fspath(path), Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FormatError(
            f"{name}: unknown kind of robot file; expected {', '.join(SUFFIXES)}", code="unknown_format"
        )
    if suffix == ".xacro":
        document, notices = expand_xacro(Path(path), files, xacro_args or {})
        found = read_urdf(document, f"{name} (expanded)")
        found.notices[:0] = notices
        return [RobotModel(found, np.eye(4), [])]
    if xacro_args:
        raise SettingsError(f"{name}: xacro_args requires an .xacro file", code="conflicting_values")
    data = read_bytes(Path(path), XmlLimits().bytes)
    if suffix == ".xml":
        root = parse_xml(data, name)
        if is_mjcf(root.tag):
            description, compiled = read_mjcf(Path(path), root, files)
            return [RobotModel(description, np.eye(4), [], mujoco=compiled)]
        if root.tag not in XML_ROOTS:
            raise FormatError(
                f"{name}: the root element is <{root.tag}>; expected <mujoco>, <robot> (URDF) or <sdf>",
                code="unknown_format",
            )
        suffix = ".sdf" if root.tag == "sdf" else ".urdf"
    if suffix == ".sdf":
        models = read_sdf(data, name, files)
        return [RobotModel(one.description, one.world_from_model, one.cameras, one.lights) for one in models]
    return [RobotModel(read_urdf(data, name), np.eye(4), [])]
