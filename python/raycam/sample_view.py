"""Former name of `raycam.randomize.views`, kept for one release."""

from __future__ import annotations

from .randomize.views import place_camera as see

__all__ = ["see"]
