"""Encodes depth and normals in files that other programs read.

The files are PFM images, COLMAP's maps and MVSNet's cameras.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...camera import Camera
from ..plan import k_with_integer_centers, matrix_text

__all__ = ["colmap_map", "mvsnet_camera", "npy", "pfm"]


def pfm(values: npt.NDArray[Any]) -> bytes:
    """Encodes [h, w] as a little-endian PFM, whose rows run upwards."""
    height, width = values.shape
    head = f"Pf\n{width} {height}\n-1.0\n".encode()
    return head + np.ascontiguousarray(values[::-1], dtype="<f4").tobytes()


def npy(values: npt.NDArray[Any]) -> bytes:
    """Encodes an array as NPY, version 1.0."""
    import io

    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ascontiguousarray(values), version=(1, 0), allow_pickle=False)
    return stream.getvalue()


def colmap_map(values: npt.NDArray[Any]) -> bytes:
    """Encodes an array [h, w] or [h, w, 3] as a map of COLMAP's dense reconstruction.

    The map has one plane per channel.

    Source: COLMAP, `mvs/mat.h` and `scripts/python/read_write_dense.py`.
    """
    planes = values[None] if values.ndim == 2 else np.moveaxis(values, 2, 0)
    channels, height, width = planes.shape
    return f"{width}&{height}&{channels}&".encode() + np.ascontiguousarray(planes, dtype="<f4").tobytes()


def mvsnet_camera(camera: Camera, nearest: float, farthest: float, planes: int) -> bytes:
    """Returns the text of `00000000_cam.txt`: camera_from_world, K, and the range of depths.

    The range consists of the minimum depth, the step, the number of depths, and the maximum depth.

    Source: MVSNet, "File formats"; BlendedMVS uses the same format with 128 planes.
    """
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = camera.R, camera.t
    step = (farthest - nearest) / max(planes - 1, 1)
    depths = np.array([nearest, step, planes, farthest])
    k = k_with_integer_centers(camera)
    return f"extrinsic\n{_rows(pose)}\nintrinsic\n{_rows(k)}\n{matrix_text(depths)}\n".encode()


def _rows(matrix: Floats) -> str:
    return "".join(matrix_text(row) + "\n" for row in matrix)
