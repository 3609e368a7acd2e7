"""Photographs and surfaces: the ground truth of posed photographs, visibility, and textures."""

from .truth import named_photographs, photo_truth

__all__ = ["named_photographs", "photo_truth"]
