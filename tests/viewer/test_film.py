"""A turn around the pivot as a film."""

from __future__ import annotations

import io

import numpy as np
import pytest
import raycam
from PIL import Image, ImageSequence
from raycam.errors import Cancelled
from raycam.viewer.files import film
from raycam.viewer.outputs import film as saved
from raycam.viewer.session import Session


def test_a_turntable_goes_around_and_comes_back(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "has_av", lambda: False)
    session = Session(small_world, small_world.camera("front"), title="small.toml")
    session.send = lambda message, buffers: None
    session.pivot = np.zeros(3)
    name, media, data = saved(session, 0.7, 360)
    assert (name, media) == ("small_turntable.gif", "image/gif")
    frames = [
        np.asarray(each.convert("RGB"), int) for each in ImageSequence.Iterator(Image.open(io.BytesIO(data)))
    ]
    assert len(frames) == 8
    assert frames[0].shape == (32, 48, 3)
    for number in (0, 1, 4):
        c, s = np.cos(number * np.pi / 4), np.sin(number * np.pi / 4)
        eye = [4 * c + 3 * s, 4 * s - 3 * c, 2]
        camera = raycam.Camera.look_at(eye, [0, 0, 0], size=(48, 32), fov=40)
        wanted = raycam.render(small_world, camera, integrator="direct", samples=8, frame=number).to_srgb8()
        assert np.abs(frames[number] - wanted).mean() < 4  # a palette of 256 colours
    assert np.abs(frames[4] - frames[0]).mean() > 8


def test_it_ends_with_its_client(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    with pytest.raises(Cancelled):
        saved(session, 1, 360)
