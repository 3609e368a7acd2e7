"""A rotation of few digits is refused with the way on."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.errors import CameraError
from scipy.spatial.transform import Rotation


def test_a_rotation_of_four_digits_is_refused_with_the_way_on() -> None:
    K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
    R = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix().round(4)
    with pytest.raises(CameraError, match="svd"):
        raycam.Camera(K, R, np.zeros(3), (640, 480))
    U, _, Vt = np.linalg.svd(R)
    np.testing.assert_allclose(raycam.Camera(K, U @ Vt, np.zeros(3), (640, 480)).R, R, atol=1e-4)
