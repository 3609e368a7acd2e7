"""Reader of URDF, the robot description format of ROS (https://wiki.ros.org/urdf/XML)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import TypeVar

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, Notice, nearest
from .description import JOINT_TYPES, Geometry, Joint, JointType, Link, Material, RobotDescription, Visual
from .transforms import transform
from .tree import check_tree
from .xml_tree import Element, XmlLimits, parse_xml

__all__ = ["read_urdf"]

Part = TypeVar("Part", Link, Joint)


def read_urdf(data: bytes, name: str, limits: XmlLimits | None = None) -> RobotDescription:
    """Reads a URDF document; `name` is the file's path in messages.

    Inertias, transmissions, sensors and plugins do not affect images and are ignored. Raises `FormatError` with file
    and line for invalid XML, an unknown joint or shape, missing or invalid numbers, duplicate names, and links that do
    not form a tree.
    """
    root = parse_xml(data, name, limits)
    found = _Reader(root, name).read()
    found.document = _text(data)
    return found


def _text(data: bytes) -> str:
    """Returns the document as text.

    A document that is not UTF-8 is decoded as Latin-1, and its declaration is removed.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return re.sub(r"^<\?xml[^>]*\?>\s*", "", data.decode("latin-1"))


class _Reader:
    """The state of reading a document."""

    def __init__(self, root: Element, name: str) -> None:
        self._root, self._name = root, name
        self._materials: dict[str, Material] = {}
        self._notices: list[Notice] = []

    def read(self) -> RobotDescription:
        """Reads the document, and returns the robot's description."""
        root = self._root
        if root.tag != "robot":
            hint = {
                "mujoco": "; the file is MJCF: rename it to .xml",
                "sdf": "; the file is SDF: rename it to .sdf",
                "COLLADA": "; the file is a Collada mesh",
            }.get(root.tag, "")
            raise self._error(root, f"expected a <robot> element, found <{root.tag}>{hint}", "wrong_format")
        if "xacro" in self._prefixes():
            raise self._error(
                root,
                "the file contains xacro expressions; rename it to .xacro",
                "wrong_format",
            )
        for element in root.find_all("material"):
            self._add_material(element)
        for element in root.find_all("link"):
            for visual in element.find_all("visual"):
                for material in visual.find_all("material"):
                    if material.children and material.attributes.get("name") not in self._materials:
                        self._add_material(material)
        links = self._named("link", (self._link(element) for element in root.find_all("link")))
        if not links:
            raise self._error(root, "the robot has no links", "nothing_visible")
        joints = self._named("joint", (self._joint(element) for element in root.find_all("joint")))
        found = RobotDescription(
            root.attributes.get("name") or "robot", self._name, links, joints, self._notices
        )
        check_tree(found)
        return found

    def _prefixes(self) -> set[str]:
        """Returns {"xacro"} if the document has unexpanded macros, otherwise an empty set.

        Elements of xacro such as property, include, if and arg count as macros, too.
        """
        tags = {"property", "macro", "include", "if", "unless", "arg"}
        return {"xacro"} if any(child.tag in tags for child in self._root.children) else set()

    def _named(self, kind: str, parts: Iterable[Part]) -> dict[str, Part]:
        found: dict[str, Part] = {}
        for part in parts:
            if part.name in found:
                first = found[part.name].line
                raise FormatError(
                    f"{self._name}:{part.line}: duplicate {kind} {part.name!r}; the first is in line {first}",
                    code="duplicate_name",
                )
            found[part.name] = part
        return found

    # Materials ----------------------------------------------------------------------------------------------

    def _add_material(self, element: Element) -> None:
        material = self._own_material(element)
        self._materials.setdefault(material.name, material)

    def _own_material(self, element: Element) -> Material:
        color, texture = element.find("color"), element.find("texture")
        rgba = None
        if color is not None:
            values = self._numbers(color, "rgba", 4, default=None)
            if any(not 0 <= value <= 1 for value in values):
                raise self._error(
                    color, f"rgba values must be between 0 and 1, got {_joined(values)}", "out_of_range"
                )
            rgba = (values[0], values[1], values[2], values[3])
        file = None if texture is None else texture.attributes.get("filename", "").strip() or None
        return Material(element.attributes.get("name", ""), rgba, file)

    def _material(self, visual: Element) -> Material:
        element = visual.find("material")
        if element is None:
            return Material()
        own = self._own_material(element)
        if own.rgba is not None or own.texture is not None:
            return own
        found = self._materials.get(own.name)
        if found is None:
            self._notices.append(
                Notice(
                    f"{self._name}:{element.line}: {nearest('material', own.name, list(self._materials))}; "
                    "the default material is used",
                    "missing_value",
                )
            )
        return found or own

    # Links --------------------------------------------------------------------------------------------------

    def _link(self, element: Element) -> Link:
        link = Link(self._text(element, "name"), element.line)
        link.visuals = [self._visual(child) for child in element.find_all("visual")]
        link.collisions = [self._visual(child) for child in element.find_all("collision")]
        return link

    def _visual(self, element: Element) -> Visual:
        outer = element.find("geometry")
        if outer is None or not outer.children:
            raise self._error(element, f"<{element.tag}> has no <geometry> with a shape", "missing_value")
        return Visual(
            self._origin(element), self._geometry(outer.children[0]), self._material(element), element.line
        )

    def _geometry(self, shape: Element) -> Geometry:
        if shape.tag == "box":
            return Geometry("box", self._sizes(shape, self._numbers(shape, "size", 3, default=None)))
        if shape.tag == "sphere":
            return Geometry("sphere", self._sizes(shape, self._numbers(shape, "radius", 1, default=None)))
        if shape.tag in ("cylinder", "capsule"):
            radius, length = (self._numbers(shape, key, 1, default=None)[0] for key in ("radius", "length"))
            return Geometry(shape.tag, self._sizes(shape, (radius, length)))
        if shape.tag == "mesh":
            scale = self._numbers(shape, "scale", 3, default=(1.0, 1.0, 1.0))
            if 0.0 in scale:
                raise self._error(
                    shape, f"a mesh's scale must not contain 0, got {_joined(scale)}", "out_of_range"
                )
            return Geometry("mesh", (), self._text(shape, "filename"), (scale[0], scale[1], scale[2]))
        shapes = ["box", "cylinder", "sphere", "capsule", "mesh"]
        raise self._error(shape, nearest("shape", shape.tag, shapes), "unknown_name")

    def _sizes(self, shape: Element, values: tuple[float, ...]) -> tuple[float, ...]:
        if any(value < 0 for value in values):
            raise self._error(
                shape, f"<{shape.tag}> sizes must not be negative, got {_joined(values)}", "out_of_range"
            )
        return values

    # Joints -------------------------------------------------------------------------------------------------

    def _joint(self, element: Element) -> Joint:
        name, kind = self._text(element, "name"), self._text(element, "type")
        if kind not in JOINT_TYPES:
            raise self._error(
                element, f"joint {name!r}: {nearest('joint type', kind, list(JOINT_TYPES))}", "unknown_name"
            )
        joint_type: JointType = kind
        ends = []
        for tag in ("parent", "child"):
            end = element.find(tag)
            if end is None:
                raise self._error(element, f"joint {name!r} has no <{tag}>", "missing_value")
            ends.append(self._text(end, "link"))
        lower, upper = self._limits(element, name, joint_type)
        return Joint(
            name,
            joint_type,
            ends[0],
            ends[1],
            element.line,
            self._origin(element),
            self._axis(element, name, joint_type),
            lower,
            upper,
            self._mimic(element, name, joint_type),
        )

    def _axis(self, element: Element, name: str, kind: JointType) -> Floats:
        axis = element.find("axis")
        values = (1.0, 0.0, 0.0) if axis is None else self._numbers(axis, "xyz", 3, default=(1.0, 0.0, 0.0))
        length = math.hypot(*values)
        if kind in ("fixed", "floating"):
            return np.array([1.0, 0.0, 0.0])
        if not length > 0:
            raise self._error(axis or element, f"joint {name!r}: the axis must not be 0 0 0", "out_of_range")
        return np.array(values) / length

    def _limits(self, element: Element, name: str, kind: JointType) -> tuple[float, float]:
        limit = element.find("limit")
        if kind not in ("revolute", "prismatic"):
            return -math.inf, math.inf
        if limit is None:
            self._notices.append(
                Notice(
                    f"{self._name}:{element.line}: joint {name!r} of type {kind} has no <limit>; it is not limited",
                    "missing_value",
                )
            )
            return -math.inf, math.inf
        lower, upper = (self._numbers(limit, key, 1, default=(0.0,))[0] for key in ("lower", "upper"))
        if lower > upper:
            raise self._error(
                limit,
                f"joint {name!r}: the lower limit {lower:g} exceeds the upper limit {upper:g}",
                "out_of_range",
            )
        return lower, upper

    def _mimic(self, element: Element, name: str, kind: JointType) -> tuple[str, float, float] | None:
        mimic = element.find("mimic")
        if mimic is None:
            return None
        if kind == "fixed":
            text = f"{self._name}:{mimic.line}: joint {name!r} is fixed; its <mimic> is ignored"
            self._notices.append(Notice(text, "ignored_key"))
            return None
        if kind not in ("revolute", "continuous", "prismatic"):
            raise self._error(
                mimic, f"joint {name!r}: joints of type {kind} cannot have <mimic>", "conflicting_values"
            )
        multiplier = self._numbers(mimic, "multiplier", 1, default=(1.0,))[0]
        return self._text(mimic, "joint"), multiplier, self._numbers(mimic, "offset", 1, default=(0.0,))[0]

    # Values -------------------------------------------------------------------------------------------------

    def _origin(self, element: Element) -> Floats:
        origin = element.find("origin")
        if origin is None:
            return np.eye(4)
        zero = (0.0, 0.0, 0.0)
        return transform(
            self._numbers(origin, "xyz", 3, default=zero), self._numbers(origin, "rpy", 3, default=zero)
        )

    def _text(self, element: Element, key: str) -> str:
        value = element.attributes.get(key, "").strip()
        if not value:
            raise self._error(element, f"<{element.tag}> has no attribute {key!r}", "missing_value")
        return value

    def _numbers(
        self, element: Element, key: str, count: int, default: tuple[float, ...] | None
    ) -> tuple[float, ...]:
        text = element.attributes.get(key)
        if text is None and default is not None:
            return default
        words = (text or "").split()
        try:
            values = tuple(float(word) for word in words)
        except ValueError:
            values = ()
        if len(values) != count or not all(map(math.isfinite, values)):
            wanted = "a finite number" if count == 1 else f"{count} finite numbers"
            raise self._error(
                element, f"<{element.tag}> attribute {key!r}: expected {wanted}, got {text!r}", "wrong_type"
            )
        return values

    def _error(self, element: Element, text: str, code: str) -> FormatError:
        return FormatError(f"{self._name}:{element.line}: {text}", code=code)


def _joined(values: Iterable[float]) -> str:
    return " ".join(f"{value:g}" for value in values)
