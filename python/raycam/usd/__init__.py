"""USD files, read by Pixar's library in a separate process: the `raycam[usd]` extra."""

from .read import SUFFIXES, UsdLimits, read

__all__ = ["SUFFIXES", "UsdLimits", "read"]
