"""Argoverse 2's sweeps: Apache Arrow tables in the Feather format.

Source: Argoverse 2 user guide, "Sensor Dataset", LiDAR sweeps.
"""

from __future__ import annotations

import importlib
import io
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import LidarError

__all__ = ["feather_bytes"]

LARGEST_COORDINATE = 65504.0
"""The largest float16, in metres."""


def feather_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a Feather file with a table of points.

    The table contains x, y, z (float16), intensity, laser_number (uint8), offset_ns (int32), and other
    fields.

    Raises `LidarError` without pyarrow, for coordinates beyond float16, and for more than 256 lasers.
    """
    try:
        arrow, feather = (importlib.import_module(name) for name in ("pyarrow", "pyarrow.feather"))
    except ImportError:
        raise LidarError(
            ".feather requires the package pyarrow: pip install 'raycam[feather]', or use .npz (same fields)",
            code="missing_dependency",
        ) from None
    position, laser = arrays["position"], arrays["laser"]
    if np.abs(position).max(initial=0.0) > LARGEST_COORDINATE:
        raise LidarError(
            f"coordinates reach {np.abs(position).max():g} m; .feather contains float16 and supports at most "
            f"{LARGEST_COORDINATE:g} m; use another format, such as .npz",
            code="cannot_write",
        )
    if laser.max(initial=0) > 255:
        raise LidarError(
            f"the lidar has {laser.max() + 1} lasers; .feather supports at most 256", code="cannot_write"
        )
    table: dict[str, Any] = {
        **{axis: position[:, i].astype(np.float16) for i, axis in enumerate("xyz")},
        "intensity": arrays["intensity"],
        "laser_number": laser.astype(np.uint8),
        "offset_ns": np.rint(arrays["time"] * 1e9).astype(np.int32),
    }
    for name, array in arrays.items():
        if name not in ("position", "intensity", "laser", "time"):
            table[name] = array if array.ndim == 1 else arrow.array(array.tolist())
    stream = io.BytesIO()
    feather.write_feather(arrow.table(table), stream, compression="uncompressed")
    return stream.getvalue()
