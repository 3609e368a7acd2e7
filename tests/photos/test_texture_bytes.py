"""Textures and their figures that do not depend on the processor's BLAS kernel."""

from __future__ import annotations

import sys

import pytest
from support.blas_kernels import outputs_by_kernel

SCRIPT = """
import hashlib
import numpy as np
import raycam
from support.textured_panel import noise, panel, ring_of_places, shots

world = panel(noise(64), cells=3)
cameras, photos = shots(world, ring_of_places(5), size=(120, 90), samples=1)
cameras = {
    name: camera.with_vignetting(cos4=True, polynomial=[-0.1, 0.02]) if number % 2 else camera
    for number, (name, camera) in enumerate(cameras.items())
}
for method in ("blend", "detail"):
    found = raycam.texture_from_photos(world, cameras, photos, size=96, method=method)
    fits = np.array([(*fit.gain, fit.shift_px, fit.disagreement) for fit in found.photographs])
    for array in (found.texture, found.views, found.disagreement, found.view, fits):
        print(method, hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="OPENBLAS_CORETYPE selects the kernel on Linux only")
def test_texture_gains_and_shifts_do_not_depend_on_the_blas_kernel() -> None:
    outputs = outputs_by_kernel(SCRIPT)
    assert len(outputs) >= 2
    assert len(set(outputs)) == 1
