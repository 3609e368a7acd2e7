"""Converts spatial tendons of a MuJoCo model to chains of capsules along their paths.

MuJoCo's visualizer draws tendons in the same way.

Source: MuJoCo's documentation (XML reference, tendon/spatial) and the arrays `ten_wrapadr`, `wrap_obj` and
`wrap_xpos` of `mjData`. A slack tendon of two sites hangs in a catenary, the curve of a rope under its own
weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arguments import Floats
from ...world.capsule import capsule_mesh
from .model import SPHERE, TENDON_OBJECT

__all__ = ["Tendon", "is_spatial", "tendon_segments"]

PULLEY = -2
"""The value in `wrap_obj` that interrupts a tendon's path."""
WRAP_JOINT = 1
"""The value of `mjtWrap` for joints, of which fixed tendons consist."""
WRAP_AROUND = (4, 5)
"""The values of `mjtWrap` for spheres and cylinders, which tendons bend around."""
TENDON_TRANSMISSION = 3
"""The value of `mjtTrn` for actuators that pull a tendon."""
GRAVITY_DISABLED = 1 << 7
"""The bit of `mjtDisableBit` for gravity."""
SIDES = 16
"""The number of sides of each capsule."""
MIN_WIDTH = 1e-4
"""The horizontal distance, as a share of the rope's length, below which a rope hangs in two straight parts."""
MIN_ANGLE = 1e-9
"""The angle in radians below which a path touches an object in only one point instead of along an arc."""
BISECTIONS = 60


@dataclass(frozen=True)
class Tendon:
    """A spatial tendon, shown as a mesh of one capsule for each segment of its path."""

    number: int
    kind = TENDON_OBJECT
    """The type of the object, a value of MuJoCo's `mjtObj`."""

    def triangles(self, model: Any) -> Any:
        """Returns the triangles [t, 3] of the longest possible path; t is therefore constant."""
        _, faces, normals = capsule_mesh(1.0, 1.0, SIDES)
        starts = len(normals) * np.arange(_capacity(model, self.number))
        return (faces[None] + starts[:, None, None]).reshape(-1, 3)

    def shape(self, model: Any, data: Any) -> tuple[Floats, Floats]:
        """Returns vertices and normals [v, 3] in the world, in metres.

        Capsules without a segment are single points.
        """
        starts, ends, radii = tendon_segments(model, data, self.number)
        unit, _, normals = capsule_mesh(1.0, 1.0, SIDES)
        count = _capacity(model, self.number)
        last = ends[-1] if len(ends) else np.asarray(data.xpos[0], np.float64)
        vertices = np.tile(last, (count, len(unit), 1))
        turned = np.tile(normals, (count, 1, 1))
        upper = unit[:, 2] > 0
        for index, (start, end, radius) in enumerate(zip(starts, ends, radii, strict=True)):
            turned[index] = normals @ _frame(end - start).T
            vertices[index] = np.where(upper[:, None], end, start) + radius * turned[index]
        return vertices.reshape(-1, 3), turned.reshape(-1, 3)

    def coordinates(self, model: Any) -> Floats | None:
        """Returns None: textures of tendons are not used."""
        return None


def tendon_segments(model: Any, data: Any, tendon: int) -> tuple[Floats, Floats, Floats]:
    """Returns the starts [n, 3], ends [n, 3] and radii [n] of a tendon's capsules.

    Values are world coordinates in metres.

    A tendon around a sphere or cylinder has several capsules along the arc. Fixed tendons have no capsules.
    """
    first, count = int(data.ten_wrapadr[tendon]), int(data.ten_wrapnum[tendon])
    points = np.asarray(data.wrap_xpos, np.float64).reshape(-1, 3)[first : first + count]
    objects = np.asarray(data.wrap_obj).ravel()[first : first + count].tolist()
    length = _slack_length(model, data, tendon)
    paths: list[Floats] = []
    if length is not None and count == 2:
        gravity = np.asarray(model.opt.gravity, np.float64)
        paths.append(_catenary(points[0], points[1], gravity, length, _slices(model) + 1))
    else:
        index = 0
        while index < count - 1:
            start, end = points[index], points[index + 1]
            if objects[index] >= 0 and objects[index] == objects[index + 1]:
                paths.append(_arc(model, data, objects[index], start, end))
                index += 1
                if index == count - 1:
                    break
                start, end = end, points[index + 1]
            if PULLEY not in objects[index : index + 2]:
                paths.append(np.stack([start, end]))
            index += 1
    starts = np.concatenate([np.zeros((0, 3)), *(path[:-1] for path in paths)])
    ends = np.concatenate([np.zeros((0, 3)), *(path[1:] for path in paths)])
    return starts, ends, np.full(len(starts), float(model.tendon_width[tendon]))


