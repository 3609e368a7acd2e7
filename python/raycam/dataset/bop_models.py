"""The models of a BOP data set, as meshes in millimetres.

The models are the distinct shapes of the data set's objects.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..annotations.labels import box3d
from ..arguments import Floats, lengths, product
from ..errors import Notice
from .per_world import in_world, part, world_count
from .plan import Plan, Record

__all__ = ["MILLIMETRES", "ModelCatalogue", "models"]

MILLIMETRES = 1000.0
MAX_EXACT_VERTICES = 20_000
"""Number of vertices up to which a model's diameter is exact."""
MAX_PAIRS = 32_768
"""Number of vertex pairs compared at a time, which limits the memory."""
QUARTER_TURN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation about x that converts y-up axes to z-up axes."""
SHAPE_TOLERANCE = 1e-7
"""Tolerance for equal shapes, as a fraction of their size, because vertices are converted from world space."""


@dataclass(frozen=True)
class Shape:
    """A shape in model space, independent of where its mesh was loaded from."""

    triangles: int
    """The number of triangles."""
    size: float
    """The root mean square of the vertices' coordinates, millimetres."""
    moments: tuple[float, ...]
    """Moments and three vertices of the shape, divided by its size."""

    def equals(self, other: Shape) -> bool:
        """Returns True if both models have the same shape and size, up to rounding errors."""
        return (
            self.triangles == other.triangles
            and abs(self.size / other.size - 1) <= SHAPE_TOLERANCE
            and max(abs(a - b) for a, b in zip(self.moments, other.moments, strict=True)) <= SHAPE_TOLERANCE
        )

    def turned(self) -> Shape:
        """Returns the shape after `QUARTER_TURN`: (x, y, z) becomes (x, -z, y)."""
        mean, squares, cubes, before, after, *vertices = np.array(self.moments).reshape(-1, 3)
        # `before` contains the means of x z^2, y x^2 and z y^2, `after` those of x y^2, y z^2 and z x^2.
        odd = [product(QUARTER_TURN, values) for values in (mean, cubes, after, before, *vertices)]
        values = np.concatenate([odd[0], squares[[0, 2, 1]], *odd[1:]])
        return Shape(self.triangles, self.size, tuple(values.tolist()))


def own_id(given: Mapping[str, int], name: str, category: str | None) -> int | None:
    """Returns the id that `given` or a numeric category assigns to an object, or None.

    Such an id distinguishes equal shapes.
    """
    for key in (name, category):
        if key is not None and key in given:
            return given[key]
    return int(category) if category is not None and category.isdigit() and int(category) > 0 else None


class Models:
    """The distinct models among the labelled objects of one world."""

    def __init__(self, plan: Plan) -> None:
        self.of_object: dict[int, int] = {}
        """The number of each object's model, from 0, in the order of the objects."""
        self.shapes: list[Shape] = []
        """The shapes of the models."""
        self.first: list[int] = []
        """The first object of each model."""
        self._own_ids: list[int | None] = []
        given = plan.options["model_ids"] or {}
        known: dict[Any, int] = {}
        for number in plan.labelled:
            item = plan.objects[number]
            shape = product(box3d(plan.world, number).rotation.T, item.matrix[:3, :3])
            size = np.abs(shape).max()
            # Objects that share a mesh and a scale need not be compared.
            own = own_id(given, item.name, item.category)
            key = (own, item.mesh, f"{size:.9g}".encode() + ((shape / size).round(9) + 0.0).tobytes())
            if key not in known:
                known[key] = self._number_of(measure_shape(plan, number), own, number)
            self.of_object[number] = known[key]

    def _number_of(self, shape: Shape, own: int | None, number: int) -> int:
        for model, (other, other_id) in enumerate(zip(self.shapes, self._own_ids, strict=True)):
            if other_id == own and shape.equals(other):
                return model
        self.shapes.append(shape)
        self._own_ids.append(own)
        self.first.append(number)
        return len(self.shapes) - 1

    def record_of(self, plan: Plan, number: int) -> Record:
        """Returns the part of a view's record that identifies an object's model, as plain JSON."""
        model = self.of_object[number]
        shape, item = self.shapes[model], plan.objects[number]
        return {
            "shape": [shape.triangles, shape.size, list(shape.moments)],
            "category": item.category,
            "name": item.name,
            "object": self.first[model],
        }


_models: WeakKeyDictionary[Plan, Models] = WeakKeyDictionary()


def models(plan: Plan) -> Models:
    """Returns a plan's models, which are computed once."""
    if plan not in _models:
        _models[plan] = Models(plan)
    return _models[plan]


