"""Reader of SDF 1.4 to 1.12, the description format of Gazebo.

Source: http://sdformat.org/spec.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, Notice, nearest
from .description import Geometry, Joint, JointType, Link, Material, RobotDescription, Visual
from .resolve import FileResolver, Missing, list_faults, read_bytes
from .sdf_cameras import SdfCamera, read_sensor
from .sdf_frames import MODEL_FRAME, FrameGraph, read_numbers, read_pose
from .sdf_lights import SdfLight, ambient_light, read_light
from .tree import check_tree
from .xml_tree import Element, XmlLimits, parse_xml

__all__ = ["SdfModel", "read_sdf"]

MAX_INCLUDES = 20
"""Maximum depth of nested includes."""
MAX_MODELS = 10_000
"""Maximum number of models in a file, including its included files."""
JOINTS: dict[str, JointType] = {
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "fixed": "fixed",
}
UNLIMITED = 1e15
"""Limit in radians from which a revolute joint counts as continuous."""
PBR_VALUES = {"roughness": "roughness", "metalness": "metallic"}
"""Numbers of `<pbr><metal>`, and the fields of `Material`."""
SILENT = {
    "pose", "link", "joint", "frame", "model", "include", "static", "self_collide", "allow_auto_disable", "enable_wind",
    "plugin", "name", "uri", "gripper", "placement_frame", "physics", "gravity", "magnetic_field", "atmosphere",
    "scene", "spherical_coordinates", "audio", "wind", "gui", "state", "population", "road",
}  # fmt: skip
"""Elements of models and worlds that are read, or that do not affect images."""


@dataclass
class SdfModel:
    """A model of an SDF file."""

    description: RobotDescription
    """The model's links, which are all below the root link `__model__`, and its joints."""
    world_from_model: Floats
    """The model's pose [4, 4]."""
    cameras: list[SdfCamera]
    """The cameras on the model's links."""
    lights: list[SdfLight] = field(default_factory=list)
    """The lights of the file's worlds, with the first model."""


def read_sdf(data: bytes, name: str, files: FileResolver) -> list[SdfModel]:
    """Reads the models of an SDF document, alone or in a world.

    `name` is the file's path in messages. Nested and included models become parts of the model around them, with names
    such as `arm::hand`. Raises `FormatError` with file and line for invalid XML, unknown frames, circles of frames or
    files, missing values, and files without models.
    """
    return _Document(data, name, files).models()


@dataclass
class Budget:
    """The number of elements that a file and its included files have so far."""

    elements: int = 0


