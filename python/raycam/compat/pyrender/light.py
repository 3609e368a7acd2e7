"""Lights of pyrender, which emit along -z of their node."""

from __future__ import annotations

from typing import Any

import numpy as np

from .colors import format_color_vector
from .values import Converted, number, text

__all__ = ["DirectionalLight", "Light", "PointLight", "SpotLight"]


class Light:
    """A light with a colour and an intensity."""

    name = Converted(text)
    color = Converted(lambda value: _color(value))
    intensity = Converted(number("intensity"))

    def __init__(self, color: Any = None, intensity: float | None = None, name: str | None = None) -> None:
        self.name = name
        self.color = 1.0 if color is None else color
        self.intensity = 1.0 if intensity is None else intensity

    @property
    def shadow_texture(self) -> None:
        """None, because shadows are computed with rays."""
        return None


class DirectionalLight(Light):
    """A directional light; its intensity is the irradiance."""


class PointLight(Light):
    """A point light whose irradiance decreases with the square of the distance.

    `range` has no effect, as in pyrender.
    """

    range = Converted(number("range", 0, above=True, optional=True))

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
    """A point light with a cone, whose angles from the axis are in radians."""

    innerConeAngle = Converted(number("innerConeAngle"))
    outerConeAngle = Converted(number("outerConeAngle"))

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
        self.innerConeAngle, self.outerConeAngle = innerConeAngle, outerConeAngle

    def _check_values(self) -> None:
        """Raises `ValueError` if the inner angle exceeds the outer angle.

        This method is called after each assignment.
        """
        inner, outer = self.__dict__.get("_innerConeAngle"), self.__dict__.get("_outerConeAngle")
        if inner is not None and outer is not None and not 0 <= inner <= outer <= np.pi / 2 + 1e-9:
            raise ValueError(f"cone angles {inner} and {outer}: expected 0 <= inner <= outer <= pi / 2")


def _color(value: Any) -> Any:
    """A colour [3], float32; raises `ValueError` for None, as in pyrender."""
    if value is None:
        raise ValueError("color is None: expected one number or a list of 3")
    return format_color_vector(value, 3)
