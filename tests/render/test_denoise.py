"""Denoising: the error if the library is missing, and the arrays passed to it otherwise."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import raycam
from support.raises import has_notice, raises


def world() -> raycam.World:
    return raycam.World.from_dict(
        {
            "camera": {"size": [8, 6], "focal": 8, "location": [0, 0, 3], "pitch": 90},
            "object": {"plane": {"size": [9, 9]}},
            "light": {"type": "sky", "radiance": [1, 1, 1]},
        }
    )


def test_missing_denoiser_is_reported_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["'raycam[denoise]'"]):
        raycam.render(world(), denoise=True)
    assert not has_notice(raycam.render(world(), samples=1).notices, "denoised")


@pytest.mark.parametrize("radiance", [0.8, 0.2])
def test_transparent_edges_keep_their_color_when_denoised(
    monkeypatch: pytest.MonkeyPatch, radiance: float
) -> None:
    """An unlit ball keeps its colour at every opacity, for a denoiser of any radius."""
    from raycam.render import denoise
    from scipy.ndimage import uniform_filter

    monkeypatch.setattr(denoise, "load", lambda: None)
    monkeypatch.setattr(
        denoise, "denoise", lambda color, albedo, normal: uniform_filter(color, (5, 5, 1), mode="nearest")
    )
    ball = raycam.World()
    ball.add_object(sphere={}, type="unlit", color=[radiance] * 3)
    ball.add_light(type="sky", radiance=[9, 9, 9])
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(40, 30), fov=40)
    frame = raycam.render(ball, camera, samples=64, denoise=True, transparent_background=True)
    color, alpha = frame["color"], frame["alpha"]
    assert ((alpha > 0) & (alpha < 1)).sum() > 20
    assert color[alpha > 0] / alpha[alpha > 0][:, np.newaxis] == pytest.approx(radiance, rel=1e-4)
    assert not color[alpha == 0].any()
