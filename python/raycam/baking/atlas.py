"""Texture coordinates for meshes without any."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, one_of
from ..errors import Notice, SettingsError, WorldError
from ..notices import warn
from ..world.face_geometry import face_areas
from ..world.object_mesh import ObjectMesh
from .gutters import GUTTER

__all__ = ["ATLASES", "Atlas", "mesh_with_atlas"]

Atlas = Literal["xatlas", "cells"]
ATLASES = ("xatlas", "cells")
"""The kinds of atlases."""
MIN_CELL_TEXELS = 4
"""Side length, in texels, of a cell that contains two triangles."""
CELL_GAP_TEXELS = 1.0
"""Width of the gap between the two triangles of a cell, and between the triangles and the cell's edge."""


def mesh_with_atlas(mesh: ObjectMesh, atlas: Atlas, size: int) -> ObjectMesh:
    """Returns the mesh with an atlas of `size` x `size` texels as its only texture coordinates.

    "xatlas" unwraps the mesh into charts with the library xatlas. "cells" places each pair of triangles in its own
    square cell, which works for every mesh, but makes each edge a seam. A notice reports faces without texels.

    Raises `SettingsError` if `atlas` has another value, if xatlas is not installed, or if the cells would have fewer
    than 4 x 4 texels. Raises `WorldError` if the charts of xatlas do not fit into `size`.
    """
    one_of("atlas", atlas, ATLASES)
    uvs = _unwrapped(mesh.corners, size) if atlas == "xatlas" else cells(mesh.faces, size)
    a, b = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
    flat = (np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) == 0) & (face_areas(mesh.corners) > 0)
    if flat.any():
        warn(
            Notice(
                f"{int(flat.sum())} of {mesh.faces} faces have no texels, because xatlas did not unwrap them; "
                'atlas="cells" unwraps all faces',
                "faces_without_texels",
            )
        )
    return replace(mesh, uvs=(uvs.astype(np.float32),))


def _unwrapped(corners: Floats, size: int) -> Floats:
    """The texture coordinates [f, 3, 2] that xatlas finds (Young 2018, after thekla_atlas)."""
    try:
        import xatlas
    except ImportError as error:
        raise SettingsError(
            f"unwrapping requires xatlas ({error}); pip install 'raycam[atlas]', or use atlas=\"cells\"",
            code="missing_dependency",
        ) from None
    positions, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    middle = (positions.min(axis=0) + positions.max(axis=0)) / 2
    scale = max(float(np.ptp(positions, axis=0).max()), 1e-300)
    unwrapped = xatlas.Atlas()
    unwrapped.add_mesh(
        ((positions - middle) / scale).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32)
    )
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding = size, min(GUTTER, max(1, size // 256))
    packing.bilinear = True
    unwrapped.generate(xatlas.ChartOptions(), packing)
    if unwrapped.atlas_count != 1:
        raise WorldError(
            f"the atlas of {size} x {size} texels is too small for the mesh's charts; use a larger size",
            code="too_large",
        )
    _, indices, uvs = unwrapped[0]
    found: Floats = np.asarray(uvs, np.float64)[np.asarray(indices, np.int64)]
    return found


def cells(faces: int, size: int) -> npt.NDArray[np.float64]:
    """Texture coordinates [faces, 3, 2] of right-angled triangles, two in each cell of a grid."""
    side = int(np.ceil(np.sqrt(-(-faces // 2))))
    width = size // side
    if width < MIN_CELL_TEXELS:
        raise SettingsError(
            f"an atlas of {size} x {size} texels is too small for cells of {faces} faces; use "
            f'size={MIN_CELL_TEXELS * side} or more, or atlas="xatlas"',
            code="out_of_range",
        )
    number = np.arange(faces)
    corner = np.stack([number // 2 % side, number // 2 // side], axis=1) * width
    low, high = CELL_GAP_TEXELS / 2, width - CELL_GAP_TEXELS / 2
    near = high - 1.5 * CELL_GAP_TEXELS
    lower = np.array([[low, low], [near, low], [low, near]])
    upper = np.array([[high, high], [width - near, high], [high, width - near]])
    placed = np.where((number % 2 == 0)[:, None, None], lower, upper) + corner[:, None, :]
    found: npt.NDArray[np.float64] = placed / size
    return found
