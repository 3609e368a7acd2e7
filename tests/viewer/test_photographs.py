"""Photographs behind the cameras of a view."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer.answers import answer
from raycam.viewer.client_messages import Photograph
from raycam.viewer.files import photographs
from raycam.viewer.files.photographs import Photographs
from raycam.viewer.session import Session

SIZE = (48, 32)


def picture(size: tuple[int, int] = SIZE) -> np.ndarray:
    """A photograph with smooth colours, which JPEG keeps."""
    x, y = np.meshgrid(np.linspace(40, 220, size[0]), np.linspace(60, 200, size[1]))
    return np.dstack([x, y, 255 - x]).round().astype(np.uint8)


def decoded(data: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(data)) as image:
        return np.array(image.convert("RGB")).astype(int)


def test_photograph_of_the_cameras_size_is_sent_in_full_size(
    small_world: raycam.World, tmp_path: Path
) -> None:
    Image.fromarray(picture()).save(tmp_path / "IMG_1.png")
    data, notices = Photographs(tmp_path, {"front": "IMG_1.png"}).jpeg("front", small_world.camera("front"))
    assert np.abs(decoded(data) - picture()).max() <= 6
    assert notices == []


def test_large_photograph_is_averaged(small_world: raycam.World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(photographs, "LONGEST_SIDE", 24)
    data, _ = Photographs({"a": picture()}, {"front": "a"}).jpeg("front", small_world.camera("front"))
    assert decoded(data).shape == (16, 24, 3)


def test_photograph_of_another_size_is_refused(small_world: raycam.World) -> None:
    with pytest.raises(raycam.SettingsError) as found:
        Photographs({"a": picture((40, 32))}, {"front": "a"}).jpeg("front", small_world.camera("front"))
    assert found.value.code == "photograph_size"


def test_missing_photographs_are_reported_before_the_view_starts(
    small_world: raycam.World, tmp_path: Path
) -> None:
    with pytest.raises(FileNotFoundError) as found:
        raycam.view(small_world, cameras=small_world.cameras, photos=tmp_path, browser=False, block=False)
    assert "front" in str(found.value)


def test_photos_require_cameras(small_world: raycam.World, tmp_path: Path) -> None:
    with pytest.raises(raycam.SettingsError) as found:
        raycam.view(small_world, photos=tmp_path, browser=False, block=False)
    assert found.value.code == "missing_value"


def test_session_sends_only_photographs_of_its_world(small_world: raycam.World) -> None:
    session = Session(
        small_world, photographs=Photographs({"a": picture(), "b": picture()}, {"front": "a", "gone": "b"})
    )
    sent: list[tuple[dict, list[bytes]]] = []
    session.connection.open(lambda message, buffers: sent.append((message, list(buffers))))
    assert session.welcome()["photographs"] == ["front"]
    for name in ("front", "side", "gone", "../x"):
        answer(session, Photograph(name))
    kinds = [message["type"] for message, _ in sent]
    assert kinds == ["photograph", "error", "error", "error"]
    assert np.abs(decoded(sent[0][1][0]) - picture()).max() <= 6


def test_view_begins_with_the_first_photograph(small_world: raycam.World) -> None:
    cameras = {"taken": small_world.camera("side")}
    bare = raycam.World()
    bare.add_object(box={"size": 1})
    with raycam.view(
        bare, cameras=cameras, photos={"taken": picture()}, browser=False, block=False, port=0
    ) as viewer:
        assert viewer.camera == cameras["taken"]
        assert viewer._first.view.camera_name == "taken"