def _arc(model: Any, data: Any, geom: int, start: Floats, end: Floats) -> Floats:
    """Returns points [n, 3] from `start` to `end` around a sphere or a cylinder.

    On a cylinder, the points have even steps along the cylinder's axis.
    """
    center = np.asarray(data.geom_xpos[geom], np.float64)
    axis = np.asarray(data.geom_xmat[geom], np.float64).reshape(3, 3)[:, 2]
    if int(model.geom_type[geom]) == SPHERE:
        axis = np.zeros(3)
    first, second = start - center, end - center
    low, high = (axis @ first) * axis, (axis @ second) * axis
    first, second = first - low, second - high
    lengths = np.linalg.norm(first), np.linalg.norm(second)
    cosine = first @ second / max(lengths[0] * lengths[1], np.finfo(np.float64).tiny)
    angle = float(np.arccos(np.clip(cosine, -1, 1)))
    if angle < MIN_ANGLE:
        return np.stack([start, end])[: 1 if (start == end).all() else 2]
    count = max(round(angle * _slices(model) / np.pi), 1)
    share = np.linspace(0, 1, count + 1)[:, None]
    turned = (np.sin((1 - share) * angle) * first + np.sin(share * angle) * second) / np.sin(angle)
    path: Floats = center + (1 - share) * low + share * high + turned
    path[0], path[-1] = start, end
    return path


def is_spatial(model: Any, tendon: int) -> bool:
    """Returns True for a tendon with a path in space.

    Returns False for a fixed tendon, which couples joints.
    """
    return int(model.wrap_type[int(model.tendon_adr[tendon])]) != WRAP_JOINT


def _capacity(model: Any, tendon: int) -> int:
    """Returns the largest number of capsules of a tendon.

    Each wrapping object adds two straight capsules and half a turn.
    """
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    kinds = np.asarray(model.wrap_type[first : first + count])
    wrapping = int(np.isin(kinds, WRAP_AROUND).sum())
    return max(2 * count + wrapping * _slices(model), _slices(model) if count == 2 else 1)


def _slices(model: Any) -> int:
    """The number of segments of a catenary."""
    return int(model.vis.quality.numslices)


def _slack_length(model: Any, data: Any, tendon: int) -> float | None:
    """Returns the length of a rope that hangs between two sites.

    The result is None for tendons that MuJoCo draws straight.
    """
    lower, upper = (float(value) for value in model.tendon_range[tendon])
    spring = [float(value) for value in np.ravel(model.tendon_lengthspring[tendon])]
    current, stiffness = float(data.ten_length[tendon]), float(np.ravel(model.tendon_stiffness[tendon])[0])
    by_limit = stiffness == 0 and bool(model.tendon_limited[tendon]) and lower == 0 and current < upper
    by_spring = stiffness > 0 and spring[0] == 0 < spring[1]
    pulled = (np.asarray(model.actuator_trntype) == TENDON_TRANSMISSION) & (
        np.asarray(model.actuator_trnid).reshape(-1, 2)[:, 0] == tendon
    )
    hangs = (
        not int(model.opt.disableflags) & GRAVITY_DISABLED
        and np.linalg.norm(model.opt.gravity) > 0
        and int(model.tendon_num[tendon]) == 2
        and by_spring != by_limit
        and float(np.ravel(model.tendon_damping[tendon])[0]) == 0
        and float(model.tendon_frictionloss[tendon]) == 0
        and not pulled.any()
    )
    return (upper if by_limit else spring[1]) if hangs else None


def _catenary(start: Floats, end: Floats, gravity: Floats, length: float, count: int) -> Floats:
    """Returns points [n, 3] of a rope of `length` that hangs between two points.

    The points have equal horizontal steps, as in MuJoCo. A taut rope is straight; a rope between two points, one
    above the other, hangs down in two straight parts.
    """
    up = -gravity / np.linalg.norm(gravity)
    rise = float((end - start) @ up)
    across = end - start - rise * up
    width = float(np.linalg.norm(across))
    if np.linalg.norm(end - start) >= length:
        return np.stack([start, end])
    if width < MIN_WIDTH * length:
        lowest = start + 0.5 * (rise - length) * up
        return np.stack([start, lowest, end])
    # A rope has sqrt(length^2 - rise^2) = width * sinh(x) / x, where width / (2 x) is the catenary's parameter.
    ratio = np.sqrt(length**2 - rise**2) / width
    low, high = 0.0, 1.0
    while np.sinh(high) < ratio * high:
        low, high = high, 2 * high
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.sinh(middle) < ratio * middle else (low, middle)
    scale = width / (2 * high)
    shift = width / 2 - scale * np.arctanh(rise / length)
    steps = np.arange(count) * width / count
    heights = scale * (np.cosh((steps - shift) / scale) - np.cosh(shift / scale))
    points: Floats = start + steps[:, None] * across / width + heights[:, None] * up
    points[-1] = end
    return points


def _frame(direction: Floats) -> Floats:
    """A rotation [3, 3] whose z axis has a direction; the identity for a zero direction."""
    length = float(np.linalg.norm(direction))
    if length == 0:
        return np.eye(3)
    axis = direction / length
    side = np.eye(3)[int(np.argmin(abs(axis)))]
    first = np.cross(side, axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis], axis=1)
