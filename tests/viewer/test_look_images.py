"""Images that a client sends to light the world, or to be shown behind it."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer.session import Session
from raycam.viewer.session.copied import copied
from support.raises import raises
from support.session_messages import receive

SKY = Path(raycam.__file__).parent / "assets" / "sky.hdr"


def model() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    return world


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session(model())
    yield made
    made.uploads.close()


def send(session: Session, use: str, name: str, data: bytes) -> None:
    """Sends a file in one piece, and uses it."""
    text = base64.b64encode(data).decode()
    receive(session, {"type": "upload", "name": name, "bytes": len(data), "offset": 0, "data": text})
    receive(session, {"type": "look_image", "use": use, "file": name})


def blue_png() -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (40, 30), (20, 60, 220)).save(file, "PNG")
    return file.getvalue()


def corner_of(session: Session) -> Any:
    """The mean colour of the image's corner."""
    images = session.images.refinement_of(session.view)
    images.most = 4
    frame = images.step(session.images.cancel)
    assert frame is not None
    return frame.to_srgb8(view="standard")[:4, :4].reshape(-1, 3).mean(0)


def test_environment_image_lights_the_world_and_is_named_in_the_command(session: Session) -> None:
    send(session, "light", "a/sky.hdr", SKY.read_bytes())
    look = session.view.look
    assert look.light == "sky"
    assert look.describe()["image"] == "sky.hdr"
    assert "environment" in [light["type"] for light in session.view.lit.lights]
    command = copied(session.view, "command", 4, print)
    assert "--hdri sky.hdr" in command
    assert str(session.uploads._path()) not in command


def test_background_image_is_shown_at_the_corner_and_undo_removes_it(session: Session) -> None:
    send(session, "background", "blue.png", blue_png())
    assert session.view.look.describe()["backdrop"] == "image"
    assert np.abs(corner_of(session) - [20, 60, 220]).max() <= 2
    receive(session, {"type": "undo"})
    assert session.view.look.describe()["backdrop"] == "light"


def test_restored_look_is_the_first_one(session: Session) -> None:
    first = session.view.look
    send(session, "light", "sky.hdr", SKY.read_bytes())
    send(session, "background", "blue.png", blue_png())
    assert not session.view.look.describe()["is_first"]
    receive(session, {"type": "restore_look"})
    assert session.view.look.equals(first)
    assert session.view.look.describe()["is_first"]


@pytest.mark.parametrize("use", ["light", "background"])
def test_damaged_image_raises_with_its_name_and_keeps_the_look(session: Session, use: str) -> None:
    before = session.view.look
    with raises(raycam.FormatError, mentions=["broken.hdr"]) as error:
        send(session, use, "a/broken.hdr", SKY.read_bytes()[:300])
    assert str(session.uploads._path()) not in str(error.value)
    assert session.view.look is before


def test_missing_and_unsupported_images_are_refused(session: Session) -> None:
    for name in ("absent.hdr", "model.obj"):
        with raises(raycam.SettingsError, code="unknown_format", mentions=[name]):
            receive(session, {"type": "look_image", "use": "light", "file": name})


def test_framing_shows_the_whole_world_from_the_present_direction(session: Session) -> None:
    direction = session.view.camera.R[2]
    receive(session, {"type": "framing", "seq": 1, "zoom": 0.5, "fov": 20})
    camera = session.view.camera
    np.testing.assert_allclose(camera.R[2], direction, atol=1e-12)
    assert np.degrees(2 * np.arctan(camera.size[1] / (2 * camera.K[1, 1]))) == pytest.approx(20)
    pixels, visible = session.view.still_camera.project(model().triangles().reshape(-1, 3))
    assert visible.all()
    share = np.ptp(pixels, axis=0) / session.view.size
    assert share.max() == pytest.approx(0.45, abs=0.02)