@dataclass
class Model:
    """A model of a data set."""

    shape: Shape
    own_id: int | None
    """The id that was assigned to the model's objects, if any; it distinguishes models of equal shape."""
    categories: set[str]
    """The categories of the objects with this model."""
    names: set[str]
    """The names of the objects with this model."""
    world: int
    """The index of the first world that contains the shape."""
    object: int
    """The id of the first object with this model in that world."""
    id: int = 0
    """The model's id in the data set, from 1."""


class ModelCatalogue:
    """The models of all worlds of a data set.

    The models' ids do not depend on the order of objects. Objects of the same shape share a model, unless
    different ids are assigned to them.

    A model's id is the first of these that exists: the id of its category or object in the option `model_ids`; its
    category, if that is a whole number; an unused id from 1, in the order of category and size.
    """

    def __init__(self, plan: Plan, records: Iterable[Record]) -> None:
        self.ids: list[dict[int, int]] = [{} for _ in range(world_count(plan))]
        """For each world, a map from the shape's number in the world to the model's id in the data set."""
        self.turns: list[Counter[int]] = [Counter() for _ in self.ids]
        """For each world, the number of quarter turns about x from the shape to its model."""
        self.all: list[Model] = []
        """The models, by id."""
        self.notices: list[Notice] = []
        """Notices about ids that could not equal the category ids."""
        self._given: Mapping[str, int] = plan.options["model_ids"] or {}
        pairs: list[dict[int, Model]] = [{} for _ in self.ids]
        if plan.recipe is None:
            own = models(plan)
            for number, model in own.of_object.items():
                self._add(own.record_of(plan, number), 0, model, pairs[0])
        else:
            for number, record in enumerate(records):
                world, _ = in_world(plan, number)
                for model, found in record["models"].items():
                    self._add(found, world, int(model), pairs[world])
        self._merge_equal_shapes(pairs)
        self._merge_turned_shapes(pairs)
        self._set_ids()
        for ids, found in zip(self.ids, pairs, strict=True):
            ids.update({number: model.id for number, model in found.items()})

    def _add(self, found: Record, world: int, number: int, known: dict[int, Model]) -> None:
        triangles, size, moments = found["shape"]
        shape = Shape(triangles, size, tuple(moments))
        own = own_id(self._given, found["name"], found["category"])
        same = (one for one in self.all if one.own_id == own and one.shape.equals(shape))
        model = known.get(number) or next(same, None)
        if model is None:
            model = Model(shape, own, set(), set(), world, found["object"])
            self.all.append(model)
        if found["category"] is not None:
            model.categories.add(found["category"])
        model.names.add(found["name"])
        known[number] = model

    def _merge_equal_shapes(self, pairs: list[dict[int, Model]]) -> None:
        """Replaces each model without an id by the model of equal shape that has the lowest id."""
        numbered = sorted((model for model in self.all if model.own_id), key=lambda model: model.own_id or 0)
        for model in [model for model in self.all if not model.own_id]:
            other = next((other for other in numbered if other.shape.equals(model.shape)), None)
            if other is None:
                continue
            self._replace(model, other, pairs, turns=0)

    def _merge_turned_shapes(self, pairs: list[dict[int, Model]]) -> None:
        """Replaces each model by the model of the same shape after a quarter turn about x.

        The mesh of a file occurs in two orientations: in the file's own axes, and rotated to the world's up
        axis.
        """
        for model in list(self.all):
            shape = model.shape.turned()
            near = [other for other in self.all if other is not model and other.shape.equals(shape)]
            other = next((other for other in near if len({model.own_id, other.own_id} - {None}) < 2), None)
            if other is not None:
                self._replace(model, other, pairs, turns=1)

    def _replace(self, model: Model, other: Model, pairs: list[dict[int, Model]], turns: int) -> None:
        """Replaces `model` by `other`, whose shape is that of `model` after `turns` quarter turns."""
        other.own_id = other.own_id or model.own_id
        other.names |= model.names
        other.categories |= model.categories
        self.all.remove(model)
        for models, own in zip(pairs, self.turns, strict=True):
            for number in [number for number, found in models.items() if found is model]:
                models[number] = other
                own[number] += turns

    def _set_ids(self) -> None:
        given = self._given
        self.all.sort(key=_order_of)
        taken: dict[int, Model] = {}

        def wanted(model: Model) -> Iterator[int]:
            if model.own_id:
                yield model.own_id
            yield from (
                given[name] for name in (*sorted(model.names), *sorted(model.categories)) if name in given
            )
            yield from (int(name) for name in sorted(model.categories) if name.isdigit() and int(name) > 0)

        rest = []
        for model in self.all:
            numbers = list(wanted(model))
            free = next((number for number in numbers if number not in taken), None)
            if free is None:
                rest.append((model, numbers))
            else:
                taken[free] = model
        unused = (number for number in count(1) if number not in taken)
        for model, numbers in rest:
            number = next(unused)
            taken[number] = model
            if numbers:
                text = (
                    f"bop: category {sorted(model.categories)[0]} has more than one shape; obj_id {numbers[0]} is the "
                    f"first shape, and another shape has obj_id {number}; assign a category to each shape, or use "
                    "model_ids"
                )
                self.notices.append(Notice(text, "duplicate_name"))
        for number, model in taken.items():
            model.id = number
        self.all.sort(key=lambda one: one.id)

    def meshes(self, plan: Plan) -> Iterator[tuple[int, Record, list[bytes]]]:
        """Iterates over the models: id, row of models_info.json, and PLY file."""
        for model in self.all:
            own = scene(plan, model.world)
            vertices, triangles = model_mesh(own, model.object)
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            information = {
                "diameter": diameter(vertices),
                **{f"min_{axis}": float(value) for axis, value in zip("xyz", low, strict=True)},
                **{f"size_{axis}": float(value) for axis, value in zip("xyz", high - low, strict=True)},
                "name": own.objects[model.object].name,
            }
            yield model.id, information, ply(vertices, triangles)


