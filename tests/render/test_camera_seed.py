"""Seeds of cameras that take images at the same time."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.render.camera_seed import camera_seed, with_camera_seed


@pytest.mark.parametrize("seed", [np.int64(3), np.uint8(3), np.array(3)])
def test_with_camera_seed_accepts_scalars_of_numpy(seed: object) -> None:
    assert with_camera_seed({"seed": seed}, 1) == {"seed": camera_seed(3, 1)}


def test_with_camera_seed_keeps_invalid_seeds() -> None:
    assert with_camera_seed({"seed": "a"}, 1) == {"seed": "a"}
