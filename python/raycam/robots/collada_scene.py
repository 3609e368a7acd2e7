"""The nodes of a Collada document: geometries with their transforms and materials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Floats
from ..errors import FormatError
from .transforms import rotations_about

__all__ = ["Placed", "placed_geometries"]

MAX_NODES = 200_000
"""Maximum number of nodes per scene, counted for every instance."""
MAX_DEPTH = 100
"""Maximum nesting depth of nodes, including instances of nodes."""


class Placed(NamedTuple):
    """A geometry in the scene."""

    geometry: str
    """The geometry's id."""
    matrix: Floats
    """Transform scene_from_geometry [4, 4]."""
    materials: dict[str, str]
    """Material ids by symbol."""
    is_skin: bool
    """True if the geometry belongs to a skin or morph, which is shown at rest."""


def placed_geometries(document: Any, name: str) -> Iterator[Placed]:
    """Iterates over the geometries of the document's scene (pycollada's `Collada`), depth first.

    pycollada's own scene omits nodes with faulty materials. Raises `FormatError` for circular instances, too many
    nodes, and transforms without numbers.
    """
    yield from _Scene(document, name).geometries()


class _Scene:
    def __init__(self, document: Any, name: str) -> None:
        self._name, self._tag = name, document.tag
        self._root = document.xmlnode.getroot()
        self._ids = {node.get("id"): node for node in self._root.iter() if node.get("id")}
        self._nodes = 0

    def geometries(self) -> Iterator[Placed]:
        """Yields the geometries of the scene.

        If the document selects no visual scene, the geometries of all visual scenes are returned.
        """
        instance = self._root.find(f"{self._tag('scene')}/{self._tag('instance_visual_scene')}")
        scene = None if instance is None else self._target(instance, "url")
        scenes = [scene] if scene is not None else list(self._root.iter(self._tag("visual_scene")))
        for each in scenes:
            for node in each.findall(self._tag("node")):
                yield from self._node(node, np.eye(4), 0)

    def _node(self, node: Any, parent: Floats, depth: int) -> Iterator[Placed]:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise FormatError(
                f"{self._name}: too many nodes; the limit is {MAX_NODES}", code="budget_exceeded"
            )
        if depth > MAX_DEPTH:
            raise FormatError(
                f"{self._name}: nodes are nested too deeply or in a circle; the limit is {MAX_DEPTH}",
                code="budget_exceeded",
            )
        matrix = parent
        for child in node:
            tag = str(child.tag).rpartition("}")[2]
            if tag in TRANSFORMS:
                matrix = matrix @ self._transform(tag, child)
            elif tag == "node":
                yield from self._node(child, matrix, depth + 1)
            elif tag == "instance_node":
                target = self._target(child, "url")
                if target is not None:
                    yield from self._node(target, matrix, depth + 1)
            elif tag == "instance_geometry":
                yield Placed(child.get("url", "").lstrip("#"), matrix, self._materials(child), False)
            elif tag == "instance_controller":
                yield from self._skin(child, matrix)

    def _skin(self, instance: Any, matrix: Floats) -> Iterator[Placed]:
        """The geometry of a skin or morph at rest; a skin's source may be a morph."""
        controller, place = self._target(instance, "url"), matrix
        for _ in range(3):
            if controller is None:
                return
            part = next((one for one in controller if str(one.tag).endswith(("}skin", "}morph"))), None)
            if part is None:
                return
            shape = part.find(self._tag("bind_shape_matrix"))
            if shape is not None:
                place = place @ self._numbers(shape, 16).reshape(4, 4)
            source = part.get("source", "").lstrip("#")
            controller = self._ids.get(source)
            if controller is not None and str(controller.tag).endswith("}geometry"):
                yield Placed(source, place, self._materials(instance), True)
                return

    def _materials(self, instance: Any) -> dict[str, str]:
        bound = instance.iter(self._tag("instance_material"))
        return {one.get("symbol", ""): one.get("target", "").lstrip("#") for one in bound}

    def _target(self, node: Any, key: str) -> Any:
        return self._ids.get(node.get(key, "").lstrip("#"))

    def _numbers(self, node: Any, count: int) -> Floats:
        try:
            values = np.array((node.text or "").split(), np.float64)
        except ValueError:
            values = np.empty(0)
        if len(values) != count or not np.isfinite(values).all():
            tag = str(node.tag).rpartition("}")[2]
            raise FormatError(
                f"{self._name}: <{tag}> must contain {count} finite numbers, got {node.text!r}",
                code="wrong_shape",
            )
        return values

    def _transform(self, tag: str, node: Any) -> Floats:
        values = self._numbers(node, TRANSFORMS[tag])
        matrix = np.eye(4)
        if tag == "matrix":
            return values.reshape(4, 4)
        if tag == "translate":
            matrix[:3, 3] = values
        elif tag == "scale":
            matrix[[0, 1, 2], [0, 1, 2]] = values
        elif tag == "rotate":
            length = np.linalg.norm(values[:3])
            if length > 0:
                matrix[:3, :3] = rotations_about(values[:3] / length, np.radians(values[3:]))[0]
        return matrix


TRANSFORMS = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4}
"""Transforms of nodes and their counts of numbers; `lookat` and `skew` occur only on cameras and are ignored."""
