"""USD files, read by OpenUSD in a separate process: the `raycam[usd]` extra."""

from .read import SUFFIXES, StageContents, UsdLimits, read

__all__ = ["SUFFIXES", "StageContents", "UsdLimits", "read"]
