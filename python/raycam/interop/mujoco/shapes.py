"""The shapes of a MuJoCo model's geoms as meshes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...world import World
from ...world.capsule import capsule_mesh
from .materials import element_look, is_opaque
from .model import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    GEOM_OBJECT,
    HFIELD,
    MESH,
    PLANE,
    SDF,
    SPHERE,
    element_prefix,
)
from .primitives import textured_primitive
from .textures import color_texture, is_cube, map_cube, planar_coordinates

__all__ = ["Shape", "covered_geoms", "element_shape", "primitive_shape", "with_texture"]

INFINITE_PLANE = 100.0
"""Half the side length, in metres, of planes of size 0, which MuJoCo extends to the horizon."""
CREASE = 0.8
"""MuJoCo shades a corner flat if the cosine between its normal and the triangle's normal is lower
(`mjr_uploadMesh`)."""
KEPT_IN_METRES = (PLANE, HFIELD, MESH, SDF)
"""Geoms whose vertices MuJoCo keeps in metres; the vertices of other geoms are in units of the geom's size."""


@dataclass
class Shape:
    """A shape in the geom's frame."""

    keys: dict[str, Any]
    """Keys of an object."""
    uvs: Floats | None = None
    """The mesh's own texture coordinates [t, 3, 2], if the model contains any."""


def element_shape(model: Any, element: int, number: int) -> Shape | None:
    """Returns the shape of a geom or site; None for kinds that are not shown."""
    kind, size = _kind_and_size(model, element, number)
    data = int(model.geom_dataid[number]) if element == GEOM_OBJECT else -1
    if kind == HFIELD:
        vertices, faces = _height_field(model, data)
        return Shape({"vertices": vertices, "triangles": faces})
    if kind in (MESH, SDF) and data >= 0:
        return _mesh(model, data)
    return primitive_shape(kind, size)


def primitive_shape(kind: int, size: Floats) -> Shape | None:
    """Returns the shape of a primitive geom with `mjModel.geom_size` [3]; None for other kinds."""
    if kind == PLANE:
        sides = [2 * (half if half > 0 else INFINITE_PLANE) for half in size[:2]]
        return Shape({"plane": {"size": sides}})
    if kind == SPHERE:
        return Shape({"sphere": {"radius": size[0]}})
    if kind == ELLIPSOID:
        # Exact rays take much longer if the matrix of an object is a strongly uneven scale.
        points, faces = _unit_sphere()
        normals = points * (size.min() / size)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return Shape({"vertices": points * size, "triangles": faces, "normals": normals})
    if kind == BOX:
        return Shape({"box": {"size": (2 * size).tolist()}})
    if kind == CYLINDER:
        return Shape({"cylinder": {"radius": size[0], "height": 2 * size[1]}})
    if kind == CAPSULE:
        vertices, faces, normals = capsule_mesh(size[0], 2 * size[1])
        return Shape({"vertices": vertices, "triangles": faces, "normals": normals})
    return None


@cache
def _unit_sphere() -> tuple[Floats, npt.NDArray[np.intp]]:
    """The vertices [n, 3] and triangles [t, 3] of raycam's sphere with the radius 1."""
    world = World()
    world.add_object(sphere={"radius": 1.0})
    points, faces = np.unique(world.triangles(0).reshape(-1, 3), axis=0, return_inverse=True)
    return points, faces.reshape(-1, 3)


def covered_geoms(model: Any, groups: tuple[int, ...]) -> list[int]:
    """Returns the opaque geoms of `groups` that a later opaque geom repeats.

    The later geom has the same body, shape and pose.
    """
    last: dict[tuple[Any, ...], int] = {}
    covered = []
    for geom in range(model.ngeom):
        if model.geom_group[geom] not in groups or not is_opaque(element_look(model, GEOM_OBJECT, geom)[0]):
            continue
        arrays = (model.geom_size[geom], model.geom_pos[geom], model.geom_quat[geom])
        key = (
            int(model.geom_bodyid[geom]),
            int(model.geom_type[geom]),
            _shape_data(model, geom),
            *(np.asarray(array).tobytes() for array in arrays),
        )
        if key in last:
            covered.append(last[key])
        last[key] = geom
    return covered


