"""Baking: properties of a surface stored in textures or at vertices."""

from .baked_maps import BakedMaps
from .maps import bake
from .settings import MAPS

__all__ = ["MAPS", "BakedMaps", "bake"]
