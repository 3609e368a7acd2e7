"""Replacement for Open3D's ray casting and distance queries.

Usage: `from raycam.compat import open3d as o3d`.

`o3d.t.geometry.RaycastingScene` has Open3D's interface and returns tensors that are NumPy arrays with Open3D's
methods. `install()` replaces the class in an installed Open3D, where it returns Open3D's tensors. Hits are computed
exactly in float64 and rounded once. Intersections are sorted by t. Overlapping bodies count as their union.
"""

from __future__ import annotations

import importlib
from typing import Any

from . import core, geometry, io, t, utility
from .absent import raise_missing
from .t.geometry import RaycastingScene

__all__ = ["core", "geometry", "install", "io", "t", "uninstall", "utility"]

__version__ = "0.19.0"
"""The Open3D version whose interface this module implements."""
_originals: dict[str, Any] = {}


def install() -> None:
    """Replaces Open3D's `RaycastingScene`; existing scenes are not changed."""
    open3d = importlib.import_module("open3d")
    if _originals:
        return
    _originals["RaycastingScene"] = open3d.t.geometry.RaycastingScene

    class InstalledScene(RaycastingScene):
        """Scene whose results are Open3D's tensors."""

        @staticmethod
        def _tensor(array: Any) -> Any:
            return open3d.core.Tensor(array)

    InstalledScene.__name__ = InstalledScene.__qualname__ = "RaycastingScene"
    open3d.t.geometry.RaycastingScene = InstalledScene


def uninstall() -> None:
    """Undoes `install`."""
    if _originals:
        importlib.import_module("open3d").t.geometry.RaycastingScene = _originals.pop("RaycastingScene")


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d", name, "install Open3D")
