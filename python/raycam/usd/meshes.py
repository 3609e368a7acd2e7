"""Meshes and solids of USD as OBJ files. Source: the schema `UsdGeomMesh`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade

from .gprims import GPRIMS, Faces, gprim_faces
from .materials import Materials

__all__ = ["Meshes", "rows"]


def rows(matrix: Gf.Matrix4d) -> list[list[float]]:
    """The matrix for column vectors, as raycam uses them; USD's matrices are for row vectors."""
    return np.array(matrix).T.tolist()  # type: ignore[no-any-return]


class Meshes:
    """The meshes of a stage as OBJ files in a folder; a mesh that instances share is written once."""

    def __init__(self, folder: Path, materials: Materials, max_corners: int) -> None:
        self.notices: list[str] = []
        self._folder = folder
        self._materials = materials
        self._left = max_corners
        self._known: dict[tuple[str, ...], tuple[str | None, int]] = {}

    def file(self, mesh: UsdGeom.Gprim) -> str | None:
        """The name of the mesh's OBJ file; None for a mesh without faces."""
        prim = mesh.GetPrim()
        own = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        bound = _bound(prim)
        key = (own.GetPath().pathString, bound.GetPath().pathString if bound else "")
        if key not in self._known:
            self._known[key] = self._write(mesh, bound)
        name, corners = self._known[key]
        self._left -= corners
        if self._left < 0:
            raise MemoryError
        return name

    def _write(self, mesh: UsdGeom.Gprim, bound: UsdShade.Material | None) -> tuple[str | None, int]:
        prim, path = mesh.GetPrim(), mesh.GetPath().pathString
        is_solid = prim.GetTypeName() in GPRIMS
        found = gprim_faces(prim) if is_solid else _faces(UsdGeom.Mesh(prim))
        points, counts, indices = found.points, found.counts, found.indices
        if fault := _fault(found):
            self.notices.append(f"{'solid' if is_solid else 'mesh'} {path} is left out: {fault}")
            return None, 0
        time = Usd.TimeCode.EarliestTime()
        subdivided = not is_solid and UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get(time) != "none"
        if subdivided:
            self.notices.append(
                f"mesh {path}: a subdivision surface, shown as the mesh that it starts from, smooth"
            )
        lines = ["mtllib materials.mtl"]
        colors, color = self._colors(mesh, bound, len(points), counts, indices)
        # Colours per corner need separate vertices, which a smooth surface cannot have.
        apart = colors is not None and len(colors) != len(points)
        if apart and subdivided:
            self.notices.append(f"mesh {path}: colours for each face or corner are not used")
            colors, apart = None, False
        if apart:
            points, position = points[indices], np.arange(len(indices)) + 1
        else:
            position = indices + 1
        lines.extend(_numbers("v", points if colors is None else np.hstack([points, colors])))
        uvs = self._corners(mesh, self._materials.primvar(bound), counts, indices)
        normals = found.normals
        if not subdivided and not is_solid:
            normals = self._corners(mesh, "normals", counts, indices)
            own = UsdGeom.Mesh(prim).GetNormalsAttr().Get(time)
            if normals is None and own:
                interpolation = UsdGeom.Mesh(prim).GetNormalsInterpolation()
                normals = _spread(np.array(own, np.float32), interpolation, counts, indices)
        vt, vn = np.arange(len(indices)) + 1, np.arange(len(indices)) + 1
        for key, table in (("vt", uvs), ("vn", normals)):
            if table is not None:
                kept, back = np.unique(table, axis=0, return_inverse=True)
                lines.extend(_numbers(key, kept))
                if key == "vt":
                    vt = back.reshape(-1) + 1
                else:
                    vn = back.reshape(-1) + 1
        if uvs is None and normals is None:
            words = position.astype(str).tolist()
        else:
            parts = [position.tolist(), vt.tolist() if uvs is not None else [""] * len(indices)]
            parts.extend([vn.tolist()] if normals is not None else [])
            words = ["/".join(map(str, corner)) for corner in zip(*parts, strict=True)]
        lines.append("s 1" if subdivided else "s off")
        turn = -1 if mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded else 1
        ends = np.cumsum(counts)
        holes = set() if is_solid else set(UsdGeom.Mesh(prim).GetHoleIndicesAttr().Get(time) or [])
        for name, faces in self._groups(mesh, color, len(counts)):
            lines.append(f"usemtl {name}")
            for face in faces:
                if face not in holes:
                    lines.append("f " + " ".join(words[ends[face] - counts[face] : ends[face]][::turn]))
        file = f"mesh{len(self._known)}.obj"
        (self._folder / file).write_text("\n".join([*lines, ""]), encoding="utf-8")
        return file, len(indices)

    def _groups(self, mesh: UsdGeom.Gprim, color: str, count: int) -> list[tuple[str, Any]]:
        """The faces of each material, by name."""
        rest = np.ones(count, bool)
        groups = []
        for subset in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets():
            faces = np.array(subset.GetIndicesAttr().Get(Usd.TimeCode.EarliestTime()) or [], np.int64)
            faces = faces[(faces >= 0) & (faces < count)]
            faces = faces[rest[faces]]
            rest[faces] = False
            if (material := _bound(subset.GetPrim())) is not None:
                groups.append((self._materials.name(material), faces.tolist()))
            else:
                rest[faces] = True
        if rest.any():
            groups.insert(0, (color, np.flatnonzero(rest).tolist()))
        return groups

    def _colors(
        self, mesh: UsdGeom.Gprim, bound: UsdShade.Material | None, count: int, counts: Any, indices: Any
    ) -> tuple[Any, str]:
        """The sRGB colours of points or corners as in an OBJ file, and the material."""
        time = Usd.TimeCode.EarliestTime()
        if bound:
            return None, self._materials.name(bound)
        found = UsdGeom.PrimvarsAPI(mesh)
        colors, opacity = (
            found.FindPrimvarWithInheritance(f"display{name}") for name in ("Color", "Opacity")
        )
        opacities = opacity.ComputeFlattened(time) if opacity else None
        clear = float(min(max(opacities[0], 0.0), 1.0)) if opacities else 1.0
        if opacities and any(value != opacities[0] for value in opacities):
            self.notices.append(f"mesh {mesh.GetPath()}: opacities that differ are not used")
            clear = 1.0
        values = colors.ComputeFlattened(time) if colors else None
        if not values:
            return None, self._materials.plain((0.8, 0.8, 0.8), clear)
        table = np.clip(np.array(values, np.float64).reshape(-1, 3), 0, 1)
        if len(table) == 1:
            return None, self._materials.plain(tuple(table[0].tolist()), clear)
        srgb = np.where(table <= 0.0031308, 12.92 * table, 1.055 * table ** (1 / 2.4) - 0.055)
        white = self._materials.plain((1.0, 1.0, 1.0), clear)
        if colors.GetInterpolation() in ("vertex", "varying") and len(srgb) == count:
            return srgb, white
        spread = _spread(srgb, colors.GetInterpolation(), counts, indices)
        if spread is None:
            self.notices.append(f"mesh {mesh.GetPath()}: {len(table)} colours do not fit it and are not used")
        return spread, white

    def _corners(self, mesh: UsdGeom.Gprim, name: str, counts: Any, indices: Any) -> Any:
        """The values of a primvar at every corner."""
        primvar = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance(name)
        values = primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()) if primvar else None
        if values is None or not len(values):
            return None
        table = np.array(values, np.float32)
        found = _spread(table, primvar.GetInterpolation(), counts, indices) if table.ndim == 2 else None
        if found is None or not np.isfinite(found).all():
            self.notices.append(
                f"mesh {mesh.GetPath()}: {len(table)} values of {name} do not fit it and are not used"
            )
            return None
        return found


def _faces(mesh: UsdGeom.Mesh) -> Faces:
    """The faces of a mesh as stored in the file."""
    time = Usd.TimeCode.EarliestTime()
    points = np.array(mesh.GetPointsAttr().Get(time) or [], np.float32).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or [], np.int64)
    return Faces(points, counts, np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or [], np.int64))


def _fault(found: Faces) -> str | None:
    """The error message for invalid faces; None for valid ones."""
    points, counts, indices = found.points, found.counts, found.indices
    if (counts < 3).any() or counts.sum() != len(indices):
        return f"its faces have {counts.sum()} corners, it has {len(indices)}"
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        return f"a corner is none of its {len(points)} points"
    if not np.isfinite(points).all():
        return "a point is not finite"
    return None if len(indices) else "it has no faces"


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


def _bound(prim: Usd.Prim) -> UsdShade.Material | None:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    return material if material else None


def _numbers(key: str, table: Any) -> list[str]:
    """Lines of numbers that read back exactly."""
    return [f"{key} " + " ".join(map(repr, row)) for row in table.astype(np.float64).tolist()]
