"""Collada documents: the geometries and materials, loaded by `pycollada` one element at a time.

`pycollada`'s own loader is not used: it also searches the data for a ZIP archive, resolves chains of nodes in
quadratic time, and reports faults without their place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import FormatError
from .collada_strips import STRIP_TAGS, expand_strips
from .xml_tree import Element, parse_xml

__all__ = ["ColladaDocument", "Note"]

Note = Callable[[str, str], None]
"""Adds a notice with a code and a text that contains the line, if the line is known."""
LIBRARIES = (
    ("library_images", "image", "CImage", "images"),
    ("library_effects", "effect", "Effect", "effects"),
    ("library_materials", "material", "Material", "materials"),
    ("library_geometries", "geometry", "Geometry", "geometries"),
)
"""Libraries that are loaded: tags of the library and of its elements, `pycollada`'s class and its list."""


class Node(ElementTree.Element):
    """An element as `pycollada` expects it, with the line of its start tag."""

    line = 0


class ColladaDocument:
    """The geometries, materials and nodes of a document."""

    def __init__(self, data: bytes, name: str, note: Note) -> None:
        """Loads a document; `note` receives the faults of elements that are ignored.

        Raises `FormatError` with file and line for malformed XML, entities, documents beyond the limits, and elements
        with invalid content.
        """
        import collada  # an optional package

        self._name, self._note, self._faults = name, note, collada.common.DaeError
        self.root = _node(parse_xml(data, name))
        """The root element; tags have no namespace."""
        self.unit = self._unit()
        """The length of the document's unit in metres."""
        self.up_axis = self.root.findtext("asset/up_axis", "Y_UP").strip()
        """The up axis; by default, Y_UP."""
        self._content = collada.Collada(ignore=[self._faults], aux_file_loader=lambda name: None)
        self._content.tag = str
        loaders = {
            "Geometry": collada.geometry,
            **dict.fromkeys(("CImage", "Effect", "Material"), collada.material),
        }
        for library, tag, kind, target in LIBRARIES:
            for node in self.root.iterfind(f"{library}/{tag}"):
                self._load(node, getattr(loaders[kind], kind), getattr(self._content, target))

    def geometry(self, name: str) -> Any:
        """Returns `pycollada`'s geometry with an id, or None."""
        return self._content.geometries.get(name)

    def material(self, name: str) -> Any:
        """Returns `pycollada`'s material with an id, or None."""
        return self._content.materials.get(name)

    def fail(self, node: Any, text: str, code: str) -> FormatError:
        """Returns an error with the line of an element."""
        return FormatError(f"{self._name}:{node.line}: {text}", code=code)

    def _unit(self) -> float:
        node = self.root.find("asset/unit")
        text = "1" if node is None else node.get("meter", "1")
        unit = _number(text)
        if not 0 < unit < math.inf:
            raise self.fail(node, f"<unit>: meter must be a positive number, got {text!r}", "out_of_range")
        return unit

    def _load(self, node: Any, kind: Any, target: Any) -> None:
        """Loads an element of a library; a faulty element is ignored with a notice.

        Raises `FormatError` if `pycollada` fails with an exception of another kind.
        """
        if node.tag == "geometry" and node.find("mesh") is None:
            return  # a spline; a notice follows if it is used
        for strips in [child for child in node.iter() if child.tag in STRIP_TAGS]:
            try:
                expand_strips(strips)
            except ValueError as error:
                raise self.fail(strips, f"<{strips.tag}>: {error}", "syntax") from None
        self._check_numbers(node)
        known = len(self._content.errors)
        place = f"line {node.line}: <{node.tag}> {node.get('id')!r}"
        try:
            target.append(kind.load(self._content, {}, node))
        except self._faults as error:
            self._note("invalid_file", f"{place}: ignored: {error}")
        except Exception as error:  # pycollada raises many kinds of errors for malformed elements
            text = f"<{node.tag}> {node.get('id')!r}: not valid: {type(error).__name__}: {error}"
            raise self.fail(node, text, "syntax") from None
        for fault in self._content.errors[known:]:
            self._note("invalid_file", f"{place}: ignored: {fault}")

    def _check_numbers(self, node: Any) -> None:
        """Checks numbers that `pycollada` replaces or misreads without an error."""
        for child in [*node.iter("color"), *node.iter("float")]:
            values = [_number(text) for text in (child.text or "").split()]
            counts = (3, 4) if child.tag == "color" else (1,)
            if len(values) not in counts or not np.isfinite(values).all():
                expected = " or ".join(map(str, counts))
                text = f"<{child.tag}> must contain {expected} finite numbers, got {child.text!r}"
                raise self.fail(child, text, "wrong_shape")
        for child in node.iter("float_array"):
            if "nan" in (child.text or "").lower():
                text = f"line {child.line}: <float_array> {child.get('id')!r}: NaN is replaced with 0"
                self._note("replaced_value", text)
        for child in node.iter("accessor"):
            count = len(child.findall("param"))
            if count and child.get("stride", str(count)).strip() != str(count):
                text = f"<accessor>: stride {child.get('stride')!r} differs from its number of parameters, {count}"
                raise self.fail(child, text, "unsupported_feature")


def _number(text: str) -> float:
    """Converts a text to a number; NaN if the text is not a number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _node(element: Element) -> Node:
    node = Node(element.tag, element.attributes)
    node.line, node.text = element.line, element.text
    node.extend(_node(child) for child in element.children)
    return node
