"""The tensor side of Open3D."""

from . import geometry

__all__ = ["geometry"]
