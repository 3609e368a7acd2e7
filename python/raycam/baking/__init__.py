"""Baking: maps of a surface in textures."""

from .maps import MAPS, BakedMaps, bake

__all__ = ["MAPS", "BakedMaps", "bake"]
