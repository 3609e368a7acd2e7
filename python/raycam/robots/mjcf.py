"""MJCF files as robots, compiled by MuJoCo.

The bodies and joints of the compiled model become links and joints.

Source: MuJoCo's documentation (chapters Computation and XML reference, `mjModel` in the API reference).
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, Notice, SettingsError
from .description import Joint, JointType, Link, RobotDescription
from .resolve import FileResolver, list_faults, read_bytes
from .transforms import quaternion_matrices, rotations_about
from .xml_tree import Element, XmlLimits, parse_xml

__all__ = ["CompiledModel", "is_mjcf", "read_mjcf"]

FREE, BALL, SLIDE = range(3)
"""Values of `mjtJoint`; the fourth is a hinge."""
EQUAL_JOINTS = 2
"""The value of `mjtEq` for joints that follow another."""
FOLDER_KEYS = ("meshdir", "texturedir", "assetdir")
MAX_FILE_BYTES = 256 << 20
"""Largest size of a file that a model names."""
MAX_CELLS = 1 << 26
"""Largest number of pixels of a texture, and of values of a height field, whose size is in the model."""
MAX_FILES = 10_000
"""Largest number of files that a model names."""
DEFAULT_NAME = "MuJoCo Model"
"""MuJoCo's name for models without a name."""


class CompiledModel(NamedTuple):
    """A MuJoCo model, whose arrays contain shapes, cameras and lights."""

    model: Any
    """The `mujoco.MjModel`."""
    links: list[str]
    """The name of the link of each body."""


def is_mjcf(tag: str | None) -> bool:
    """Returns True for the tag of an MJCF file's root element."""
    return tag in ("mujoco", "mujocoinclude")


def read_mjcf(path: Path, root: Element, files: FileResolver) -> tuple[RobotDescription, CompiledModel]:
    """Reads an MJCF file; returns links and joints, and the compiled model.

    `root` is the root element of the file. Before MuJoCo reads the model, all files named in it are located; they
    must be in the root folder of `files`. Raises `SettingsError` without MuJoCo, and `FormatError` for files outside
    the folder and for models that MuJoCo rejects, with MuJoCo's message.
    """
    try:
        import mujoco
    except ImportError:
        raise SettingsError(
            f"{path}: reading MJCF requires MuJoCo; pip install 'raycam[mujoco]'", code="missing_dependency"
        ) from None
    named = _Files(path, files)
    named.check(root, path)
    try:
        model = mujoco.MjModel.from_xml_path(os.fspath(path))
    except (ValueError, RuntimeError, MemoryError) as error:
        if named.missing:
            raise FormatError(named.missing_text(), code="file_not_found") from None
        reason = " ".join(str(error).split())
        raise FormatError(f"{path}: MuJoCo cannot load the model: {reason}", code="invalid_value") from None
    links = _unique([_name(model, "body", body) for body in range(model.nbody)])
    return _describe(model, path, links), CompiledModel(model, links)


