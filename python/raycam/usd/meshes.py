"""Meshes and solids of USD as OBJ files. Source: the schema `UsdGeomMesh`."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade, Vt

from .gprims import GPRIMS, Faces, gprim_faces
from .materials import Coordinates, Materials, bound_material
from .skinning import Skinning

__all__ = ["Meshes", "rows"]


def rows(matrix: Gf.Matrix4d) -> list[list[float]]:
    """The matrix for column vectors, as raycam uses them; USD's matrices are for row vectors."""
    return np.array(matrix).T.tolist()  # type: ignore[no-any-return]


@dataclass
class Shape:
    """The polygons of a prim, ready to be written."""

    faces: Faces
    colors: Any = None
    """sRGB colours [n, 3] of points, or of corners where `apart`."""
    apart: bool = False
    normals: Any = None
    """Normals [corners, 3]."""
    smooth: bool = False
    lost: Any = None
    """Mask [faces] of those that cannot be shown."""


class Meshes:
    """The meshes of a stage as OBJ files in a folder; a mesh that instances share is written once."""

    def __init__(
        self, folder: Path, materials: Materials, skinning: Skinning, time: Usd.TimeCode, max_corners: int
    ) -> None:
        self.notices: list[str] = []
        self._folder = folder
        self._materials = materials
        self._skinning = skinning
        self._time = time
        self._left = max_corners
        self._known: dict[tuple[Any, ...], tuple[str | None, int]] = {}
        self._files: dict[bytes, str] = {}
        """By the hash of what was written: copies of a prim are one mesh, as instances are."""

    def describe(
        self, name: str, mesh: UsdGeom.Gprim, world_from_local: Any, bake: bool = False
    ) -> dict[str, Any] | None:
        """The description of an object; None, with a notice, for a prim without anything to show.

        With `bake` its mesh is written in the coordinates of the world.
        """
        path = mesh.GetPath().pathString
        matrix = np.array(world_from_local)
        if not np.isfinite(matrix).all():
            self.notices.append(f"prim {path} is left out: its transform is not finite")
            return None
        rank = np.linalg.matrix_rank(matrix[:3, :3])
        if rank < 2:
            self.notices.append(
                f"prim {path} is left out: its transform has scale 0, it is flat to a line or point"
            )
            return None
        # A matrix that flattens has no inverse: its mesh is written in the coordinates of the world.
        bake = bake or rank < 3
        file = self._file(mesh, matrix if bake else None)
        placed = np.eye(4)[:3] if bake else matrix[:3]
        return None if file is None else {"name": name, "mesh": file, "matrix": placed.tolist()}

    def merge(self, objects: list[dict[str, Any]]) -> str:
        """Writes the meshes of objects, which are in the coordinates of the world, as one OBJ file."""
        texts = [
            (self._folder / placed["mesh"]).read_text(encoding="utf-8").splitlines() for placed in objects
        ]
        colored = any(line.startswith("v ") and line.count(" ") > 3 for text in texts for line in text)
        lines = ["mtllib materials.mtl"]
        before = [0, 0, 0]
        for text in texts:
            counts = [0, 0, 0]
            for line in text[1:]:
                key, _, rest = line.partition(" ")
                if key in ("v", "vt", "vn"):
                    counts[("v", "vt", "vn").index(key)] += 1
                    line += " 1 1 1" if key == "v" and colored and line.count(" ") == 3 else ""
                elif key == "f":
                    line = "f " + " ".join(_shifted(corner, before) for corner in rest.split())
                lines.append(line)
            before = [old + new for old, new in zip(before, counts, strict=True)]
        (self._folder / "merged.obj").write_text("\n".join([*lines, ""]), encoding="utf-8")
        return "merged.obj"

    def _file(self, mesh: UsdGeom.Gprim, placed: Any) -> str | None:
        """The name of the mesh's OBJ file; None for a mesh without faces."""
        prim = mesh.GetPrim()
        own = prim.GetPrimInPrototype() if prim.IsInstanceProxy() and prim not in self._skinning else prim
        bound = bound_material(prim)
        key = (
            own.GetPath().pathString,
            bound.GetPath().pathString if bound else "",
            None if placed is None else placed.tobytes(),
        )
        if key not in self._known:
            try:
                self._known[key] = self._write(mesh, bound, placed)
            except _Unusable as reason:
                self.notices.append(f"{prim.GetTypeName()} {mesh.GetPath()} is left out: {reason}")
                self._known[key] = None, 0
        name, corners = self._known[key]
        self._left -= corners
        if self._left < 0:
            raise MemoryError
        return name

    def _write(self, mesh: UsdGeom.Gprim, bound: UsdShade.Material | None, placed: Any) -> tuple[str, int]:
        shape = self._shape(mesh, placed)
        counts, indices = shape.faces.counts, shape.faces.indices
        shape.colors, color = self._colors(mesh, bound, shape.faces)
        groups = self._groups(mesh, color, self._opacities(mesh, bound, shape.faces), len(counts))
        if lost := set(np.flatnonzero(shape.lost).tolist()):
            seen = [(name, [face for face in faces if face not in lost]) for name, faces in groups]
            groups = [(name, faces) for name, faces in seen if faces]
        if not any(len(faces) for _, faces in groups):
            raise _Unusable("all its faces are holes" + (" or unusable" if lost else ""))
        # Colours per corner need separate vertices, which a smooth surface cannot have.
        shape.apart = shape.colors is not None and len(shape.colors) != len(shape.faces.points)
        if shape.apart and shape.smooth:
            self.notices.append(f"mesh {mesh.GetPath()}: colours for each face or corner are not used")
            shape.colors, shape.apart = None, False
        lines = ["mtllib materials.mtl"]
        points = shape.faces.points[indices] if shape.apart else shape.faces.points
        position = np.arange(len(indices)) + 1 if shape.apart else indices + 1
        lines.extend(_numbers("v", points if shape.colors is None else np.hstack([points, shape.colors])))
        normal_ids = None
        if shape.normals is not None:
            kept, back = np.unique(shape.normals, axis=0, return_inverse=True)
            lines.extend(_numbers("vn", kept))
            normal_ids = back.reshape(-1) + 1
        lines.append("s 1" if shape.smooth else "s off")
        turn = -1 if mesh.GetOrientationAttr().Get(self._time) == UsdGeom.Tokens.leftHanded else 1
        mirrored = placed is not None and np.linalg.det(placed[:3, :3]) < 0
        ends = np.cumsum(counts)
        written = 0
        for name, faces in groups:
            words, written = self._words(mesh, name, shape.faces, position, normal_ids, lines, written)
            lines.append(f"usemtl {name}")
            for face in faces:
                corners = words[ends[face] - counts[face] : ends[face]][::turn]
                if mirrored:
                    corners = [corners[0], *corners[:0:-1]]
                lines.append("f " + " ".join(corners))
        text = "\n".join([*lines, ""]).encode()
        file = f"mesh{len(self._known)}.obj"
        known = self._files.setdefault(hashlib.sha256(text).digest(), file)
        if known == file:
            (self._folder / file).write_bytes(text)
        return known, len(indices)

    def _words(
        self,
        mesh: UsdGeom.Gprim,
        material: str,
        faces: Faces,
        position: Any,
        normal_ids: Any,
        lines: list[str],
        written: int,
    ) -> tuple[list[str], int]:
        """The words of all corners with a material's texture coordinates, and how many coordinates are written."""
        uvs, coordinates = self._uvs(mesh, material, faces)
        if uvs is None and normal_ids is None:
            return position.astype(str).tolist(), written
        uv_words: list[Any] = [""] * len(position)
        if uvs is not None:
            kept, back = np.unique(coordinates.apply(uvs), axis=0, return_inverse=True)
            lines.extend(_numbers("vt", kept))
            uv_words = (back.reshape(-1) + 1 + written).tolist()
            written += len(kept)
        parts = [position.tolist(), uv_words]
        parts.extend([normal_ids.tolist()] if normal_ids is not None else [])
        return ["/".join(map(str, corner)) for corner in zip(*parts, strict=True)], written

    def _uvs(self, mesh: UsdGeom.Gprim, material: str, faces: Faces) -> tuple[Any, Coordinates]:
        """The texture coordinates of a mesh at every corner for a material, or None, and how they are applied."""
        coordinates = self._materials.coordinates(material)
        primvar, constant = coordinates.primvar, coordinates.constant
        if constant is None:
            return self._corners(mesh, primvar or "st", faces, 2), coordinates
        uvs = None if primvar is None else self._corners(mesh, primvar, faces, 2)
        if uvs is not None:
            return uvs, coordinates
        # As the specification of UsdPreviewSurface says.
        if primvar is not None:
            place = ", ".join(f"{value:g}" for value in constant)
            self.notices.append(
                f"mesh {mesh.GetPath()}: without usable texture coordinates {primvar}, its images are one colour, that"
                f" at ({place})"
            )
        return np.tile(np.array(constant, np.float32), (len(faces.indices), 1)), coordinates

    def _shape(self, mesh: UsdGeom.Gprim, placed: Any) -> Shape:
        """The polygons of a prim; raises `_Unusable` for invalid ones."""
        prim, path = mesh.GetPrim(), mesh.GetPath().pathString
        if prim.GetTypeName() in GPRIMS:
            try:
                faces = gprim_faces(prim, self._time)
            except (TypeError, ValueError):
                raise _Unusable("an attribute has no value, or one of a wrong type") from None
            shape = Shape(faces, normals=faces.normals)
        else:
            shape = Shape(_faces(UsdGeom.Mesh(prim), self._time))
        if fault := _fault(shape.faces):
            raise _Unusable(fault)
        shape.lost = _unusable_faces(shape.faces)
        if shape.lost.any():
            self.notices.append(
                f"mesh {path}: faces of fewer than three corners, or with points that are not finite, are left out:"
                f" {np.count_nonzero(shape.lost)} of {len(shape.lost)}"
            )
            points = np.where(np.isfinite(shape.faces.points), shape.faces.points, 0)
            shape.faces = shape.faces._replace(points=points)
        if prim.GetTypeName() not in GPRIMS:
            shape.smooth = UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get(self._time) != "none"
            if shape.smooth:
                self.notices.append(
                    f"mesh {path}: a subdivision surface, shown as the mesh that it starts from, smooth"
                )
            else:
                shape.normals = self._normals(UsdGeom.Mesh(prim), shape.faces)
        if prim in self._skinning:
            try:
                moved = self._skinning.points(prim, shape.faces.points)
            except ValueError as reason:
                self.notices.append(f"mesh {path} is not skinned: {reason}")
            else:
                if shape.normals is not None:
                    shape.normals = self._skinning.normals(prim, shape.normals, shape.faces)
                shape.faces = shape.faces._replace(points=moved)
        if placed is not None:
            points = shape.faces.points @ placed[:3, :3].T + placed[:3, 3]
            shape.faces = shape.faces._replace(points=points)
            flattened = np.linalg.matrix_rank(placed[:3, :3]) < 3
            if shape.normals is not None:
                shape.normals = None if flattened else shape.normals @ np.linalg.inv(placed[:3, :3])
        return shape

    def _normals(self, mesh: UsdGeom.Mesh, faces: Faces) -> Any:
        """The normals of a mesh at every corner."""
        normals = self._corners(mesh, "normals", faces, 3)
        if normals is None and (own := _table(mesh.GetNormalsAttr().Get(self._time), 3)) is not None:
            normals = _spread(
                own.astype(np.float32), mesh.GetNormalsInterpolation(), faces.counts, faces.indices
            )
            if normals is None or not np.isfinite(normals).all():
                self.notices.append(
                    f"mesh {mesh.GetPath()}: {len(own)} normals do not fit it and are not used"
                )
                return None
        return normals

    def _groups(self, mesh: UsdGeom.Gprim, color: str, opacities: Any, count: int) -> list[tuple[str, Any]]:
        """The faces of each material, by name, without holes."""
        rest = np.ones(count, bool)
        groups = []
        for subset in self._subsets(mesh, count):
            faces = _table(subset.GetIndicesAttr().Get(self._time), 1)
            faces = np.zeros(0, np.int64) if faces is None else faces.ravel().astype(np.int64)
            faces = faces[(faces >= 0) & (faces < count)]
            faces = faces[rest[faces]]
            if (material := bound_material(subset.GetPrim())) is not None:
                rest[faces] = False
                groups.append((self._materials.name(material), faces))
        if opacities is None:
            groups.insert(0, (color, np.flatnonzero(rest)))
        else:
            for value in np.unique(opacities[rest]):
                clear = self._materials.clear(color, float(value))
                groups.insert(0, (clear, np.flatnonzero(rest & (opacities == value))))
        holes = UsdGeom.Mesh(mesh).GetHoleIndicesAttr().Get(self._time) if UsdGeom.Mesh(mesh) else None
        hole_table = np.zeros(0) if (found := _table(holes, 1)) is None else found.ravel()
        return [
            (name, kept.tolist()) for name, faces in groups if len(kept := faces[~np.isin(faces, hole_table)])
        ]

    def _subsets(self, mesh: UsdGeom.Gprim, count: int) -> list[UsdGeom.Subset]:
        """The face sets with materials; those without a family, which Pixar's library skips, with a notice."""
        found = list(UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets())
        for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
            prim = subset.GetPrim()
            of_faces = subset.GetElementTypeAttr().Get(self._time) == UsdGeom.Tokens.face
            if subset.GetFamilyNameAttr().Get() or not of_faces or not _binds(prim):
                continue
            self.notices.append(
                f'subset {prim.GetPath()} has no familyName "materialBind": its material is used all the same'
            )
            found.append(subset)
        return found

    def _opacities(self, mesh: UsdGeom.Gprim, bound: UsdShade.Material | None, faces: Faces) -> Any:
        """The opacity of each face for display; None where it is 1, or a material says it."""
        if bound and self._materials.is_known(bound):
            return None
        primvar = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance("displayOpacity")
        values = _table(primvar.ComputeFlattened(self._time), 1) if primvar else None
        if values is None or not np.isfinite(values := values.ravel().astype(float)).all():
            return None
        values = np.round(np.clip(values, 0, 1), 6)
        interpolation = primvar.GetInterpolation()
        if len(values) == 1:
            interpolation = "constant"
        corners = _spread(values, interpolation, faces.counts, faces.indices)
        if corners is None:
            self.notices.append(
                f"mesh {mesh.GetPath()}: {len(values)} opacities do not fit it and are not used"
            )
            return None
        starts = np.cumsum(faces.counts) - faces.counts
        means = np.add.reduceat(corners, starts) / faces.counts
        low, high = np.minimum.reduceat(corners, starts), np.maximum.reduceat(corners, starts)
        if (high > low).any():
            self.notices.append(f"mesh {mesh.GetPath()}: opacities that differ within a face are averaged")
            means = np.round(means * 255) / 255
        return np.where(high > low, means, low)

    def _colors(self, mesh: UsdGeom.Gprim, bound: UsdShade.Material | None, faces: Faces) -> tuple[Any, str]:
        """The sRGB colours of points or corners as in an OBJ file, and the material."""
        path = mesh.GetPath()
        known = bound is not None and self._materials.is_known(bound)
        material = self._materials.name(bound) if bound is not None else ""
        primvar: str | None = "displayColor"
        if bound is None and _binds(mesh.GetPrim(), inherited=True):
            self.notices.append(
                f"prim {path}: no material is where its binding leads, or for no known purpose"
            )
        if known:
            primvar = self._materials.color_primvar(material)
            if not primvar:
                return None, material
        colors = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance(primvar)
        table = _table(colors.ComputeFlattened(self._time), 3) if colors else None
        if table is None or not np.isfinite(table).all():
            if known or (colors and colors.HasValue()):
                self.notices.append(f"prim {path}: it has no usable colours {primvar}")
            return None, material or self._materials.plain((0.8, 0.8, 0.8))
        table = np.clip(table.astype(np.float64), 0, 1)
        if len(table) == 1:
            if known:
                return None, self._materials.tinted(material, tuple(table[0].tolist()))
            return None, self._materials.plain(tuple(table[0].tolist()))
        srgb = np.where(table <= 0.0031308, 12.92 * table, 1.055 * table ** (1 / 2.4) - 0.055)
        white = material if known else self._materials.plain((1.0, 1.0, 1.0))
        if colors.GetInterpolation() in ("vertex", "varying") and len(srgb) == len(faces.points):
            return srgb, white
        spread = _spread(srgb, colors.GetInterpolation(), faces.counts, faces.indices)
        if spread is None:
            self.notices.append(f"mesh {path}: {len(table)} colours do not fit it and are not used")
        return spread, white

    def _corners(self, mesh: UsdGeom.Gprim, name: str, faces: Faces, width: int) -> Any:
        """The values of a primvar at every corner."""
        primvar = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance(name)
        values = primvar.ComputeFlattened(self._time) if primvar else None
        if values is None or not len(values):
            return None
        table = _table(values, width)
        found = None
        if table is not None:
            found = _spread(table.astype(np.float32), primvar.GetInterpolation(), faces.counts, faces.indices)
        if found is None or not np.isfinite(found).all():
            self.notices.append(
                f"mesh {mesh.GetPath()}: {len(values)} values of {name} do not fit it and are not used"
            )
            return None
        return found