def _shape_data(model: Any, geom: int) -> Any:
    """Returns a value that is equal for geoms with equal meshes.

    The meshes may be separate meshes of the model. For height fields, the value is the height field's number.
    """
    data = int(model.geom_dataid[geom])
    if int(model.geom_type[geom]) not in (MESH, SDF) or data < 0:
        return data
    vertices = _rows(model.mesh_vert, model.mesh_vertadr[data], model.mesh_vertnum[data])
    faces = _rows(model.mesh_face, model.mesh_faceadr[data], model.mesh_facenum[data])
    return sha256(vertices.tobytes()).digest(), sha256(faces.tobytes()).digest()


def with_texture(model: Any, element: int, number: int, shape: Shape, material: int) -> Shape:
    """Returns the shape with texture coordinates for its material's texture.

    A shape whose material has no texture is returned unchanged.
    """
    texture = color_texture(model, material)
    if texture < 0:
        return shape
    kind, size = _kind_and_size(model, element, number)
    scale = _half_sizes(kind, size)
    uniform, repeat = (
        bool(model.mat_texuniform[material]),
        np.asarray(model.mat_texrepeat[material], np.float64),
    )
    endless = kind == PLANE and (scale[:2] == 0).any()
    corners, normals, uvs = _own_coordinates(kind, size, shape, endless)
    if is_cube(model, texture):
        factors = scale if uniform else np.ones(3)
        if kind not in KEPT_IN_METRES:
            factors = factors / np.maximum(scale, 1e-15)
        corners, uvs, source, weights = map_cube(corners, factors, int(model.tex_width[texture]))
        normals = normals if normals is None else np.einsum("mkj,mjc->mkc", weights, normals[source])
    elif uvs is not None:
        uvs = uvs * repeat * (scale[:2] if uniform else 1.0)
    else:
        uvs = planar_coordinates(corners, repeat, scale[:2], uniform)
    keys: dict[str, Any] = {
        "vertices": corners.reshape(-1, 3),
        "triangles": np.arange(3 * len(corners)).reshape(-1, 3),
        "uvs": uvs.reshape(-1, 2),
    }
    if normals is not None:
        keys["normals"] = normals.reshape(-1, 3)
    return Shape(keys)


def _own_coordinates(
    kind: int, size: Floats, shape: Shape, endless: bool
) -> tuple[Floats, Floats | None, Floats | None]:
    """Returns the corners [t, 3, 3], normals and own texture coordinates of a shape.

    Normals and texture coordinates are None if the shape has none.
    """
    if kind not in (HFIELD, MESH, SDF) and not endless:
        return textured_primitive(kind, size)
    if kind == PLANE:
        half = [0.5 * side for side in shape.keys["plane"]["size"]]
        return textured_primitive(kind, np.array([*half, 0.0]))[0], None, None
    faces, normals = shape.keys["triangles"], shape.keys.get("normals")
    return shape.keys["vertices"][faces], None if normals is None else normals[faces], shape.uvs


def _kind_and_size(model: Any, element: int, number: int) -> tuple[int, Floats]:
    """The `mjtGeom` and the sizes [3] of a geom or site."""
    prefix = element_prefix(element)
    size = np.asarray(getattr(model, f"{prefix}_size")[number], np.float64)
    return int(getattr(model, f"{prefix}_type")[number]), size


def _half_sizes(kind: int, size: Floats) -> Floats:
    """Returns half the sizes [3] of a shape as in MuJoCo's visualizer (`mjvGeom.size`).

    The sizes of infinite planes are 0.
    """
    if kind == SPHERE:
        return np.full(3, size[0])
    if kind in (CAPSULE, CYLINDER):
        return np.array([size[0], size[0], size[1]])
    return size


