"""Robots in GLB files: a node for each link, and the motion of the joints as an animation."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from ..errors import Notice
from ..io.glb import pack_glb
from ..robots import Robot, quaternion_matrices, quaternions_of

if TYPE_CHECKING:
    from .contents import WorldContents

__all__ = ["gltf_bytes"]

TOLERANCE = 1e-7
"""Maximum cosine of the angle between a transform's axes; with a larger cosine, the transform contains shear."""


def gltf_bytes(world: WorldContents) -> tuple[bytes, list[Notice]]:
    """Returns a world as GLB, with notices about properties that glTF cannot represent.

    A robot is a node with its name, below which each link is a node at its pose relative to its parent link; shapes and
    cameras are below their links. Joint keyframes of a video become the animation "joints". Raises `FormatError` if the
    file would exceed 4 GiB.
    """
    robots = list(world._robots.values())
    moving = [robot for robot in robots if robot._motion is not None]
    whole = bool(moving) and all(robot._motion is not None and robot._motion.whole_video for robot in moving)
    data, notices = _core.world_to_gltf(world._core, whole)
    if not robots:
        return data, notices
    file = _GlbFile(data)
    for robot in robots:
        file.add_robot(robot)
    file.add_animation()
    return file.to_bytes(), notices


class _GlbFile:
    """A GLB file whose nodes are moved below the links of robots.

    The moved nodes are shapes and cameras, which have no parents.
    """

    def __init__(self, data: bytes) -> None:
        length = struct.unpack("<I", data[12:16])[0]
        self._document: dict[str, Any] = json.loads(data[20 : 20 + length])
        size = struct.unpack("<I", data[20 + length : 24 + length])[0] if len(data) > 20 + length else 0
        self._binary = bytearray(data[28 + length : 28 + length + size])
        self._nodes: list[dict[str, Any]] = self._document.setdefault("nodes", [])
        scene: dict[str, Any] = self._document.setdefault("scenes", [{"nodes": []}])[0]
        self._document.setdefault("scene", 0)
        roots: list[int] = scene["nodes"]
        is_turned = len(roots) == 1 and self._nodes[roots[0]].get("name") == "y up"
        self._siblings: list[int] = self._nodes[roots[0]]["children"] if is_turned else roots
        self._flat = {
            (kind, self._nodes[number].get("name")): number
            for kind in ("mesh", "camera")
            for number in self._siblings
            if kind in self._nodes[number]
        }
        self._moving: list[tuple[int, Floats, Floats]] = []

    def add_robot(self, robot: Robot) -> None:
        """Adds the nodes of a robot, and moves its shapes and cameras below them."""
        kinematics = robot._kinematics
        root = self._add_node(robot.name, robot.world_from_root)
        self._siblings.append(root)
        links = {kinematics.root: self._add_node(kinematics.root, np.eye(4), root)}
        poses = {link: found[0] for link, found in kinematics.poses(robot._values[None]).items()}
        for joint in kinematics.order:
            local = kinematics.parent_from_child(joint, robot._values[None]).reshape(4, 4)
            links[joint.child] = self._add_node(joint.child, local, links[joint.parent])
        for kind, parts in (("mesh", robot._parts), ("camera", robot._cameras)):
            for name, link, _ in parts:
                self._attach((kind, name), links[link], robot.world_from_root @ poses[link])
        if robot._motion is None:
            return
        for joint in kinematics.order:
            local = kinematics.parent_from_child(joint, robot._motion.vectors)
            if joint.type != "fixed" and np.ptp(local, axis=0).max() > 0:
                self._moving.append((links[joint.child], robot._motion.times, local))

    def add_animation(self) -> None:
        """Adds the animation of the joints, if any joint moves."""
        channels: list[dict[str, Any]] = []
        samplers: list[dict[str, Any]] = []
        inputs: dict[int, int] = {}
        for node, times, local in self._moving:
            if id(times) not in inputs:
                inputs[id(times)] = self._accessor(times[:, None], "SCALAR", bounds=True)
            rotations = quaternions_of(local[:, :3, :3])
            # Neighbouring quaternions get equal signs, so that they are interpolated along the shorter arc.
            for row in range(1, len(rotations)):
                if rotations[row] @ rotations[row - 1] < 0:
                    rotations[row] *= -1
            for path, values in (("translation", local[:, :3, 3]), ("rotation", rotations)):
                if np.ptp(values, axis=0).max() == 0:
                    continue
                output = self._accessor(values, "VEC3" if path == "translation" else "VEC4")
                channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
                samplers.append({"input": inputs[id(times)], "output": output, "interpolation": "LINEAR"})
        if channels:
            animations = self._document.setdefault("animations", [])
            animations.append({"name": "joints", "channels": channels, "samplers": samplers})

    def to_bytes(self) -> bytes:
        """Returns the file; raises `FormatError` if it would be too large."""
        return pack_glb(self._document, bytes(self._binary))

    def _add_node(self, name: str, parent_from_node: Floats, parent: int | None = None) -> int:
        node: dict[str, Any] = {"name": name}
        _place(node, parent_from_node)
        self._nodes.append(node)
        number = len(self._nodes) - 1
        if parent is not None:
            self._nodes[parent].setdefault("children", []).append(number)
        return number

    def _attach(self, key: tuple[str, str], link: int, world_from_link: Floats) -> None:
        """Moves a node below a link, unless its transform relative to the link would contain shear."""
        number = self._flat.get(key)
        if number is None:
            return
        node = self._nodes[number]
        local = np.linalg.inv(world_from_link) @ _matrix(node)
        if _place(node, local):
            self._siblings.remove(number)
            self._nodes[link].setdefault("children", []).append(number)

    def _accessor(self, values: npt.NDArray[Any], kind: str, *, bounds: bool = False) -> int:
        """Adds an accessor of float32 values [n, k]; returns the accessor's index."""
        array = np.ascontiguousarray(values, dtype="<f4")
        self._binary += bytes(-len(self._binary) % 4)
        views = self._document.setdefault("bufferViews", [])
        views.append({"buffer": 0, "byteOffset": len(self._binary), "byteLength": array.nbytes})
        self._binary += array.tobytes()
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1,
            "componentType": 5126,
            "count": len(array),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors = self._document.setdefault("accessors", [])
        accessors.append(accessor)
        return len(accessors) - 1


def _matrix(node: dict[str, Any]) -> Floats:
    """The transform [4, 4] of a node with translation, rotation and scale."""
    found = np.eye(4)
    rotation = quaternion_matrices(np.array([node.get("rotation", [0, 0, 0, 1])], np.float64))[0]
    found[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]), np.float64)
    found[:3, 3] = node.get("translation", [0, 0, 0])
    return found


def _place(node: dict[str, Any], matrix: Floats) -> bool:
    """Sets a node's translation, rotation and scale.

    Returns False without changes if the matrix contains shear.
    """
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    axes = matrix[:3, :3] / scale
    if abs(axes.T @ axes - np.eye(3)).max() > TOLERANCE:
        return False
    if np.linalg.det(axes) < 0:
        scale[0], axes[:, 0] = -scale[0], -axes[:, 0]
    for key in ("translation", "rotation", "scale"):
        node.pop(key, None)
    if matrix[:3, 3].any():
        node["translation"] = matrix[:3, 3].tolist()
    if abs(axes - np.eye(3)).max() > 1e-15:
        node["rotation"] = quaternions_of(axes[None])[0].tolist()
    if abs(scale - 1).max() > 1e-12:
        node["scale"] = scale.tolist()
    return True
