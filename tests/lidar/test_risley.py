"""Risley prisms. Expected values: the deviation of a wedge in closed form, by Snell's law."""

from __future__ import annotations

import math

import numpy as np
import raycam
from raycam.lidar.risley import Prism, refract, risley_pattern


def test_one_wedge_draws_a_cone_with_the_deviation_of_the_wedge() -> None:
    """Light enters the flat face at normal incidence and leaves the slanted face bent.

    The deviation is asin(n sin w) - w.
    """
    pattern = risley_pattern([Prism(10.0, 25.0, 1.5)], 10000.0, 10.0, 0)
    deviation = math.asin(1.5 * math.sin(math.radians(10))) - math.radians(10)
    np.testing.assert_allclose(np.arccos(pattern.directions[:, 0]), deviation, atol=1e-9)
    turn = np.unwrap(np.arctan2(pattern.directions[:, 2], pattern.directions[:, 1]))
    np.testing.assert_allclose(np.diff(turn), 2 * math.pi * 25 / 10000, atol=1e-9)


def test_opposite_wedges_cancel_to_first_order() -> None:
    """Two thin wedges in opposite positions form a plate.

    The same is true for two wedges whose slanted faces are parallel.
    """
    pattern = risley_pattern([Prism(0.1, 0.0, 1.5), Prism(-0.1, 0.0, 1.5)], 100.0, 10.0, 0)
    assert np.arccos(np.clip(pattern.directions[:, 0], -1, 1)).max() < 1e-5
    plate = risley_pattern([Prism(20.0, 5.0, 1.5), Prism(-20.0, 5.0, 1.5, False)], 100.0, 10.0, 0)
    np.testing.assert_allclose(plate.directions, np.tile([1.0, 0, 0], (10, 1)), atol=1e-12)


def test_refraction_obeys_snells_law() -> None:
    way = np.array([[math.cos(0.4), math.sin(0.4), 0.0]])
    bent = refract(way, np.array([1.0, 0, 0]), 1 / 1.5)
    assert math.isclose(1.5 * bent[0, 1], math.sin(0.4), abs_tol=1e-15)
    assert math.isclose(np.linalg.norm(bent), 1.0, abs_tol=1e-15)


def test_mid40_covers_its_field_of_view_of_38_4_degrees() -> None:
    pattern = raycam.Lidar("livox-mid40", rate=10).pattern()
    across = np.degrees(np.arccos(pattern.directions[:, 0]))
    assert abs(2 * across.max() - 38.4) < 0.1
    assert across.min() < 1.0


def test_next_frame_continues_the_pattern() -> None:
    lidar = raycam.Lidar("livox-mid40", rate=10)
    both = raycam.Lidar("livox-mid40", rate=5).pattern()
    np.testing.assert_allclose(
        np.concatenate([lidar.pattern(0).directions, lidar.pattern(1).directions]), both.directions, atol=1e-9
    )
