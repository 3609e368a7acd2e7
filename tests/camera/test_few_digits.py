"""Rotations with too few digits are refused."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.errors import CameraError
from scipy.spatial.transform import Rotation
from support.raises import raises


def test_rotation_with_four_digits_is_repaired_and_rotation_with_two_digits_refused() -> None:
    K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
    R = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix().round(4)
    U, _, Vt = np.linalg.svd(R)
    with pytest.warns(raycam.Notice):
        repaired = raycam.Camera(K, R, np.zeros(3), (640, 480))
    np.testing.assert_allclose(repaired.R, U @ Vt, atol=1e-12)
    with raises(CameraError, code="not_a_rotation"):
        raycam.Camera(K, R.round(2), np.zeros(3), (640, 480))
