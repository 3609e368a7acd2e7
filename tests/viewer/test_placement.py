"""Placements as numbers, compared with the core's own keys."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.placement import matrix_of_placement, placement_of_matrix
from support.raises import raises


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_placement_and_matrix_convert_into_each_other(up: str, mirror: float) -> None:
    random = np.random.default_rng(5)
    for _ in range(50):
        location, angles = random.uniform(-5, 5, 3), random.uniform([-180, -89, -180], [180, 89, 180])
        scales = random.uniform(0.1, 3, 3) * [1, 1, mirror]
        world = raycam.World(up=up)
        roll, pitch, yaw = map(float, angles)
        world.add_object(box=1, location=location, roll=roll, pitch=pitch, yaw=yaw, scale=np.abs(scales))
        expected = np.array(world.objects[0].matrix) @ np.diag([1, 1, mirror, 1])
        values = [*location.tolist(), roll, pitch, yaw, *scales.tolist()]
        assert np.allclose(matrix_of_placement(values, up), expected, atol=1e-9)
        assert np.allclose(placement_of_matrix(expected, up), values)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_placement_at_gimbal_lock_gives_the_same_matrix(pitch: float) -> None:
    matrix = matrix_of_placement([1, 2, 3, 20.0, pitch, 50.0, 1, 2, 3], "z")
    found = placement_of_matrix(matrix, "z")
    assert found is not None
    assert np.allclose(matrix_of_placement(found, "z"), matrix, atol=1e-7)


def test_placement_of_sheared_and_flat_matrices_is_none() -> None:
    sheared = np.eye(4)
    sheared[0, 1] = 0.5
    assert placement_of_matrix(sheared, "z") is None
    assert placement_of_matrix(np.diag([1.0, 0, 1, 1]), "z") is None


@pytest.mark.parametrize(
    ("values", "code"),
    [
        ([0.0] * 8, "wrong_shape"),
        ([0.0] * 6 + [1, 1, 0], "out_of_range"),
        ("x", "wrong_shape"),
        ([np.nan] + [1.0] * 8, "wrong_shape"),
    ],
)
def test_invalid_placements_are_refused(values: object, code: str) -> None:
    with raises(raycam.SettingsError, code=code):
        matrix_of_placement(values, "z")