class _Document:
    """The state of reading a file."""

    def __init__(self, data: bytes, name: str, files: FileResolver, outer: _Document | None = None) -> None:
        self.name, self.files = name, files
        self.depth: int = 0 if outer is None else outer.depth + 1
        self.budget: Budget = Budget() if outer is None else outer.budget
        self.notices: list[Notice] = []
        self.ignored: Counter[str] = Counter()
        self.lights: list[SdfLight] = []
        self._root = parse_xml(data, name)
        if self._root.tag != "sdf":
            hint = "; the file is URDF: rename it to .urdf" if self._root.tag == "robot" else ""
            raise self.fail(
                self._root, f"expected an <sdf> element, found <{self._root.tag}>{hint}", "wrong_format"
            )
        self._included_paths = self._find_includes()

    def fail(self, element: Element, text: str, code: str) -> FormatError:
        """Returns an error with the file and the line of an element."""
        return FormatError(f"{self.name}:{element.line}: {text}", code=code)

    def note(self, element: Element, text: str, code: str) -> None:
        """Adds a notice about an element."""
        self.notices.append(Notice(f"{self.name}:{element.line}: {text}", code))

    def models(self) -> list[SdfModel]:
        """The models of the file and of its worlds."""
        found: list[SdfModel] = []
        for holder in [self._root, *self._root.find_all("world")]:
            for child in holder.children:
                if child.tag == "model":
                    found.append(self._model(child))
                elif child.tag == "include":
                    found += self._included_models(child)
                elif child.tag == "light":
                    self._add_light(read_light(child, self.fail, self.name))
                elif child.tag not in SILENT and child.tag != "world":
                    self.ignored[child.tag] += 1
                if len(found) > MAX_MODELS:
                    raise self.fail(child, f"too many models; the limit is {MAX_MODELS}", "budget_exceeded")
            if self.lights and holder.tag == "world":
                self._add_light(ambient_light(holder, self.fail))
        if not found:
            raise FormatError(f"{self.name}: the file contains no models", code="nothing_visible")
        texts = [f"{count} x <{tag}>" for tag, count in self.ignored.items()]
        if texts:
            self.notices.append(Notice(f"{self.name}: not shown: {', '.join(texts)}", "ignored_element"))
        found[0].description.notices[:0] = self.notices
        found[0].lights = self.lights
        return found

    def _add_light(self, light: SdfLight | None) -> None:
        if light is not None:
            self.lights.append(light)
            self.notices += light.notices

    def _model(self, element: Element) -> SdfModel:
        builder = _Model(self)
        builder.read(element, "")
        return builder.finished(element, read_pose(element, self.fail)[0])

    def _included_models(self, include: Element) -> list[SdfModel]:
        document = self.included(include)
        element = document._root.find("model")
        lights = document._root.find_all("light")
        if element is None and lights:
            placed = read_pose(include, self.fail)[0] if include.find("pose") is not None else None
            for light in lights:
                self._add_light(read_light(light, document.fail, document.name, placed))
            return []
        element = document.model()
        builder = _Model(document)
        builder.read(element, "")
        own = include.find("name")
        name = "" if own is None else own.text.strip()
        has_pose = include.find("pose") is not None
        pose = read_pose(include if has_pose else element, self.fail)[0]
        self.notices += document.notices
        return [builder.finished(element, pose, name)]

    def model(self) -> Element:
        """The only model of an included file."""
        model = self._root.find("model")
        if model is None:
            raise self.fail(self._root, "an included file must contain a <model>", "wrong_format")
        return model

    def _count(self, element: Element) -> None:
        """Counts an element of the outermost file; raises `FormatError` beyond the limit."""
        self.budget.elements += 1
        limit = XmlLimits().elements
        if self.budget.elements > limit:
            raise self.fail(
                element,
                f"too many elements, including included files; the limit is {limit}",
                "budget_exceeded",
            )

    def _find_includes(self) -> dict[str, Path]:
        """The paths of all included files by URI; raises `FormatError` with all files that are missing."""
        found: dict[str, Path] = {}
        faults: dict[str, str] = {}
        waiting = [(self._root, "")]
        while waiting:
            element, outer = waiting.pop()
            self._count(element)
            waiting += [(child, element.tag) for child in reversed(element.children)]
            is_include = element.tag == "include" and outer in ("sdf", "world", "model")
            uri = element.find("uri") if is_include else None
            text = "" if uri is None else uri.text.strip()
            if not text or text in found or text in faults:
                continue
            try:
                found[text] = self._find_include(text)
            except Missing as reason:
                faults[text] = f"{self.name}:{element.line}: <include> {text!r}: {reason}"
        if faults:
            raise FormatError(
                f"{self.name}: included files not found ({len(faults)}): {list_faults(faults.values())}; "
                "pass packages=[...]",
                code="file_not_found",
            )
        return found

    def _find_include(self, text: str) -> Path:
        """The path of an included file or of the model.sdf in an included folder; raises `Missing`."""
        if not text.endswith(".sdf"):
            with suppress(Missing):
                return self.files.find(f"{text.rstrip('/')}/model.sdf")
        return self.files.find(text)

    def included(self, include: Element) -> _Document:
        """The document that an `<include>` names."""
        uri = include.find("uri")
        if uri is None or not uri.text.strip():
            raise self.fail(include, "<include> has no <uri>", "missing_value")
        if self.depth >= MAX_INCLUDES:
            raise self.fail(
                include,
                f"included files are nested too deeply; the limit is {MAX_INCLUDES}; check whether files include each "
                "other in a circle",
                "budget_exceeded",
            )
        path = self._included_paths[uri.text.strip()]
        files = FileResolver(path, self.files.folder, self.files.packages)
        return _Document(read_bytes(path, XmlLimits().bytes), os.fspath(path), files, self)


