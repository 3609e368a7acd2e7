"""Camera matrices in units of the image size are refused with the factor that converts them to pixels."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import raises


@pytest.mark.parametrize(
    ("scale", "offset", "remedy"),
    [
        ((1 / 640, 1 / 480), (0, 0), "the second by the height"),
        ((1 / 640, 1 / 640), (0, 0), "the first and the second row"),
        ((2 / 640, 2 / 480), (-1, -1), "width / 2"),
    ],
)
def test_matrix_in_units_of_the_image_size_is_refused_with_the_conversion(
    tmp_path: Path, scale: tuple[float, float], offset: tuple[float, float], remedy: str
) -> None:
    camera = raycam.Camera.look_at([3, 1, 2], [0, 0, 0], size=(640, 480), fov=50)
    matrix = camera.K @ np.column_stack([camera.R, camera.t])
    units = np.array([[scale[0], 0, offset[0]], [0, scale[1], offset[1]], [0, 0, 1]])
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"width": 640, "height": 480, "P": (units @ matrix).tolist()}))
    with raises(raycam.FormatError, code="syntax", mentions=[remedy]):
        raycam.load_cameras(path)