class _Files:
    """Checks the files that a model and its included files name."""

    def __init__(self, path: Path, files: FileResolver) -> None:
        self._name = os.fspath(path)
        self._main, self._root = Path(os.path.abspath(path)).parent, files.root
        self._folders = {""}
        self._seen: set[Path] = set()
        self._elements = 0
        self.missing: list[str] = []
        """The files that are in none of the model's folders, with their places in the model."""

    def check(self, root: Element, path: Path) -> None:
        """Checks a document and its included documents."""
        documents = [(root, Path(os.path.abspath(path)), 1)]
        named: list[tuple[str, str]] = []
        while documents:
            element, file, outer = documents.pop()
            for each, copies in _walk(element, outer):
                self._count(each, copies, file)
                if each.tag == "compiler":
                    self._folders |= {each.attributes[key] for key in FOLDER_KEYS if key in each.attributes}
                for key, value in each.attributes.items():
                    if key.startswith("file") and value:
                        named.append((value, f"{file}:{each.line}"))
                        if each.tag in ("include", "model") or value.lower().endswith(".xml"):
                            documents += [(*found, copies) for found in self._included(value, file)]
        for name, at in dict(named).items():
            paths = [
                Path(os.path.normpath(main / folder / name))
                for main in (self._main, Path(at.rpartition(":")[0]).parent)
                for folder in sorted(self._folders)
            ]
            found = [self._check_file(path, name, at) for path in dict.fromkeys(paths)]
            if not any(found):
                folders = ", ".join(dict.fromkeys(os.fspath(path.parent) for path in paths))
                self.missing.append(f"{at}: {name!r} not found; searched {folders}")

    def _count(self, element: Element, copies: int, file: Path) -> None:
        """Counts an element and the elements that it generates; raises `FormatError` beyond the limits."""
        at = f"{file}:{element.line}: <{element.tag}>"
        generated = math.prod(_wholes(element, "count")) if element.tag in ("composite", "flexcomp") else 1
        self._elements += copies * generated
        limit = XmlLimits().elements
        if self._elements > limit:
            raise FormatError(
                f"{at}: the model has too many elements, including copies; the limit is {limit}",
                code="budget_exceeded",
            )
        for width, height in (("width", "height"), ("nrow", "ncol")):
            cells = math.prod([*_wholes(element, width), *_wholes(element, height)])
            if cells > MAX_CELLS:
                raise FormatError(
                    f"{at}: too large: {cells} values; the limit is {MAX_CELLS}", code="budget_exceeded"
                )

    def missing_text(self) -> str:
        """The message for missing files."""
        return (
            f"{self._name}: files not found ({len(self.missing)}): {list_faults(self.missing)}; add the files, because "
            'MuJoCo requires all of them (missing="box" has no effect on MJCF)'
        )

    def _included(self, name: str, file: Path) -> list[tuple[Element, Path]]:
        """The documents that a name may refer to: relative to the model or to the including file."""
        found = []
        for folder in (self._main, file.parent):
            path = Path(os.path.normpath(folder / name))
            if path in self._seen or not self._check_file(path, name, str(file)):
                continue
            self._seen.add(path)
            if len(self._seen) > MAX_FILES:
                raise FormatError(
                    f"{file}: the model has too many files; the limit is {MAX_FILES}", code="budget_exceeded"
                )
            data = read_bytes(path, XmlLimits().bytes)
            found.append((parse_xml(data, str(path)), path))
        return found

    def _check_file(self, path: Path, name: str, at: str) -> bool:
        """Checks a file if it exists; returns False for a missing file."""
        try:
            real = Path(os.path.realpath(path))
            if not real.exists():
                return False
        except (OSError, ValueError):  # a name that is too long or contains a null character
            return False
        if not real.is_relative_to(os.path.realpath(self._root)):
            raise FormatError(
                f"{at}: file {name!r} is outside {self._root}; pass a folder= that contains it",
                code="outside_root",
            )
        if not real.is_file():
            raise FormatError(f"{at}: {name!r} is not a regular file", code="unknown_format")
        if real.stat().st_size > MAX_FILE_BYTES:
            raise FormatError(
                f"{at}: file {name!r} is too large; the limit is {MAX_FILE_BYTES} bytes",
                code="budget_exceeded",
            )
        return True


def _walk(element: Element, copies: int) -> Iterator[tuple[Element, int]]:
    """Iterates over an element and the elements inside, with the number of copies that `<replicate>` creates."""
    waiting = [(element, copies)]
    while waiting:
        element, copies = waiting.pop()
        yield element, copies
        inner = copies * math.prod(_wholes(element, "count")) if element.tag == "replicate" else copies
        waiting += [(child, inner) for child in reversed(element.children)]


def _wholes(element: Element, key: str) -> list[int]:
    """The positive whole numbers of an attribute; values that are not are omitted, because MuJoCo reports them."""
    return [
        int(word) for word in element.attributes.get(key, "").split() if word.isdecimal() and int(word) > 0
    ]


def _describe(model: Any, path: Path, bodies: list[str]) -> RobotDescription:
    """Returns the links and joints of a model.

    Bodies with several joints have links without shapes between the joints.
    """
    name = bytes(model.names).split(b"\0", 1)[0].decode("utf-8", "replace")
    file = os.fspath(path)
    joints = _unique([_name(model, "jnt", joint) for joint in range(model.njnt)])
    robot = RobotDescription(path.stem if name in ("", DEFAULT_NAME) else name, file, {}, {})
    robot.links[bodies[0]] = Link(bodies[0], 0)
    for body in range(1, model.nbody):
        _add_body(robot, model, body, bodies, joints)
    _add_mimics(robot, model, joints)
    left_out = [
        f"{count} {kind}" for kind, count in (("skins", model.nskin), ("flexes", model.nflex)) if count
    ]
    spatial = [tendon for tendon in range(model.ntendon) if model.wrap_type[model.tendon_adr[tendon]] != 1]
    left_out += [f"{len(spatial)} tendons"] if spatial else []
    if left_out:
        text = f"{file}: {', '.join(left_out)} are not part of the robot; raycam.from_mujoco shows them"
        robot.notices.append(Notice(text, "ignored_element"))
    return robot


