"""Primitives of pyrender: triangles or points with a material."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .colors import format_color_array
from .constants import GLTF
from .material import Material, MetallicRoughnessMaterial

__all__ = ["Primitive"]

Floats = npt.NDArray[Any]


class Primitive:
    """Triangles (`mode` 4) or points (0) of one material, shown once or at each of `poses` [n, 4, 4]."""

    def __init__(
        self,
        positions: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        tangents: Any = None,
        texcoord_0: npt.ArrayLike | None = None,
        texcoord_1: Any = None,
        color_0: npt.ArrayLike | None = None,
        joints_0: Any = None,
        weights_0: Any = None,
        indices: npt.ArrayLike | None = None,
        material: Material | None = None,
        mode: int | None = None,
        targets: Any = None,
        poses: npt.ArrayLike | None = None,
    ) -> None:
        if targets is not None or joints_0 is not None:
            raise NotImplementedError(
                "morph targets and joints: bend the vertices, then make a Primitive of them"
            )
        self.mode = GLTF.TRIANGLES if mode is None else mode
        if self.mode not in (GLTF.TRIANGLES, GLTF.POINTS):
            raise NotImplementedError(f"primitives of mode {mode}: triangles (4) and points (0) are rendered")
        self.positions = np.ascontiguousarray(positions, dtype=np.float64)
        self.normals = None if normals is None else np.asarray(normals, dtype=np.float64)
        self.tangents, self.texcoord_1 = tangents, texcoord_1
        self.texcoord_0 = None if texcoord_0 is None else np.asarray(texcoord_0, dtype=np.float64)
        self.color_0 = None if color_0 is None else format_color_array(color_0, (len(self.positions), 4))
        self.indices = None if indices is None else np.asarray(indices, dtype=np.int64)
        shown = MetallicRoughnessMaterial(
            alphaMode="BLEND",
            baseColorFactor=[0.3, 0.3, 0.3, 1.0] if color_0 is None else [1.0, 1.0, 1.0, 1.0],
            metallicFactor=0.2,
            roughnessFactor=0.8,
        )
        self.material = shown if material is None else material
        self.poses = None if poses is None else np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4)

    @property
    def faces(self) -> npt.NDArray[np.int64]:
        """The corners [m, 3] of its triangles."""
        if self.indices is None:
            return np.arange(len(self.positions)).reshape(-1, 3)
        return self.indices.reshape(-1, 3)

    @property
    def places(self) -> Floats:
        """The poses [n, 4, 4] at which it is shown."""
        return np.eye(4)[np.newaxis] if self.poses is None else self.poses

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3] around all its poses."""
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        corners = np.array(
            [[x, y, z, 1] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        )
        placed = np.concatenate([corners @ place.T for place in self.places])[:, :3]
        return np.stack([placed.min(axis=0), placed.max(axis=0)])

    @property
    def is_transparent(self) -> bool:
        """True if what is behind it may show."""
        return self.material.alphaMode == "BLEND"
