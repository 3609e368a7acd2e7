"""The nodes of a Collada document: geometries with their transforms and materials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Floats
from .collada_document import ColladaDocument, Note
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
    line: int
    """The line of the element that shows the geometry."""


def placed_geometries(document: ColladaDocument, note: Note) -> Iterator[Placed]:
    """Iterates over the geometries of the document's scene, depth first.

    `note` receives a notice for each reference without a target. Raises `FormatError` for circular instances, too many
    nodes, and transforms with a wrong count of numbers.
    """
    yield from _Scene(document, note).geometries()


class _Scene:
    def __init__(self, document: ColladaDocument, note: Note) -> None:
        self._document, self._note = document, note
        self._ids = {node.get("id"): node for node in document.root.iter() if node.get("id")}
        self._nodes = 0

    def geometries(self) -> Iterator[Placed]:
        """Yields the geometries of the scene.

        If the document selects no visual scene, the geometries of all visual scenes are returned.
        """
        root = self._document.root
        instance = root.find("scene/instance_visual_scene")
        scene = None if instance is None else self._target(instance, "url")
        scenes = [scene] if scene is not None else list(root.iter("visual_scene"))
        for each in scenes:
            for node in each.findall("node"):
                yield from self._node(node, np.eye(4), 0)

    def _node(self, node: Any, parent: Floats, depth: int) -> Iterator[Placed]:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise self._document.fail(node, f"too many nodes; the limit is {MAX_NODES}", "budget_exceeded")
        if depth > MAX_DEPTH:
            text = f"nodes are nested too deeply or in a circle; the limit is {MAX_DEPTH}"
            raise self._document.fail(node, text, "budget_exceeded")
        matrix = parent
        for child in node:
            if child.tag in TRANSFORMS:
                matrix = matrix @ self._transform(child)
            elif child.tag in IGNORED_TRANSFORMS:
                self._note(
                    "ignored_feature",
                    f"line {child.line}: <{child.tag}> is ignored; geometry below it may be misplaced",
                )
            elif child.tag == "node":
                yield from self._node(child, matrix, depth + 1)
            elif child.tag == "instance_node":
                target = self._target(child, "url")
                if target is not None:
                    yield from self._node(target, matrix, depth + 1)
            elif child.tag == "instance_geometry":
                name = child.get("url", "").lstrip("#")
                yield Placed(name, matrix, self._materials(child), False, child.line)
            elif child.tag == "instance_controller":
                yield from self._skin(child, matrix)

    def _skin(self, instance: Any, matrix: Floats) -> Iterator[Placed]:
        """The geometry of a skin or morph at rest; a skin's source may be a morph."""
        controller, place = self._target(instance, "url"), matrix
        for _ in range(3):
            part = None
            if controller is not None:
                part = next((one for one in controller if one.tag in ("skin", "morph")), None)
            if part is None:
                break
            shape = part.find("bind_shape_matrix")
            if shape is not None:
                place = place @ self._numbers(shape, 16).reshape(4, 4)
            controller = self._target(part, "source")
            if controller is not None and controller.tag == "geometry":
                name = part.get("source", "").lstrip("#")
                yield Placed(name, place, self._materials(instance), True, instance.line)
                return
        text = f"line {instance.line}: the controller {instance.get('url')!r} refers to no geometry; it is not shown"
        self._note("ignored_element", text)

    def _materials(self, instance: Any) -> dict[str, str]:
        found = {}
        for bound in instance.iter("instance_material"):
            name = bound.get("target", "").lstrip("#")
            if self._document.material(name) is None:
                text = f"line {bound.line}: material {name!r} is missing or faulty; light grey is shown"
                self._note("missing_colors", text)
            found[bound.get("symbol", "")] = name
        return found

    def _target(self, node: Any, key: str) -> Any:
        name = node.get(key, "").lstrip("#")
        if name not in self._ids:
            text = f"line {node.line}: <{node.tag}> refers to {name!r}, which does not exist; it is ignored"
            self._note("ignored_element", text)
        return self._ids.get(name)

    def _numbers(self, node: Any, count: int) -> Floats:
        try:
            values = np.array(node.text.split(), np.float64)
        except ValueError:
            values = np.empty(0)
        if len(values) != count or not np.isfinite(values).all():
            text = f"<{node.tag}> must contain {count} finite numbers, got {node.text!r}"
            raise self._document.fail(node, text, "wrong_shape")
        return values

    def _transform(self, node: Any) -> Floats:
        values = self._numbers(node, TRANSFORMS[node.tag])
        matrix = np.eye(4)
        if node.tag == "matrix":
            return values.reshape(4, 4)
        if node.tag == "translate":
            matrix[:3, 3] = values
        elif node.tag == "scale":
            matrix[[0, 1, 2], [0, 1, 2]] = values
        elif node.tag == "rotate":
            length = np.linalg.norm(values[:3])
            if length > 0:
                matrix[:3, :3] = rotations_about(values[:3] / length, np.radians(values[3:]))[0]
        return matrix


TRANSFORMS = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4}
"""Transforms of nodes and their counts of numbers."""
IGNORED_TRANSFORMS = ("lookat", "skew")
