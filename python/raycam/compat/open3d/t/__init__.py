"""Replacement for `open3d.t`: ray casting, and meshes of tensors."""

from typing import Any

from ..absent import raise_missing
from . import geometry, io

__all__ = ["geometry", "io"]


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.t", name, "install Open3D")