def _add_body(robot: RobotDescription, model: Any, body: int, bodies: list[str], joints: list[str]) -> None:
    link, parent = bodies[body], bodies[int(model.body_parentid[body])]
    place = _transform(model.body_pos[body], model.body_quat[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    if count == 0:
        name = f"{link}/fixed"
        robot.joints[name] = Joint(name, "fixed", parent, link, 0, place, np.array([1.0, 0, 0]))
    for index in range(count):
        joint = first + index
        child = link if index == count - 1 else f"{link}/{joints[joint]}"
        robot.links.setdefault(child, Link(child, 0))
        robot.joints[joints[joint]] = _joint(model, joint, joints[joint], parent, child, place)
        parent, place = child, np.eye(4)
    robot.links.setdefault(link, Link(link, 0))


def _joint(model: Any, joint: int, name: str, parent: str, child: str, place: Floats) -> Joint:
    """A joint, whose values equal those in `qpos`, except that quaternions are x y z w."""
    kind, address = int(model.jnt_type[joint]), int(model.jnt_qposadr[joint])
    axis = np.asarray(model.jnt_axis[joint], np.float64)
    axis = axis / np.linalg.norm(axis)
    if kind == FREE:
        start = np.asarray(model.qpos0[address : address + 7], np.float64)
        initial = (*start[:3].tolist(), *start[[4, 5, 6, 3]].tolist())
        return Joint(name, "floating", parent, child, 0, np.eye(4), axis, initial=initial)
    anchor = _transform(model.jnt_pos[joint], [1, 0, 0, 0])
    back = np.asarray(np.linalg.inv(anchor), np.float64)
    if kind == BALL:
        start = np.asarray(model.qpos0[address : address + 4], np.float64)
        initial = tuple(start[[1, 2, 3, 0]].tolist())
        return Joint(
            name, "ball", parent, child, 0, place @ anchor, axis, joint_from_child=back, initial=initial
        )
    zero = float(model.qpos0[address])
    shift = np.eye(4)
    if kind == SLIDE:
        shift[:3, 3] = -zero * axis
    else:
        shift[:3, :3] = rotations_about(axis, np.array([-zero]))[0]
    low, high = (float(value) for value in model.jnt_range[joint])
    limited = bool(model.jnt_limited[joint])
    type_: JointType = "prismatic" if kind == SLIDE else "revolute" if limited else "continuous"
    return Joint(
        name,
        type_,
        parent,
        child,
        0,
        place @ anchor,
        axis,
        lower=low if limited else -np.inf,
        upper=high if limited else np.inf,
        joint_from_child=np.asarray(shift @ back, np.float64),
        initial=(zero,),
    )


def _add_mimics(robot: RobotDescription, model: Any, joints: list[str]) -> None:
    """Makes joints of active linear equality constraints mimic the joint that they follow."""
    for equality in range(model.neq):
        follower, followed = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
        constant, factor, *rest = (float(value) for value in model.eq_data[equality][:5])
        linear = int(model.eq_type[equality]) == EQUAL_JOINTS and not any(rest) and constant == 0
        if not linear or followed < 0 or not model.eq_active0[equality]:
            continue
        one, other = robot.joints[joints[follower]], robot.joints[joints[followed]]
        if one.mimic is not None or _follows(robot, other, one.name):
            continue
        zeros = [float(model.qpos0[int(model.jnt_qposadr[joint])]) for joint in (follower, followed)]
        one.mimic = (other.name, factor, zeros[0] - factor * zeros[1])


def _follows(robot: RobotDescription, joint: Joint, name: str) -> bool:
    """Returns True if a joint has this name or mimics the joint with this name.

    The joint may mimic the other joint directly or through other joints.
    """
    while joint.name != name:
        if joint.mimic is None:
            return False
        joint = robot.joints[joint.mimic[0]]
    return True


def _transform(position: Any, quaternion: Any) -> Floats:
    """The transform [4, 4] of a position and a quaternion w x y z."""
    found = np.eye(4)
    found[:3, :3] = quaternion_matrices(np.asarray(quaternion, np.float64)[[1, 2, 3, 0]][None])[0]
    found[:3, 3] = position
    return found


def _name(model: Any, kind: str, number: int) -> str:
    start = int(getattr(model, f"name_{kind}adr")[number])
    names = bytes(model.names)
    return names[start : names.index(b"\0", start)].decode("utf-8", "replace") or f"{kind}{number}"


def _unique(names: list[str]) -> list[str]:
    """The names, with a number after names that occurred before."""
    found: dict[str, None] = {}
    for name in names:
        free, count = name, 2
        while free in found:
            free, count = f"{name}-{count}", count + 1
        found[free] = None
    return list(found)
