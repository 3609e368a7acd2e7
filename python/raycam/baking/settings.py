"""Arguments of `bake`."""

from __future__ import annotations

from dataclasses import dataclass

from .light import LIGHT_MAPS
from .surface_points import MATERIAL_MAPS

__all__ = ["ID_MAPS", "MAPS", "SCALARS", "BakeSettings"]

ID_MAPS = ("instance", "material", "triangle")
"""Names of the maps that contain ids."""
MAPS = (
    *(
        "position",
        "normal",
        "shading_normal",
        "tangent_normal",
        "ao",
        "bent_normal",
        "thickness",
        "curvature",
    ),
    *LIGHT_MAPS,
    *MATERIAL_MAPS,
    *ID_MAPS,
)
"""The maps that `bake` supports."""
SCALARS = ("ao", "thickness", "curvature", "roughness", "metallic", *ID_MAPS)
"""Maps with one value for each texel."""


@dataclass(frozen=True)
class BakeSettings:
    """Checked arguments of `bake`."""

    number: int
    """The object's id."""
    maps: list[str]
    samples: int
    reach: float
    """The length of occlusion rays in metres."""
    cone: float
    """Opening angle of the rays of `thickness`, radians."""
    cage: float
    """Distance within which a source is searched for, metres."""
    green_down: bool
    """True if green of `tangent_normal` points down the image."""
    max_depth: int | None
    """Maximum number of segments of a light path; None for no limit."""
    threads: int | None
