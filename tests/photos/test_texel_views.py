"""Views of texels: the largest weights are kept."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam._core import TexelViews
from support.raises import raises

TEXELS, PHOTOGRAPHS, KEPT = 30, 20, 8


def test_eight_views_with_the_largest_weights_are_kept_with_their_colors() -> None:
    random = np.random.default_rng(1)
    weights = random.random((TEXELS, PHOTOGRAPHS)).astype(np.float32) + 0.1
    weights[random.random(weights.shape) < 0.4] = 0
    colors = random.random((TEXELS, PHOTOGRAPHS, 3)).astype(np.float32)
    views = TexelViews(TEXELS)
    for camera in range(PHOTOGRAPHS):
        index = np.flatnonzero(weights[:, camera])
        views.add(camera, index, weights[index, camera].copy(), colors[index, camera])
    np.testing.assert_array_equal(views.counts(), (weights > 0).sum(axis=1))
    kept_weights, kept_colors, kept_cameras = views.kept(0, TEXELS)
    np.testing.assert_array_equal(
        np.sort(kept_weights, axis=1), np.sort(np.sort(weights, axis=1)[:, -KEPT:], axis=1)
    )
    texel, slot = np.nonzero(kept_weights)
    camera = kept_cameras[texel, slot]
    np.testing.assert_array_equal(kept_weights[texel, slot], weights[texel, camera])
    np.testing.assert_array_equal(kept_colors[texel, slot], colors[texel, camera])
    for whole, part in zip(views.kept(0, TEXELS), views.kept(5, 9), strict=True):
        np.testing.assert_array_equal(part, whole[5:9])


@pytest.mark.parametrize("index", [-1, 3])
def test_texels_out_of_range_are_refused(index: int) -> None:
    with raises(raycam.SettingsError, mentions=[str(index)]):
        TexelViews(3).add(0, np.array([index]), np.ones(1, np.float32), np.ones((1, 3), np.float32))
    with pytest.raises(IndexError):
        TexelViews(3).kept(1, 4)


def test_arrays_of_different_lengths_are_refused() -> None:
    with raises(raycam.SettingsError):
        TexelViews(3).add(0, np.array([0, 1]), np.ones(1, np.float32), np.ones((2, 3), np.float32))
