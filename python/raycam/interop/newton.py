"""A world with the shapes of a Newton model, which follows the model's state.

Source: the arrays of `newton.Model` and `newton.State` in Newton 1.8, which are read without importing Newton.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import Floats
from ..errors import Notice, WorldError
from ..notices import warn_all
from ..robots import quaternion_matrices
from ..srgb import linear_from_srgb
from ..world import World
from ..world.capsule import capsule_mesh

__all__ = ["NewtonScene", "from_newton"]

PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, CONE, CONVEX_MESH = range(1, 11)
"""Values of `newton.GeoType`."""
VISIBLE, SITE = 1, 8
"""Bits of `newton.ShapeFlags`."""
INFINITE_PLANE = 1000.0
"""The side length, in metres, of planes without a size, as in Newton's viewer."""
MODEL_ARRAYS = ("shape_type", "shape_scale", "shape_transform", "shape_body", "shape_flags", "body_q")
"""Arrays that a model must have."""


class NewtonScene:
    """A Newton model as a world, from `from_newton`; `update` moves its objects."""

    def __init__(self, model: Any, state: Any) -> None:
        self.world = World(up="y" if int(model.up_axis) == 1 else "z")
        """The world: one object per visible shape, without lights and cameras."""
        self.shapes: list[int] = []
        """The shape's number in the model, for each object."""
        self._bodies = _array(model.shape_body).astype(int)
        self._body_from_shape = _matrices(_array(model.shape_transform))
        self._scales: list[Floats] = []
        notices = self._add_shapes(model)
        self.update(state)
        warn_all(notices)
        self.notices = notices
        """Notices about parts of the model that are approximated or not shown."""

    def update(self, state: Any) -> None:
        """Moves the objects to the poses in `state.body_q`.

        `state` is a `newton.State`, or the model itself. No mesh is rebuilt. Raises `WorldError` if the state
        has fewer bodies than the shapes refer to, and for poses that are not finite.
        """
        poses = _matrices(_array(state.body_q)) if state.body_q is not None else np.zeros((0, 4, 4))
        used = self._bodies[self.shapes].max(initial=-1)
        if used >= len(poses):
            raise WorldError(
                f"state has {len(poses)} bodies, but a shape belongs to body {used}; pass a state of the same model",
                code="wrong_shape",
            )
        for number, shape in enumerate(self.shapes):
            body = self._bodies[shape]
            world_from_body = poses[body] if body >= 0 else np.eye(4)
            self.world.set_object(
                number, matrix=world_from_body @ self._body_from_shape[shape] @ self._scales[number]
            )

    def _add_shapes(self, model: Any) -> list[Notice]:
        """Adds the visible shapes; returns notices about parts that are approximated or not shown."""
        notices = []
        kinds, flags = _array(model.shape_type), _array(model.shape_flags)
        sizes = _array(model.shape_scale)
        colors = _optional(model, "shape_color", len(kinds))
        opacities = _optional(model, "shape_opacity", len(kinds))
        bodies = list(getattr(model, "body_label", []))
        for shape, kind in enumerate(kinds):
            if not flags[shape] & VISIBLE or flags[shape] & SITE:
                continue
            name = _label(model, shape)
            keys, scale = _geometry(int(kind), sizes[shape], model.shape_source[shape])
            if keys is None:
                text = f"shape {name!r}: shapes of type {int(kind)} are not shown"
                notices.append(Notice(text, "ignored_element"))
                continue
            if kind == CYLINDER and sizes[shape][2] > 0:
                text = f"shape {name!r}: the curved side of a barrel is shown as a cylinder"
                notices.append(Notice(text, "approximated_value"))
            if colors is not None:
                keys["color"] = linear_from_srgb(np.clip(np.asarray(colors[shape], np.float64), 0, 1))
            if opacities is not None and 0 < opacities[shape] < 1:
                keys["opacity"] = float(opacities[shape])
            body = self._bodies[shape]
            if 0 <= body < len(bodies):
                keys["category"] = str(bodies[body])
            self.world.add_object(name=name, **keys)
            self.shapes.append(shape)
            self._scales.append(scale)
        for what, count in (("particles", "particle_count"), ("cloth triangles", "tri_count")):
            if getattr(model, count, 0):
                text = f"the model's {what} are not shown ({getattr(model, count)}), because only shapes are supported"
                notices.append(Notice(text, "ignored_element"))
        return notices

    def __repr__(self) -> str:
        """Returns the number of shown shapes and the world as text."""
        return f"NewtonScene: {len(self.shapes)} of {len(self._bodies)} shapes; {self.world!r}"


