"""Lights of pyrender: they shine along -z of their node."""

from __future__ import annotations

from typing import Any

import numpy as np

from .colors import format_color_vector

__all__ = ["DirectionalLight", "Light", "PointLight", "SpotLight"]


class Light:
    """A light of a colour and an intensity."""

    def __init__(self, color: Any = None, intensity: float | None = None, name: str | None = None) -> None:
        self.name = name
        self.color = color
        self.intensity = 1.0 if intensity is None else float(intensity)

    @property
    def color(self) -> Any:
        """The colour [3], float32."""
        return self._color

    @color.setter
    def color(self, value: Any) -> None:
        self._color = format_color_vector(1.0 if value is None else value, 3)


class DirectionalLight(Light):
    """Light from far away; the intensity is its irradiance."""


class PointLight(Light):
    """A point that shines to all sides and falls off by the square of the distance; `range` has no effect, as there."""

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
        self.innerConeAngle, self.outerConeAngle = float(innerConeAngle), float(outerConeAngle)