@dataclass
class _Model:
    """The links and joints of a model and its nested models, while they are collected."""

    document: _Document
    links: dict[str, Link] = field(default_factory=dict)
    joints: list[tuple[Element, str, _Document]] = field(default_factory=list)
    sensors: list[tuple[Element, str, _Document]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.frames = FrameGraph(self.document.fail)

    def read(self, element: Element, prefix: str, document: _Document | None = None) -> None:
        """Collects the parts of a model; names begin with `prefix`."""
        document = document or self.document
        own = f"{prefix}{MODEL_FRAME}" if prefix else MODEL_FRAME

        def add_frame(part: Element, name: str, default: str) -> None:
            pose, base = read_pose(part, document.fail)
            self.frames.add(name, f"{prefix}{base}" if base else default, pose, part)

        for part in element.children:
            name = f"{prefix}{part.attributes.get('name', '').strip()}"
            if part.tag in ("link", "joint", "frame", "model") and name == prefix:
                raise document.fail(part, f"<{part.tag}> has no attribute 'name'", "missing_value")
            if part.tag == "link":
                add_frame(part, name, own)
                self.links[name] = _link(document, part, name)
                self.sensors += [(sensor, name, document) for sensor in part.find_all("sensor")]
                document.ignored.update(
                    child.tag for child in part.children if child.tag in ("light", "particle_emitter")
                )
            elif part.tag == "joint":
                child = _text(document, part, "child")
                add_frame(part, name, f"{prefix}{child}")
                self.joints.append((part, prefix, document))
            elif part.tag == "frame":
                base = part.attributes.get("attached_to", "").strip()
                add_frame(part, name, f"{prefix}{base}" if base else own)
            elif part.tag == "model":
                add_frame(part, f"{name}::{MODEL_FRAME}", own)
                self.read(part, f"{name}::", document)
            elif part.tag == "include":
                self._include(part, prefix, own, document)
            elif part.tag not in SILENT:
                document.ignored[part.tag] += 1

    def _include(self, part: Element, prefix: str, own: str, document: _Document) -> None:
        inner = document.included(part)
        model = inner.model()
        given = part.find("name")
        name = model.attributes.get("name", "") if given is None else given.text.strip()
        pose, base = read_pose(part if part.find("pose") is not None else model, document.fail)
        name = f"{prefix}{name}"
        self.frames.add(f"{name}::{MODEL_FRAME}", f"{prefix}{base}" if base else own, pose, part)
        self.read(model, f"{name}::", inner)
        document.notices += inner.notices
        document.ignored.update(inner.ignored)

    def finished(self, element: Element, world_from_model: Floats, name: str = "") -> SdfModel:
        """The model as a tree of links below `__model__`."""
        document = self.document
        poses = {link: self.frames.resolve(link, element) for link in self.links}
        if not self.links:
            raise document.fail(element, "the model has no links", "nothing_visible")
        joints: dict[str, Joint] = {}
        moved: dict[str, str] = {}
        for part, prefix, owner in self.joints:
            joint = self._joint(part, prefix, owner, poses)
            if joint is None:
                continue
            if joint.child in moved:
                owner.note(
                    part,
                    f"joint {joint.name!r} closes a loop with {moved[joint.child]!r} and is ignored; set the other "
                    "joints of the loop so that both sides meet",
                    "ignored_element",
                )
                continue
            moved[joint.child] = joint.name
            joints[joint.name] = joint
        root = Link(MODEL_FRAME, element.line)
        for link in self.links:
            if link not in moved:
                joints[f"{MODEL_FRAME}/{link}"] = Joint(
                    f"{MODEL_FRAME}/{link}",
                    "fixed",
                    MODEL_FRAME,
                    link,
                    self.links[link].line,
                    poses[link],
                    _X,
                )
        description = RobotDescription(
            name or element.attributes.get("name", "").strip() or "model",
            document.name,
            {MODEL_FRAME: root, **self.links},
            joints,
        )
        check_tree(description)
        cameras = []
        for sensor, link, owner in self.sensors:
            camera = read_sensor(sensor, link, owner.fail)
            if camera is None:
                owner.ignored[f"sensor type={sensor.attributes.get('type', '?')}"] += 1
            else:
                cameras.append(camera)
        return SdfModel(description, world_from_model, cameras)

    def _joint(
        self, part: Element, prefix: str, document: _Document, poses: dict[str, Floats]
    ) -> Joint | None:
        name, kind = f"{prefix}{part.attributes['name'].strip()}", part.attributes.get("type", "").strip()
        parent, child = (_text(document, part, tag) for tag in ("parent", "child"))
        if parent == "world":
            return None  # the child link is already a root
        ends = [f"{prefix}{end}" for end in (parent, child)]
        for end in ends:
            if end not in self.links:
                raise document.fail(
                    part, f"joint {name!r}: {nearest('link', end, list(self.links))}", "unknown_name"
                )
        if kind not in JOINTS:
            document.note(part, f"joint {name!r} of type {kind!r} is shown at rest", "ignored_feature")
        joint_type: JointType = JOINTS.get(kind, "fixed")
        model_from_joint = self.frames.resolve(name, part)
        lower, upper, axis = -math.inf, math.inf, _X
        if joint_type != "fixed":
            axis, lower, upper = self._axis(part, prefix, document, name, model_from_joint)
            if joint_type == "revolute" and (lower < -UNLIMITED or upper > UNLIMITED):
                joint_type, lower, upper = "continuous", -math.inf, math.inf
        return Joint(
            name,
            joint_type,
            ends[0],
            ends[1],
            part.line,
            np.linalg.inv(poses[ends[0]]) @ model_from_joint,
            axis,
            lower,
            upper,
            joint_from_child=np.linalg.inv(model_from_joint) @ poses[ends[1]],
        )

    def _axis(
        self, part: Element, prefix: str, document: _Document, name: str, model_from_joint: Floats
    ) -> tuple[Floats, float, float]:
        """The unit axis in the joint's frame, and the limits."""
        element = part.find("axis")
        if element is None:
            raise document.fail(part, f"joint {name!r} has no <axis>", "missing_value")
        xyz = element.find("xyz")
        axis = np.array([0.0, 0.0, 1.0] if xyz is None else read_numbers(xyz, 3, document.fail))
        if not np.linalg.norm(axis) > 0:
            raise document.fail(element, f"joint {name!r}: the axis must not be 0 0 0", "out_of_range")
        base = "" if xyz is None else xyz.attributes.get("expressed_in", "").strip()
        old = element.find("use_parent_model_frame")
        if old is not None and old.text.strip().lower() in ("1", "true"):
            base = MODEL_FRAME
        if base:
            frame = MODEL_FRAME if base == MODEL_FRAME and not prefix else f"{prefix}{base}"
            model_from_base = self.frames.resolve(frame, element)
            axis = model_from_joint[:3, :3].T @ model_from_base[:3, :3] @ axis
        lower, upper = -math.inf, math.inf
        limit = element.find("limit")
        if limit is not None:
            ends = (limit.find("lower"), limit.find("upper"))
            lower = -math.inf if ends[0] is None else _limit(ends[0], document)
            upper = math.inf if ends[1] is None else _limit(ends[1], document)
        if lower > upper:
            raise document.fail(
                element,
                f"joint {name!r}: the lower limit {lower:g} exceeds the upper limit {upper:g}",
                "out_of_range",
            )
        return axis / np.linalg.norm(axis), lower, upper


_X = np.array([1.0, 0.0, 0.0])


def _limit(element: Element, document: _Document) -> float:
    if element.text.strip().lower() in ("inf", "-inf", "+inf"):
        return float(element.text)
    return read_numbers(element, 1, document.fail)[0]


def _text(document: _Document, part: Element, tag: str) -> str:
    found = part.find(tag)
    if found is None or not found.text.strip():
        raise document.fail(part, f"<{part.tag}> has no <{tag}>", "missing_value")
    return found.text.strip()


def _link(document: _Document, element: Element, name: str) -> Link:
    link = Link(name, element.line)
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for part in element.find_all(tag):
            shape = _shape(document, part)
            if shape is not None:
                shapes.append(shape)
    return link


def _shape(document: _Document, part: Element) -> Visual | None:
    """A visual or collision; None for a shape that is not shown."""
    pose, base = read_pose(part, document.fail)
    if base:
        document.note(
            part,
            f"<{part.tag}>: relative_to={base!r} is not supported; the pose is used relative to the link",
            "ignored_key",
        )
    outer = part.find("geometry")
    shapes = [] if outer is None else outer.children
    if not shapes:
        raise document.fail(part, f"<{part.tag}> has no <geometry> with a shape", "missing_value")
    shape = shapes[0]

    def numbers(tag: str, count: int) -> tuple[float, ...]:
        found = shape.find(tag)
        if found is None:
            raise document.fail(shape, f"<{shape.tag}> has no <{tag}>", "missing_value")
        values = read_numbers(found, count, document.fail)
        if tag != "normal" and tag != "scale" and min(values) < 0:
            raise document.fail(found, f"<{tag}> must not be negative, got {min(values):g}", "out_of_range")
        return values

    geometry: Geometry
    if shape.tag == "box":
        geometry = Geometry("box", numbers("size", 3))
    elif shape.tag == "sphere":
        geometry = Geometry("sphere", numbers("radius", 1))
    elif shape.tag in ("cylinder", "capsule"):
        geometry = Geometry(shape.tag, numbers("radius", 1) + numbers("length", 1))
    elif shape.tag == "ellipsoid":
        pose = pose @ np.diag([*numbers("radii", 3), 1.0])
        geometry = Geometry("sphere", (1.0,))
    elif shape.tag == "plane":
        pose = pose @ _facing(numbers("normal", 3) if shape.find("normal") else (0.0, 0.0, 1.0))
        geometry = Geometry("box", (*(numbers("size", 2) if shape.find("size") else (1.0, 1.0)), 0.0))
    elif shape.tag == "mesh":
        uri = shape.find("uri")
        if uri is None or not uri.text.strip():
            raise document.fail(shape, "<mesh> has no <uri>", "missing_value")
        scale = numbers("scale", 3) if shape.find("scale") else (1.0, 1.0, 1.0)
        if 0.0 in scale:
            raise document.fail(
                shape, f"a mesh's scale must not contain 0, got {list(scale)}", "out_of_range"
            )
        if shape.find("submesh") is not None:
            document.note(shape, "<submesh> is not supported; the whole mesh is shown", "ignored_key")
        geometry = Geometry("mesh", (), _located(document, uri.text.strip()), (scale[0], scale[1], scale[2]))
    elif shape.tag == "empty":
        return None
    else:
        document.ignored[shape.tag] += 1
        return None
    return Visual(pose, geometry, _material(document, part), part.line)


def _located(document: _Document, uri: str) -> str:
    """The name of a file; names relative to an included file become absolute."""
    if "://" in uri or document.depth == 0:
        return uri
    return os.fspath(Path(document.files.own, uri))


def _facing(normal: tuple[float, ...]) -> Floats:
    """A rotation [4, 4] that maps z to a normal."""
    matrix = np.eye(4)
    length = float(np.linalg.norm(normal))
    if length > 0:
        z = np.array(normal) / length
        x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
        x /= np.linalg.norm(x)
        matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return matrix


def _material(document: _Document, part: Element) -> Material:
    element = part.find("material")
    if element is None:
        return Material()
    if element.find("script") is not None:
        document.ignored["material/script"] += 1
    color = next((found for tag in ("diffuse", "ambient") if (found := element.find(tag)) is not None), None)
    rgba = None
    if color is not None:
        words = color.text.split()
        values = read_numbers(color, 3 if len(words) == 3 else 4, document.fail)
        if not all(0 <= value <= 1 for value in values):
            raise document.fail(
                color, f"colours must be between 0 and 1, got {color.text.strip()}", "out_of_range"
            )
        opacity = values[3] if len(values) == 4 else 1.0
        rgba = (values[0], values[1], values[2], opacity)
    emissive = element.find("emissive")
    emission = None if emissive is None else _color(document, emissive)
    texture: str | None = None
    factors: dict[str, float] = {}
    for pbr in element.find_all("pbr"):
        for flow in pbr.children:
            albedo = flow.find("albedo_map")
            texture = texture or (None if albedo is None else _located(document, albedo.text.strip()))
            for child in flow.children:
                if flow.tag == "metal" and child.tag in PBR_VALUES:
                    factors[PBR_VALUES[child.tag]] = _fraction(document, child)
                elif child.tag != "albedo_map":
                    document.ignored[f"pbr/{child.tag}"] += 1
    return Material("", rgba, texture, emission=emission if emission and any(emission) else None, **factors)


def _color(document: _Document, element: Element) -> tuple[float, float, float]:
    """Red, green and blue between 0 and 1; a fourth number is ignored, as in Gazebo."""
    count = 3 if len(element.text.split()) == 3 else 4
    red, green, blue = read_numbers(element, count, document.fail)[:3]
    if not all(0 <= value <= 1 for value in (red, green, blue)):
        raise document.fail(
            element, f"colours must be between 0 and 1, got {element.text.strip()}", "out_of_range"
        )
    return red, green, blue


def _fraction(document: _Document, element: Element) -> float:
    (value,) = read_numbers(element, 1, document.fail)
    if not 0 <= value <= 1:
        raise document.fail(
            element, f"<{element.tag}> must be between 0 and 1, got {value:g}", "out_of_range"
        )
    return value
