"""Rigs: several cameras on one moving body."""

from .rig import Rig

__all__ = ["Rig"]