def _shifted(corner: str, before: list[int]) -> str:
    """A corner of a face in an OBJ file behind another one."""
    parts = corner.split("/")
    return "/".join(str(int(part) + old) if part else "" for part, old in zip(parts, before, strict=False))


class _Unusable(Exception):
    """A prim has nothing to show, with the reason."""


def _faces(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> Faces:
    """The faces of a mesh as stored in the file."""
    found = []
    for attribute, kind in (
        (mesh.GetPointsAttr(), Vt.Vec3fArray),
        (mesh.GetFaceVertexCountsAttr(), Vt.IntArray),
        (mesh.GetFaceVertexIndicesAttr(), Vt.IntArray),
    ):
        value = attribute.Get(time)
        if value is not None and not isinstance(value, kind):
            given = attribute.GetPropertyStack(time)[0].typeName
            raise _Unusable(
                f"its {attribute.GetName()} are of the type {given}, not {attribute.GetTypeName()}"
            )
        if not value:
            raise _Unusable(f"it has no {attribute.GetName()}")
        found.append(np.array(value))
    return Faces(found[0], found[1].astype(np.int64), found[2].astype(np.int64))


def _table(values: Any, width: int) -> Any:
    """An array of numbers [n, width]; None for values of another type, and for none."""
    try:
        table = np.array(values)
    except (TypeError, ValueError):
        return None
    if table.dtype.kind not in "fiu" or not table.size:
        return None
    if width == 1:
        return table.reshape(-1, 1) if table.ndim == 1 else None
    return table if table.ndim == 2 and table.shape[1] == width else None


def _fault(found: Faces) -> str | None:
    """The error message for invalid faces; None for valid ones."""
    points, counts, indices = found.points, found.counts, found.indices
    if (counts < 0).any() or counts.sum() != len(indices):
        return f"its faces have {counts.sum()} corners, it has {len(indices)}"
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        return f"a corner is none of its {len(points)} points"
    return None if len(indices) else "it has no faces"


def _unusable_faces(found: Faces) -> Any:
    """A mask of the faces that have fewer than three corners, or a point that is not finite."""
    odd = np.append(~np.isfinite(found.points).all(axis=1)[found.indices], False)
    ends = np.cumsum(found.counts)
    sums = np.concatenate([[0], np.cumsum(odd)])
    return (found.counts < 3) | (sums[ends] > sums[ends - found.counts])


def _spread(table: Any, interpolation: str, counts: Any, indices: Any) -> Any:
    """Values for every corner from values per point, per face or constant; None if the count does not fit."""
    if interpolation == "constant" and len(table) == 1:
        return np.repeat(table, len(indices), axis=0)
    if interpolation == "uniform" and len(table) == len(counts):
        return np.repeat(table, counts, axis=0)
    if interpolation in ("vertex", "varying") and len(table) > indices.max():
        return table[indices]
    if interpolation == "faceVarying" and len(table) == len(indices):
        return table
    return None


def _binds(prim: Usd.Prim, inherited: bool = False) -> bool:
    """True for a prim with a material binding, for any purpose; with `inherited` also where it is an ancestor's."""
    while prim and not prim.IsPseudoRoot():
        bindings = [r for r in prim.GetAuthoredRelationships() if r.GetName().startswith("material:binding")]
        if any(binding.GetTargets() for binding in bindings):
            return True
        if not inherited:
            return False
        prim = prim.GetParent()
    return False


def _numbers(key: str, table: Any) -> list[str]:
    """Lines of numbers that read back exactly."""
    return [f"{key} " + " ".join(map(repr, row)) for row in table.astype(np.float64).tolist()]
