"""Returned shares of surfaces, against the formulas of optics."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from raycam.lidar.surfaces import conductor_reflectance, dielectric_reflectance, read_surface


def test_dielectric_reflectance_at_normal_incidence_brewster_and_total_reflection() -> None:
    one = np.ones(1)
    assert dielectric_reflectance(one, one / 1.5)[0] == pytest.approx(0.04)
    brewster = math.cos(math.atan(1.5))
    across = ((1 - 1.5**2) / (1 + 1.5**2)) ** 2  # the parallel part vanishes
    assert dielectric_reflectance(np.array([brewster]), one / 1.5)[0] == pytest.approx(across / 2)
    assert dielectric_reflectance(np.array([math.cos(math.asin(0.9))]), one * 1.5)[0] == 1


@pytest.mark.parametrize("cosine", [1.0, 0.7, 0.2, 0.02])
@pytest.mark.parametrize("index", [0.15 + 3.5j, 1.4 + 7.6j, 2.9 + 3.1j])
def test_conductor_reflectance_equals_the_complex_fresnel_equations(cosine: float, index: complex) -> None:
    inner = cmath.sqrt(1 - (1 - cosine**2) / index**2)
    s = abs((cosine - index * inner) / (cosine + index * inner)) ** 2
    p = abs((index * cosine - inner) / (index * cosine + inner)) ** 2
    found = conductor_reflectance(np.array([cosine]), np.array([index.real]), np.array([index.imag]))
    assert found[0] == pytest.approx((s + p) / 2, rel=1e-9)


def test_unlit_surfaces_are_diffuse() -> None:
    surface = read_surface({"model": "Unlit", "opacity": 0.25, "alpha": "Blend"})
    assert (surface.kind, surface.diffuse, surface.opacity) == ("solid", 1.0, 0.25)
