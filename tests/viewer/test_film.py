"""Videos of a live view: a turn around the pivot, and the world's animation."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image, ImageSequence
from raycam.errors import Cancelled
from raycam.viewer.answers import answer
from raycam.viewer.client_messages import Film
from raycam.viewer.files import film
from raycam.viewer.files.outputs import film as saved
from raycam.viewer.session import Session
from support.raises import raises
from support.session_messages import receive


def test_turntable_video_makes_one_full_turn(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "has_av", lambda: False)
    session = Session(small_world, small_world.camera("front"), title="small.toml")
    session.connection.open(lambda message, buffers: None)
    session.show(replace(session.view, pivot=np.zeros(3)))
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
        assert np.abs(frames[number] - wanted).mean() < 4  # the tolerance for a palette of 256 colours
    assert np.abs(frames[4] - frames[0]).mean() > 8


def test_video_is_cancelled_when_its_client_leaves(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    with pytest.raises(Cancelled):
        saved(session, 1, 360)


def test_stopped_video_sends_a_notice(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    heard = []

    def hear(message: dict[str, Any], buffers: object) -> None:
        heard.append(message)
        if message["type"] == "filming":
            receive(session, {"type": "stop"})

    session.connection.open(hear)
    answer(session, Film(20, 360))
    assert [each["type"] for each in heard] == ["filming", "filming", "notice"]
    assert heard[0]["total"] == 480
    assert heard[1]["total"] == 0
    assert heard[2]["text"] == "The video was stopped."


def moving_world(folder: Path) -> raycam.World:
    path = folder / "moving.toml"
    path.write_text(
        "[[object]]\nname = 'ball'\nsphere = { radius = 1 }\n"
        "[[camera]]\nname = 'rides'\nlocation = [0, -4, 1]\ntarget = [0, 0, 0]\nsize = [48, 32]\nfov = 40\n"
        "[video]\nfps = 10\nseconds = 1\ninterpolation = 'linear'\n"
        "keyframe = [{ time = 0, object = 'ball', location = [-1, 0, 0] },"
        " { time = 1, object = 'ball', location = [1, 0, 0] },"
        " { time = 0, location = [0, -4, 1], target = [0, 0, 0] },"
        " { time = 1, location = [0, -3, -1], target = [0, 0, 0] }]\n"
    )
    return raycam.load(path)


@pytest.mark.parametrize("named", [True, False])
def test_animated_world_is_saved_as_a_video(tmp_path: Path, named: bool) -> None:
    av = pytest.importorskip("av")
    world = moving_world(tmp_path)
    rides = world.camera("rides")
    free = rides.at_pose(rides.R, [0, -5, 0])
    session = Session(world, rides if named else free, title="moving.toml")
    session.connection.open(lambda message, buffers: None)
    name, media, data = saved(session, 60, 0)
    assert (name, media) == ("moving_animation.mp4", "video/mp4")
    with av.open(io.BytesIO(data)) as film_:
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in film_.decode(video=0)]
    assert len(frames) == 24
    for i in (0, 12, 23):
        at = world.at(i / 24)
        seen = world.camera_at(rides, i / 24) if named else free
        wanted = raycam.render(at, seen, integrator="direct", samples=8, frame=i).to_srgb8()
        assert np.abs(frames[i] - wanted).mean() < 2  # the tolerance for lossy compression
    assert np.abs(frames[23] - frames[0]).mean() > 8


def test_static_world_cannot_be_saved_as_an_animation(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    session.connection.open(lambda message, buffers: None)
    with raises(raycam.SettingsError, code="missing_value"):
        saved(session, 1, 0)
