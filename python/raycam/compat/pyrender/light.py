"""Lights of pyrender: they shine along -z of their node."""

from __future__ import annotations

from typing import Any

import numpy as np

from .colors import format_color_vector
from .values import Converted, number, text

__all__ = ["DirectionalLight", "Light", "PointLight", "SpotLight"]


class Light:
    """A light of a colour and an intensity."""

    name = Converted(text)
    color = Converted(lambda value: format_color_vector(1.0 if value is None else value, 3))
    intensity = Converted(lambda value: 1.0 if value is None else float(value))

    def __init__(self, color: Any = None, intensity: float | None = None, name: str | None = None) -> None:
        self.name, self.color, self.intensity = name, color, intensity

    @property
    def shadow_texture(self) -> None:
        """None: shadows are cast by rays."""
        return None


class DirectionalLight(Light):
    """Light from far away; the intensity is its irradiance."""


class PointLight(Light):
    """A point that shines to all sides and falls off by the square of the distance; `range` has no effect, as there."""

    range = Converted(number("range", 0, above=True))

    def __init__(
        self,
        color: Any = None,
        intensity: float | None = None,
        range: float | None = None,
        name: str | None = None,
    ) -> None:
        super().__init__(color, intensity, name)
        self.range = range


class SpotLight(PointLight):
    """A point that shines into a cone, with the angles from its axis in radians."""

    innerConeAngle, outerConeAngle = Converted(float), Converted(float)

    def __init__(
        self,
        color: Any = None,
        intensity: float | None = None,
        range: float | None = None,
        innerConeAngle: float = 0.0,
        outerConeAngle: float = np.pi / 4,
        name: str | None = None,
    ) -> None:
        super().__init__(color, intensity, range, name)
        if not 0 <= innerConeAngle <= outerConeAngle <= np.pi / 2 + 1e-9:
            raise ValueError(
                f"cone angles {innerConeAngle} and {outerConeAngle}: expected 0 <= inner <= outer <= pi / 2"
            )
        self.innerConeAngle, self.outerConeAngle = innerConeAngle, outerConeAngle
