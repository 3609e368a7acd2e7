"""Texels on surfaces of MuJoCo models."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.interop.mujoco.surfaces import texel_density


@pytest.mark.filterwarnings("error")
def test_texel_density_is_zero_for_triangles_without_area() -> None:
    corners = [[[0, 0, 0], [2, 0, 0], [0, 0, 1]], [[0, 0, 0], [1, 1, 0], [2, 2, 0]], [[1, 1, 1]] * 3]
    uvs = [[0, 0], [1, 0], [0, 1]]
    found = texel_density(np.array(corners, float), np.array([uvs] * 3, float), (100, 20))
    np.testing.assert_allclose(found, [50, 0, 0])  # 100 texels on 2 m are 50 per metre, 20 on 1 m are 20
