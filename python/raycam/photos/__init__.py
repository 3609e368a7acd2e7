"""Photographs and surfaces: the ground truth of posed photographs, visibility, and textures."""

from .coverage import coverage_picture, coverage_world
from .photograph_fit import PhotographFit
from .surface_samples import SurfaceSamples, sample_surface
from .texture import texture_from_photos
from .texture_result import PhotoTexture
from .truth import named_photographs, photo_truth
from .visibility import FacePairs, SurfaceVisibility, surface_visibility

__all__ = [
    "FacePairs",
    "PhotoTexture",
    "PhotographFit",
    "SurfaceSamples",
    "SurfaceVisibility",
    "coverage_picture",
    "coverage_world",
    "named_photographs",
    "photo_truth",
    "sample_surface",
    "surface_visibility",
    "texture_from_photos",
]