def _mesh(model: Any, mesh: int) -> Shape:
    """A mesh with MuJoCo's normals and texture coordinates, which have indices of their own."""
    vertices = _rows(model.mesh_vert, model.mesh_vertadr[mesh], model.mesh_vertnum[mesh])
    start, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    faces = np.asarray(model.mesh_face[start : start + count], np.int64)
    normals = _rows(model.mesh_normal, model.mesh_normaladr[mesh], model.mesh_normalnum[mesh])
    normal_faces = np.asarray(model.mesh_facenormal[start : start + count], np.int64)
    coordinates, coordinate_faces = None, faces
    if int(model.mesh_texcoordadr[mesh]) >= 0:
        coordinates = _rows(model.mesh_texcoord, model.mesh_texcoordadr[mesh], model.mesh_texcoordnum[mesh])
        coordinate_faces = np.asarray(model.mesh_facetexcoord[start : start + count], np.int64)
    if coordinates is None:
        return Shape(_with_creases(vertices[faces], normals[normal_faces]))
    pairs = np.stack([faces, normal_faces, coordinate_faces], axis=2).reshape(-1, 3)
    unique, where = np.unique(pairs, axis=0, return_inverse=True)
    keys: dict[str, Any] = {
        "vertices": vertices[unique[:, 0]],
        "triangles": where.reshape(-1, 3),
        "normals": normals[unique[:, 1]],
        "uvs": coordinates[unique[:, 2]],
    }
    return Shape(keys, uvs=coordinates[coordinate_faces])


def _with_creases(corners: Floats, normals: Floats) -> dict[str, Any]:
    """Returns the keys of a mesh with creases, as in MuJoCo.

    A vertex normal that differs much from the triangle's normal is replaced with the triangle's normal.
    """
    edges = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    near = np.einsum("tkc,tc->tk", normals, flat) >= CREASE
    chosen = np.where(near[:, :, None], normals, flat[:, None]).reshape(-1, 3)
    chosen[np.linalg.norm(chosen, axis=1) == 0] = [0.0, 0.0, 1.0]
    pairs = np.concatenate([corners.reshape(-1, 3), chosen], axis=1)
    unique, where = np.unique(pairs, axis=0, return_inverse=True)
    return {"vertices": unique[:, :3], "triangles": where.reshape(-1, 3), "normals": unique[:, 3:]}


def _rows(array: Any, start: Any, count: Any) -> Floats:
    return np.asarray(array[int(start) : int(start) + int(count)], np.float64)


def _height_field(model: Any, field: int) -> tuple[Floats, Any]:
    """Returns a height field as a closed solid.

    The solid consists of the surface, split as in `mj_ray`, and of walls down to the height field's base.
    """
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    start = int(model.hfield_adr[field])
    x_size, y_size, height, base = np.asarray(model.hfield_size[field], np.float64)
    heights = np.asarray(model.hfield_data[start : start + rows * columns], np.float64) * height
    y, x = np.meshgrid(
        np.linspace(-y_size, y_size, rows), np.linspace(-x_size, x_size, columns), indexing="ij"
    )
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    second = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    top = np.stack([x.ravel(), y.ravel(), heights], axis=1)
    grid = np.arange(rows * columns).reshape(rows, columns)
    border = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    bottom = top[border] * [1, 1, 0] - [0, 0, base]
    lower = len(top) + np.arange(len(border))
    after, lower_after = np.roll(border, -1), np.roll(lower, -1)
    walls = [np.stack([lower, lower_after, after], axis=1), np.stack([lower, after, border], axis=1)]
    middle = np.full(len(border), len(top) + len(border))
    floor = np.stack([lower_after, lower, middle], axis=1)
    vertices = np.concatenate([top, bottom, [[0.0, 0.0, -base]]])
    return vertices, np.concatenate([first, second, *walls, floor])
