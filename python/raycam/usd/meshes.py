"""Meshes and solids of USD as arrays with materials.

Sources: the schemas `UsdGeomMesh` and `UsdGeomTetMesh`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade, Vt

from .arrays import NO_INDEX
from .faces import Faces, find_fault, find_unusable_faces, order_corners
from .gprims import GPRIMS, gprim_faces
from .handover import Handover, MeshArrays
from .materials import Materials
from .notices import StageNotice
from .primvars import Attribute, InstanceValues, Primvar, find_primvar, read_table
from .skinning import Skinning

__all__ = ["GEOMETRY_TYPES", "Appearance", "Meshes", "rows"]

GEOMETRY_TYPES = {"Mesh", "TetMesh", *GPRIMS}
"""Types of prims that become objects."""

GREY = (0.8, 0.8, 0.8)
"""The colour of a prim without a material and without displayColor."""


def rows(matrix: Gf.Matrix4d) -> list[list[float]]:
    """Returns USD's matrix, which is for row vectors, as rows of a matrix for column vectors."""
    return np.array(matrix).T.tolist()  # type: ignore[no-any-return]


class Reason(Exception):
    """Error of a prim that cannot be shown, with the reason."""


@dataclass
class Shape:
    """The polygons of a prim."""

    faces: Faces
    normals: Attribute | None = None
    smooth: bool = False
    unusable: Any = None
    """Mask [faces] of the faces that cannot be shown."""


@dataclass
class Group:
    """A group of faces with the same material."""

    material: int
    faces: Any
    colors: Primvar | None = None
    """Colours that multiply the material's; None for a material that is shown as it is."""


@dataclass(frozen=True)
class Appearance:
    """A mesh with the materials of its slots."""

    mesh: int
    materials: tuple[int, ...]
    corners: int
    color: tuple[float, float, float, float] | None = None
    """Colour and opacity of a mesh with one plain material; other instances of the mesh may have other values."""
    instance_inputs: frozenset[str] = frozenset()
    """Primvars of the instance that the mesh or its materials depend on."""