def from_newton(model: Any, state: Any = None) -> NewtonScene:
    """Creates a world from a `newton.Model`; returns a scene with `world` and `update(state)`.

    `state` is the `newton.State` whose poses are shown (default: the model's initial poses, `model.body_q`). Visible
    shapes become objects, named by their labels, and the category of an object is its body's label. Colours are sRGB,
    as Newton shows them. Infinite planes have sides of 1,000 m. The world has no lights and cameras, because Newton's
    models have none; textures, sites, particles, cloth and Gaussian splats are omitted.

    Raises `WorldError` for objects that are not a Newton model, and the errors of `NewtonScene.update`.
    """
    missing = [name for name in MODEL_ARRAYS if not hasattr(model, name)]
    if missing:
        raise WorldError(
            f"expected a newton.Model, got {type(model).__name__} without {', '.join(missing)}",
            code="wrong_type",
        )
    if state is not None and not hasattr(state, "body_q"):
        raise WorldError(f"expected a newton.State, got {type(state).__name__}", code="wrong_type")
    return NewtonScene(model, model if state is None else state)


def _array(values: Any) -> Any:
    """The values of a Warp array, or of anything that NumPy accepts."""
    return np.asarray(values.numpy() if hasattr(values, "numpy") else values)


def _optional(model: Any, name: str, count: int) -> Any:
    """The values of an array that a model may lack, or None."""
    values = getattr(model, name, None)
    found = None if values is None else _array(values)
    return found if found is not None and len(found) == count else None


def _matrices(poses: Any) -> Floats:
    """Returns the transforms [n, 4, 4] of positions and quaternions [n, 7].

    Each row contains the position x y z and the quaternion x y z w. Raises `WorldError` for values that are
    not finite.
    """
    values = np.asarray(poses, np.float64).reshape(-1, 7)
    if not np.isfinite(values).all():
        count = int(np.count_nonzero(~np.isfinite(values).all(axis=1)))
        raise WorldError(
            f"poses of bodies and shapes must be finite; {count} of {len(values)} contain NaN or infinite numbers",
            code="out_of_range",
        )
    found = np.tile(np.eye(4), (len(values), 1, 1))
    found[:, :3, :3] = quaternion_matrices(values[:, 3:])
    found[:, :3, 3] = values[:, :3]
    return found


def _label(model: Any, shape: int) -> str:
    labels = getattr(model, "shape_label", None) or []
    return str(labels[shape]) if shape < len(labels) else f"shape_{shape}"


def _geometry(kind: int, size: Floats, source: Any) -> tuple[dict[str, Any] | None, Floats]:
    """The keys of an object and its scale [4, 4]; None for kinds that are not shown."""
    x, y, z = (float(value) for value in size)
    unscaled = np.eye(4)
    if kind == PLANE:
        return {"plane": {"size": [side if side > 0 else INFINITE_PLANE for side in (x, y)]}}, unscaled
    if kind == SPHERE:
        return {"sphere": {"radius": x}}, unscaled
    if kind == ELLIPSOID:
        return {"sphere": {"radius": 1.0}}, np.diag([x, y, z, 1.0])
    if kind == BOX:
        return {"box": {"size": [2 * x, 2 * y, 2 * z]}}, unscaled
    if kind == CYLINDER:
        return {"cylinder": {"radius": x, "height": 2 * y}}, unscaled
    if kind == CONE:
        return {"cone": {"radius": x, "height": 2 * y}}, unscaled
    if kind == CAPSULE:
        vertices, faces, normals = capsule_mesh(x, 2 * y)
        return {"vertices": vertices, "triangles": faces, "normals": normals}, unscaled
    if kind in (MESH, CONVEX_MESH) and source is not None:
        vertices, faces = np.asarray(source.vertices, np.float64), np.asarray(source.indices).reshape(-1, 3)
        return {"vertices": vertices, "triangles": faces}, np.diag([x, y, z, 1.0])
    if kind == HFIELD and source is not None:
        return _height_field(source), unscaled
    return None, unscaled


def _height_field(field: Any) -> dict[str, Any]:
    """Returns the surface of a `newton.Heightfield`.

    Rows are along y, columns along x. Each cell is split along the same diagonal as in Newton.
    """
    heights = field.min_z + np.asarray(field.data, np.float64) * (field.max_z - field.min_z)
    rows, columns = heights.shape
    x, y = np.meshgrid(np.linspace(-field.hx, field.hx, columns), np.linspace(-field.hy, field.hy, rows))
    corners = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        part.ravel() for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1])
    )
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([b, c, d], 1)])
    return {"vertices": np.stack([x.ravel(), y.ravel(), heights.ravel()], 1), "triangles": faces}
