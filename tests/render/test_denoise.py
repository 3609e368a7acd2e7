"""Denoising: what is said where the library is missing, and what is asked of it where it is there."""

from __future__ import annotations

import sys

import pytest
import raycam


def world() -> raycam.World:
    return raycam.World.from_dict(
        {
            "camera": {"size": [8, 6], "focal": 8, "location": [0, 0, 3], "pitch": 90},
            "object": {"plane": {"size": [9, 9]}},
            "light": {"type": "sky", "radiance": [1, 1, 1]},
        }
    )


def test_a_missing_library_is_named_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(raycam.SettingsError, match=r"pip install 'raycam\[denoise\]'"):
        raycam.render(world(), denoise=True)
    assert not any("denoise" in notice for notice in raycam.render(world(), samples=1).notices)
