"""Renders a street through a fisheye lens whose image is 154 degrees wide.

The calibration is that of a camera of the TUM VI data set.
"""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality
from town import street

TUM_VI = raycam.Camera.look_at(  # Schubert et al., "The TUM VI Benchmark", 2018 (CC-BY 4.0), camera 0, Kalibr
    [-0.55, -9.0, 1.55],
    [0.1, 0, 2.3],
    size=(512, 512),
    K=[[190.978477, 0, 254.931706], [0, 190.973307, 256.897443], [0, 0, 1]],
    distortion=[0.0034823894, 0.00071503485, -0.0020532361, 0.00020293674],
    model="fisheye",
)


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    camera = TUM_VI.cropped(0, 112, 512, 288).resized((960, 540))
    return quality.shot(street(assets), camera, samples=12, max_depth=6)
