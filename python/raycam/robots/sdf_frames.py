"""Frames of an SDF model: poses relative to named frames, resolved to the model's own frame."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, nearest
from .transforms import quaternion_matrices, transform
from .xml_tree import Element

__all__ = ["MODEL_FRAME", "FrameGraph", "read_numbers", "read_pose"]

MODEL_FRAME = "__model__"
"""The name of a model's own frame (SDF 1.7 and later)."""
MAX_CHAIN = 200
"""Maximum number of frames in a chain of references."""

Fail = Callable[[Element, str, str], FormatError]


class FrameGraph:
    """Named frames, each with a pose relative to another frame."""

    def __init__(self, fail: Fail) -> None:
        self._fail = fail
        self._frames: dict[str, tuple[str, Floats, Element]] = {}

    def add(self, name: str, base: str, base_from_frame: Floats, element: Element) -> None:
        """Adds a frame; raises `FormatError` for a name that is already used."""
        if name in self._frames or name == MODEL_FRAME:
            first = f"; the first is in line {self._frames[name][2].line}" if name in self._frames else ""
            shown = name.removesuffix(f"::{MODEL_FRAME}")
            raise self._fail(element, f"duplicate {element.tag} {shown!r}{first}", "duplicate_name")
        self._frames[name] = (base, base_from_frame, element)

    def resolve(self, name: str, element: Element) -> Floats:
        """Returns model_from_frame [4, 4]; raises `FormatError` for unknown frames and for circles."""
        pose, chain = np.eye(4), []
        while name != MODEL_FRAME:
            if name not in self._frames and f"{name}::{MODEL_FRAME}" in self._frames:
                name = f"{name}::{MODEL_FRAME}"  # a nested model's name means the model's frame
            if name not in self._frames:
                raise self._fail(
                    element, nearest("frame", name, [MODEL_FRAME, *self._frames]), "unknown_name"
                )
            chain.append(name)
            if len(chain) > MAX_CHAIN or name in chain[:-1]:
                raise self._fail(
                    element,
                    f"the frames {', '.join(chain[-10:])} refer to each other in a circle",
                    "cyclic_reference",
                )
            base, base_from_frame, element = self._frames[name]
            pose, name = base_from_frame @ pose, base
        return pose


def read_pose(owner: Element, fail: Fail) -> tuple[Floats, str]:
    """Returns the matrix [4, 4] of an element's `<pose>`, and the name of its reference frame.

    The name is "" if the element does not specify a frame.
    """
    pose = owner.find("pose")
    if pose is None:
        return np.eye(4), ""
    base = pose.attributes.get("relative_to", pose.attributes.get("frame", "")).strip()
    kind = pose.attributes.get("rotation_format", "euler_rpy")
    if kind == "quat_xyzw":
        values = read_numbers(pose, 7, fail)
        if not any(values[3:]):
            raise fail(pose, "the quaternion of a pose must not be 0 0 0 0", "not_a_rotation")
        matrix = np.eye(4)
        matrix[:3, :3] = quaternion_matrices([values[3:]])[0]
        matrix[:3, 3] = values[:3]
        return matrix, base
    if kind != "euler_rpy":
        raise fail(pose, f"rotation_format must be euler_rpy or quat_xyzw, got {kind!r}", "unknown_name")
    values = read_numbers(pose, 6, fail) if pose.text.strip() else (0.0,) * 6
    angles = values[3:]
    if pose.attributes.get("degrees", "false").strip().lower() in ("true", "1"):
        angles = tuple(map(math.radians, angles))
    return transform(values[:3], angles), base


def read_numbers(element: Element, count: int, fail: Fail) -> tuple[float, ...]:
    """Returns the `count` finite numbers of an element's text, or raises `FormatError`."""
    try:
        values = tuple(float(word) for word in element.text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)):
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise fail(element, f"<{element.tag}>: expected {wanted}, got {element.text.strip()!r}", "wrong_type")
    return values
