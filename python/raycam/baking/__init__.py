"""Baking: properties of a surface stored in textures."""

from .maps import MAPS, BakedMaps, bake

__all__ = ["MAPS", "BakedMaps", "bake"]
