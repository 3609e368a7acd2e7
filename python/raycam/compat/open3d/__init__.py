"""Stand-in for the part of Open3D that casts rays and measures distances: `from raycam.compat import open3d as o3d`.

`o3d.t.geometry.RaycastingScene` answers as Open3D's, in tensors that are NumPy arrays with Open3D's methods.
`install()` puts it into an Open3D that is there, where it answers in Open3D's tensors. Answers are computed exactly
in float64 and rounded once; lists are in the order of t; overlapping bodies are united.
"""

from __future__ import annotations

import importlib
from typing import Any

from . import core, geometry, io, t, utility
from .absent import raise_missing
from .t.geometry import RaycastingScene

__all__ = ["core", "geometry", "install", "io", "t", "uninstall", "utility"]

_originals: dict[str, Any] = {}


def install() -> None:
    """Puts `RaycastingScene` in the place of Open3D's; scenes made before stay as they are."""
    open3d = importlib.import_module("open3d")
    if _originals:
        return
    _originals["RaycastingScene"] = open3d.t.geometry.RaycastingScene

    class InstalledScene(RaycastingScene):
        """Scene that answers in Open3D's tensors."""

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
    """Raises `AttributeError` with an alternative."""
    return raise_missing("open3d", name, "install Open3D for it")