class Meshes:
    """The meshes of a stage; a mesh shared by prims is added once."""

    def __init__(
        self, handover: Handover, materials: Materials, skinning: Skinning, time: Usd.TimeCode
    ) -> None:
        self.notices: list[StageNotice] = []
        self._handover = handover
        self._materials = materials
        self._skinning = skinning
        self._time = time
        self._known: dict[tuple[Any, ...], Appearance | None] = {}
        self._inherited: dict[str, tuple[str, ...]] = {}
        self._bindings: dict[str, UsdShade.Material | None] = {}
        self._instance_inputs: set[str] = set()

    def bind(self, prims: list[Usd.Prim]) -> None:
        """Looks up the materials of many prims at once, which is faster than separate look-ups."""
        self._bindings.update(self._materials.bound_materials(prims))

    def describe(
        self, prim: Usd.Prim, baked: Any = None, instance: InstanceValues | None = None
    ) -> Appearance | None:
        """The mesh and materials of a prim; None, with a notice, for a prim without visible faces.

        `baked` is a matrix that is applied to the points. `instance` contains the primvars of a point instancer's
        instance.
        """
        path = prim.GetPath().pathString
        if path not in self._bindings:
            self.bind([prim])
        bound = self._bindings[path]
        shared = prim.IsInstanceProxy() and prim not in self._skinning
        key = (
            prim.GetPrimInPrototype().GetPath().pathString if shared else path,
            bound.GetPath().pathString if bound else "",
            self._inherited_key(prim) if shared else (),
            None if baked is None else baked.tobytes(),
            instance.key if instance else None,
        )
        if key not in self._known:
            try:
                self._known[key] = self._build(prim, bound, baked, instance)
            except Reason as reason:
                self._note("ignored_element", prim, f"not shown: {reason}")
                self._known[key] = None
        return self._known[key]

    def _note(self, code: str, prim: Usd.Prim, text: str) -> None:
        self.notices.append(StageNotice(code, text, f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}"))

    def _find(self, prim: Usd.Prim, name: str, width: int, instance: InstanceValues | None) -> Primvar | None:
        """Returns the primvar that applies to a prim.

        If an instance provides the primvar, the primvar's name is added to `_instance_inputs`.
        """
        primvar = find_primvar(prim, name, width, self._time, instance)
        if primvar is not None and primvar.of_instance:
            self._instance_inputs.add(name)
        return primvar

    def _inherited_key(self, prim: Usd.Prim) -> tuple[str, ...]:
        """The primvars that the instance of a prim inherits from outside, as attribute paths."""
        while not prim.IsInstance():
            prim = prim.GetParent()
        path = prim.GetPath().pathString
        if path not in self._inherited:
            found = UsdGeom.PrimvarsAPI(prim).FindInheritablePrimvars()
            self._inherited[path] = tuple(primvar.GetAttr().GetPath().pathString for primvar in found)
        return self._inherited[path]

    def _build(
        self,
        prim: Usd.Prim,
        bound: UsdShade.Material | None,
        baked: Any,
        instance: InstanceValues | None,
    ) -> Appearance:
        self._instance_inputs = set()
        shape = self._shape(prim, baked, instance)
        groups = self._groups(prim, bound, shape.faces, instance)
        if shape.unusable.any():
            groups = [replace(own, faces=own.faces[~shape.unusable[own.faces]]) for own in groups]
        groups = [own for own in groups if len(own.faces)]
        if not groups:
            raise Reason("the mesh has no valid faces: all are holes or refer to invalid vertices")
        left_handed = UsdGeom.Gprim(prim).GetOrientationAttr().Get(self._time) == UsdGeom.Tokens.leftHanded
        mirrored = baked is not None and np.linalg.det(baked[:3, :3]) < 0
        counts = shape.faces.counts
        chosen = np.concatenate([own.faces for own in groups])
        corner = order_corners(counts, chosen, left_handed, mirrored)
        sizes = [int(counts[own.faces].sum()) for own in groups]
        uvs, uv_index = self._texture_coordinates(prim, groups, sizes, corner, shape.faces, instance)
        index = np.full((len(corner), 3), NO_INDEX, np.uint32)
        index[:, 0] = shape.faces.indices[corner]
        index[:, 1] = uv_index
        normals = np.zeros((0, 3), np.float32)
        if shape.normals is not None:
            normals, index[:, 2] = shape.normals.rows, shape.normals.index[corner]
        slots = np.repeat(np.arange(len(groups)), [len(own.faces) for own in groups])
        mesh = self._handover.add_mesh(
            MeshArrays(
                points=shape.faces.points,
                colors=self._colors(prim, groups, sizes, corner, shape.faces),
                uvs=uvs,
                normals=normals,
                polygons=np.column_stack([counts[chosen], slots]),
                corners=index,
                smooth=shape.smooth,
            )
        )
        materials = tuple(own.material for own in groups)
        is_plain = len(groups) == 1 and groups[0].colors is None
        color = self._handover.plain_color(materials[0]) if is_plain else None
        return Appearance(mesh, materials, len(corner), color, frozenset(self._instance_inputs))

    def _shape(self, prim: Usd.Prim, baked: Any, instance: InstanceValues | None) -> Shape:
        """The polygons of a prim; raises `Reason` if they are invalid."""
        kind = prim.GetTypeName()
        if kind in GPRIMS:
            try:
                faces = gprim_faces(prim, self._time)
            except (TypeError, ValueError) as error:
                raise Reason(str(error)) from None
            shape = Shape(faces)
            if faces.normals is not None:
                shape.normals = Attribute(faces.normals, np.arange(len(faces.indices)))
        else:
            shape = Shape(
                _tet_faces(prim, self._time) if kind == "TetMesh" else _mesh_faces(prim, self._time)
            )
        if fault := find_fault(shape.faces):
            raise Reason(fault)
        shape.unusable = find_unusable_faces(shape.faces)
        if shape.unusable.any():
            count = f"{np.count_nonzero(shape.unusable)} of {len(shape.unusable)}"
            self._note(
                "dropped_geometry",
                prim,
                f"{count} faces are dropped: they have fewer than three corners or points that are not finite",
            )
            points = np.where(np.isfinite(shape.faces.points), shape.faces.points, 0)
            shape.faces = shape.faces._replace(points=points)
        if kind == "Mesh":
            shape.smooth = UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get(self._time) != "none"
        if shape.smooth:
            self._note(
                "approximated_value",
                prim,
                "subdivision is not supported; the control mesh is shown with smooth shading",
            )
        elif kind not in GPRIMS:
            shape.normals = self._normals(prim, shape.faces, instance)
        self._skin(prim, shape)
        if baked is not None:
            _bake(shape, baked)
        return shape

    def _skin(self, prim: Usd.Prim, shape: Shape) -> None:
        """Applies the joints and blend shapes of a prim."""
        if prim not in self._skinning:
            return
        try:
            points = self._skinning.points(prim, shape.faces.points)
        except ValueError as reason:
            self._note("ignored_feature", prim, f"the mesh's skeleton is not applied: {reason}")
            return
        if shape.normals is not None:
            normals = self._skinning.normals(prim, shape.normals.spread(), shape.faces)
            shape.normals = Attribute(normals, np.arange(len(normals)))
        shape.faces = shape.faces._replace(points=points)

    def _normals(self, prim: Usd.Prim, faces: Faces, instance: InstanceValues | None) -> Attribute | None:
        """The normals of a mesh."""
        primvar = self._find(prim, "normals", 3, instance)
        if primvar is None:
            mesh = UsdGeom.PointBased(prim)
            values = mesh.GetNormalsAttr().Get(self._time)
            if values is None or not len(values):
                return None
            primvar = Primvar(read_table(values, 3), mesh.GetNormalsInterpolation())
        normals = primvar.attach(faces)
        if normals is None:
            self._note(
                "ignored_key", prim, f"normals are ignored: {primvar.count} values do not fit the mesh"
            )
        return normals

    def _groups(
        self, prim: Usd.Prim, bound: UsdShade.Material | None, faces: Faces, instance: InstanceValues | None
    ) -> list[Group]:
        """The faces of each material, without the faces that the mesh marks as holes."""
        count = len(faces.counts)
        rest = np.ones(count, bool)
        groups: list[Group] = []
        for subset in self._subsets(prim):
            table = read_table(subset.GetIndicesAttr().Get(self._time), 1)
            own = np.zeros(0, np.int64) if table is None else table.ravel().astype(np.int64)
            own = own[(own >= 0) & (own < count)]
            own = own[rest[own]]
            if (material := self._materials.bound_material(subset.GetPrim())) is not None:
                rest[own] = False
                groups.extend(self._group(prim, material, own, faces, instance))
        groups = [*self._group(prim, bound, np.flatnonzero(rest), faces, instance), *groups]
        if bound is None and rest.any() and _has_binding(prim):
            self._note(
                "ignored_feature",
                prim,
                "the material binding's target is missing or has an unknown purpose",
            )
        if prim.GetTypeName() == "Mesh":
            holes = read_table(UsdGeom.Mesh(prim).GetHoleIndicesAttr().Get(self._time), 1)
            if holes is not None:
                groups = [replace(own, faces=own.faces[~np.isin(own.faces, holes)]) for own in groups]
        return groups

    def _group(
        self,
        prim: Usd.Prim,
        material: UsdShade.Material | None,
        chosen: Any,
        faces: Faces,
        instance: InstanceValues | None,
    ) -> list[Group]:
        """Returns the faces `chosen`, which share a material, as groups of equal opacity."""
        if not len(chosen):
            return []
        if material is not None and self._materials.is_known(material):
            return [self._known_group(prim, material, chosen, instance)]
        name = None if material is None else self._materials.add(material)
        colors = self._find(prim, "displayColor", 3, instance)
        base: tuple[float, ...] = GREY
        if colors is not None and (colors.rows is None or not np.isfinite(colors.rows).all()):
            self._note("ignored_key", prim, "displayColor is ignored: some values are not numbers")
            colors = None
        if colors is not None:
            if (row := colors.constant) is not None:
                base, colors, name = tuple(np.clip(row, 0, 1).tolist()), None, None
            else:
                base, name = (1.0, 1.0, 1.0), None
        opacities = self._opacities(prim, faces, instance)
        if name is not None:
            opaque = opacities is None
            return [Group(name, chosen)] if opaque else self._split(base, chosen, opacities, colors)
        if opacities is None:
            return [Group(self._handover.add_plain(base, 1.0), chosen, colors)]
        return self._split(base, chosen, opacities, colors)

    def _split(
        self, base: tuple[float, ...], chosen: Any, opacities: Any, colors: Primvar | None
    ) -> list[Group]:
        """One group for each opacity, the largest first."""
        own = opacities[chosen]
        return [
            Group(self._handover.add_plain(base, float(value)), chosen[own == value], colors)
            for value in np.unique(own)[::-1]
        ]

    def _known_group(
        self, prim: Usd.Prim, material: UsdShade.Material, chosen: Any, instance: InstanceValues | None
    ) -> Group:
        """Returns the group of faces with a UsdPreviewSurface.

        The group contains the primvar that may determine the faces' colour.
        """
        number = self._materials.add(material)
        reader = self._materials.color_reader(number)
        if reader is None:
            return Group(number, chosen)
        colors = self._find(prim, reader.primvar, 3, instance)
        if colors is None or colors.rows is None or not np.isfinite(colors.rows).all():
            if colors is not None or reader.fallback is None:
                self._note(
                    "ignored_key",
                    prim,
                    f"the material reads colours from primvar {reader.primvar}, which is missing or not a colour;"
                    " the reader's fallback is used",
                )
            return Group(self._materials.tint(number, reader.fallback or (0.0, 0.0, 0.0)), chosen)
        if (row := colors.constant) is not None:
            return Group(self._materials.tint(number, tuple(np.clip(row, 0, 1).tolist())), chosen)
        return Group(number, chosen, colors)

    def _subsets(self, prim: Usd.Prim) -> list[UsdGeom.Subset]:
        """The face sets with materials, including those without a family, which OpenUSD ignores."""
        if not prim.GetAllChildren():
            return []
        mesh = UsdGeom.Imageable(prim)
        subsets = list(UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets())
        for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
            of_faces = subset.GetElementTypeAttr().Get(self._time) == UsdGeom.Tokens.face
            if subset.GetFamilyNameAttr().Get() or not of_faces or not _binds(subset.GetPrim()):
                continue
            self._note(
                "invalid_file",
                subset.GetPrim(),
                'the subset\'s material is used although familyName is not "materialBind"',
            )
            subsets.append(subset)
        return subsets

    def _opacities(self, prim: Usd.Prim, faces: Faces, instance: InstanceValues | None) -> Any:
        """The displayed opacity of each face; None if all faces are opaque."""
        primvar = self._find(prim, "displayOpacity", 1, instance)
        if primvar is None:
            return None
        if primvar.constant is not None and np.isfinite(primvar.constant).all():
            return np.full(len(faces.counts), round(float(np.clip(primvar.constant[0], 0, 1)), 6))
        opacities = primvar.attach(faces)
        if opacities is None:
            self._note(
                "ignored_key",
                prim,
                f"displayOpacity is ignored: {primvar.count} values do not fit the mesh",
            )
            return None
        corners = np.round(np.clip(opacities.spread().ravel().astype(float), 0, 1), 6)
        shown = faces.counts > 0
        starts = (np.cumsum(faces.counts) - faces.counts)[shown]
        low, high, means = (np.ones(len(faces.counts)) for _ in range(3))
        low[shown], high[shown] = np.minimum.reduceat(corners, starts), np.maximum.reduceat(corners, starts)
        means[shown] = np.add.reduceat(corners, starts) / faces.counts[shown]
        if (high > low).any():
            self._note("approximated_value", prim, "opacities that differ within a face are averaged")
            means = np.round(means * 255) / 255
        return np.where(high > low, means, low)

    def _colors(
        self, prim: Usd.Prim, groups: list[Group], sizes: list[int], corner: Any, faces: Faces
    ) -> Any:
        """Linear colours of all points or corners; None if the materials define all colours."""
        for own in groups:
            if own.colors is not None and own.colors.attach(faces) is None:
                self._note(
                    "ignored_key",
                    prim,
                    f"colours are ignored: {own.colors.count} values do not fit the mesh",
                )
                own.colors = None
        primvars = [own.colors for own in groups]
        if not any(primvars):
            return np.zeros((0, 3), np.float32)
        only = primvars[0]
        same = only is not None and all(other is not None and other.rows is only.rows for other in primvars)
        per_point = only is not None and only.indices is None and only.interpolation in ("vertex", "varying")
        if same and per_point and only is not None and only.count == len(faces.points):
            return np.clip(only.rows, 0, 1)
        colors = np.ones((len(corner), 3), np.float32)
        start = 0
        for own, size in zip(groups, sizes, strict=True):
            attribute = own.colors.attach(faces) if own.colors is not None else None
            if attribute is not None:
                used = attribute.index[corner[start : start + size]]
                colors[start : start + size] = np.clip(attribute.rows[used], 0, 1)
            start += size
        return colors

    def _texture_coordinates(
        self,
        prim: Usd.Prim,
        groups: list[Group],
        sizes: list[int],
        corner: Any,
        faces: Faces,
        instance: InstanceValues | None,
    ) -> tuple[Any, Any]:
        """Returns the texture coordinates of a mesh, and the index of each face corner into them."""
        tables: list[Any] = [np.zeros((0, 2), np.float32)]
        index = np.full(len(corner), NO_INDEX, np.uint32)
        start = before = 0
        for own, size in zip(groups, sizes, strict=True):
            chosen = slice(start, start + size)
            start += size
            uvs = self._uvs(prim, own.material, faces, instance)
            if uvs is None:
                continue
            used = uvs.index[corner[chosen]]
            table = self._materials.coordinates(own.material).apply(uvs.rows, used)
            if not np.isfinite(table[used]).all():
                self._note("ignored_key", prim, "texture coordinates are ignored: they are not finite")
                continue
            table = np.where(np.isfinite(table), table, 0)
            tables.append(np.column_stack([table[:, 0], 1.0 - table[:, 1]]))
            index[chosen] = used + before
            before += len(table)
        return np.concatenate(tables), index

    def _uvs(
        self, prim: Usd.Prim, material: int, faces: Faces, instance: InstanceValues | None
    ) -> Attribute | None:
        """Returns the texture coordinates of a mesh for a material.

        The result is None if the mesh has no texture coordinates.
        """
        coordinates = self._materials.coordinates(material)
        constant = coordinates.constant
        name = coordinates.primvar or ("st" if constant is None else None)
        if name is not None:
            primvar = self._find(prim, name, 2, instance)
            uvs = primvar.attach(faces) if primvar is not None else None
            if primvar is not None and uvs is None:
                self._note(
                    "ignored_key",
                    prim,
                    f"primvar {name} is ignored: {primvar.count} values do not fit the mesh",
                )
            if uvs is not None or constant is None:
                return uvs
            place = ", ".join(f"{value:g}" for value in constant)
            self._note(
                "missing_value",
                prim,
                f"texture coordinates {name} are missing or unusable; "
                f"each texture is replaced by its colour at ({place})",
            )
        zeros = np.zeros(len(faces.indices), np.int64)
        return Attribute(np.array([constant], np.float32), zeros)


def _bake(shape: Shape, matrix: Any) -> None:
    """Applies a matrix [4, 4] to points and normals."""
    linear = matrix[:3, :3]
    shape.faces = shape.faces._replace(points=shape.faces.points @ linear.T + matrix[:3, 3])
    if shape.normals is None:
        return
    if np.linalg.matrix_rank(linear) < 3:
        shape.normals = None
    else:
        shape.normals = replace(shape.normals, rows=shape.normals.rows @ np.linalg.inv(linear))


def _mesh_faces(prim: Usd.Prim, time: Usd.TimeCode) -> Faces:
    """The faces of a mesh as stored in the file."""
    mesh = UsdGeom.Mesh(prim)
    points = _array(mesh.GetPointsAttr(), Vt.Vec3fArray, time)
    counts = _array(mesh.GetFaceVertexCountsAttr(), Vt.IntArray, time)
    indices = _array(mesh.GetFaceVertexIndicesAttr(), Vt.IntArray, time)
    return Faces(points, counts.astype(np.int64), indices.astype(np.int64))


def _tet_faces(prim: Usd.Prim, time: Usd.TimeCode) -> Faces:
    """The surface of a mesh of tetrahedra; computed if the file does not contain it."""
    mesh = UsdGeom.TetMesh(prim)
    points = _array(mesh.GetPointsAttr(), Vt.Vec3fArray, time)
    surface = mesh.GetSurfaceFaceVertexIndicesAttr().Get(time)
    if not surface:
        _array(mesh.GetTetVertexIndicesAttr(), Vt.Vec4iArray, time)
        surface = UsdGeom.TetMesh.ComputeSurfaceFaces(mesh, time)
    triangles = np.array(surface, np.int64).reshape(-1, 3)
    return Faces(points, np.full(len(triangles), 3), triangles.ravel())


def _array(attribute: Usd.Attribute, kind: type, time: Usd.TimeCode) -> Any:
    """The array of an attribute; raises `Reason` for a missing value or another type."""
    value = attribute.Get(time)
    if value is not None and not isinstance(value, kind):
        given = attribute.GetPropertyStack(time)[0].typeName
        raise Reason(f"{attribute.GetName()} has the type {given}, expected {attribute.GetTypeName()}")
    if not value:
        raise Reason(f"the mesh has no {attribute.GetName()}")
    return np.array(value)


def _binds(prim: Usd.Prim) -> bool:
    """True for a prim that itself has a material binding, for any purpose."""
    bindings = [r for r in prim.GetAuthoredRelationships() if r.GetName().startswith("material:binding")]
    return any(binding.GetTargets() for binding in bindings)


def _has_binding(prim: Usd.Prim) -> bool:
    """True for a prim with a material binding of its own or of an ancestor, for any purpose."""
    while prim and not prim.IsPseudoRoot():
        if _binds(prim):
            return True
        prim = prim.GetParent()
    return False