def _order_of(model: Model) -> tuple[Any, ...]:
    """The sort key of a model without a given id: category or name, then size."""
    shape = model.shape
    return sorted(model.categories or model.names), shape.triangles, shape.size, shape.moments


def scene(plan: Plan, world: int) -> Plan:
    """Returns the part of the plan with the views of one world."""
    return plan if plan.recipe is None else part(plan, world)


def to_model_space(plan: Plan, number: int, points: Floats) -> Floats:
    """Transforms points [n, 3] of an object from the world to model space, in millimetres."""
    rotation, origin = box3d(plan.world, number).rotation, plan.objects[number].matrix[:3, 3]
    return product(points - origin, rotation) * MILLIMETRES


def measure_shape(plan: Plan, number: int) -> Shape:
    """Measures the shape of an object in model space."""
    corners = plan.world.triangles(number).reshape(-1, 3)
    points = to_model_space(plan, number, corners)
    size = float(np.sqrt((points**2).mean())) or 1.0
    unit = points / size
    before, after = np.roll(unit, 1, axis=1), np.roll(unit, -1, axis=1)
    moments = [
        unit.mean(axis=0),
        (unit**2).mean(axis=0),
        (unit**3).mean(axis=0),
        (unit * before**2).mean(axis=0),
        (unit * after**2).mean(axis=0),
    ]
    values = np.concatenate([*moments, *unit[[0, len(unit) // 2, -1]]])
    return Shape(len(corners) // 3, size, tuple(values.tolist()))


def model_mesh(plan: Plan, number: int) -> tuple[Floats, Any]:
    """Returns an object's distinct vertices and its triangles.

    The vertices are in model space, in millimetres.
    """
    corners = plan.world.triangles(number).reshape(-1, 3)
    vertices, triangles = np.unique(corners, axis=0, return_inverse=True)
    return to_model_space(plan, number, vertices), triangles.reshape(-1, 3)


def diameter(vertices: Floats) -> float:
    """Returns the largest distance between two vertices.

    Vertices that are too near to the centre to have the largest distance are skipped. The result is exact unless more
    than `MAX_EXACT_VERTICES` candidates remain, for example on a finely tessellated sphere. In that case, the result
    is the largest extent along 4096 directions.
    """
    center = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = lengths(vertices - center)
    reach = radius.max()
    at_least = lengths(vertices - vertices[radius.argmax()]).max()
    outer = vertices[radius >= (at_least - reach) * (1 - 1e-9)]
    if len(outer) > MAX_EXACT_VERTICES:
        directions = np.random.default_rng(0).normal(size=(4096, 3))
        directions /= lengths(directions)[:, None]
        return max(float(np.ptp(product(outer, direction))) for direction in directions)
    largest, step = 0.0, max(1, MAX_PAIRS // len(outer))
    for start in range(0, len(outer), step):
        squares = sum(
            (outer[start : start + step, None, axis] - outer[None, start:, axis]) ** 2 for axis in range(3)
        )
        largest = max(largest, float(np.max(squares)))
    return float(np.sqrt(largest))


def ply(vertices: Floats, triangles: Any) -> list[bytes]:
    """Returns the pieces of a binary PLY file."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, triangles
    return [header.encode(), vertices.astype("<f4").tobytes(), faces.tobytes()]
