"""Keys of faces have the order of their ids."""

from __future__ import annotations

import numpy as np
from raycam.photos.face_keys import face_keys


def test_keys_have_the_order_of_ids() -> None:
    ids = np.random.default_rng(3).integers(0, 2**31, (500, 2)).astype(np.int32)
    ids[::3, 0] = ids[0, 0]
    np.testing.assert_array_equal(np.argsort(face_keys(ids)), np.lexsort((ids[:, 1], ids[:, 0])))
