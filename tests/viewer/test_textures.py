"""Textures of an object in a view: lists, thumbnails, replacement and removal."""

from __future__ import annotations

import base64
import io
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer import client_messages as messages
from raycam.viewer.answers import answer
from raycam.viewer.scene.edits import Edits
from raycam.viewer.scene.textures import list_textures, set_texture, thumbnail
from raycam.viewer.session import Session
from support.bending_plate import bending_plate
from support.raises import raises
from support.two_materials import two_materials

PAINT = np.zeros((8, 8, 3), np.uint8)
PAINT[:4, :4], PAINT[:4, 4:], PAINT[4:, :4], PAINT[4:, 4:] = (
    (250, 0, 0),
    (0, 250, 0),
    (0, 0, 250),
    (250, 250, 0),
)
BUMPS = np.full((8, 8, 3), (128, 128, 255), np.uint8)
BUMPS[:, 4:] = (200, 128, 220)


@pytest.fixture
def painted() -> raycam.World:
    world = raycam.World()
    world.add_object(box=1, name="first")
    world.add_object(
        plane={"size": [2, 1]},
        name="painted",
        location=[0, 3, 1],
        type="principled",
        color=[0.5, 0.5, 0.5],
        texture=PAINT,
        textures={"normal": BUMPS},
    )
    world.add_object(box=1, name="last", location=[4, 0, 0])
    world.add_light("sun", direction=[0, 0, -1], irradiance=3)
    return world


def test_textures_of_a_principled_material_are_listed(painted: raycam.World) -> None:
    used = {each["texture"]: each["used"] for each in list_textures(painted, 1)}
    assert used == {"color": True, "normal": True, "roughness": False, "metallic": False, "emission": False}
    assert [each["texture"] for each in list_textures(painted, 0)] == ["color"]


def test_thumbnail_of_a_deforming_object_gives_no_notice(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert thumbnail(world, 0, "color") is not None


@pytest.mark.parametrize(("key", "image"), [("color", PAINT), ("normal", BUMPS)])
def test_thumbnail_shows_the_texture_in_its_orientation_on_the_surface(
    painted: raycam.World, key: str, image: np.ndarray
) -> None:
    found = thumbnail(painted, 1, key)
    assert found is not None
    expected = np.asarray(Image.fromarray(image).resize((64, 64), Image.Resampling.NEAREST), int)
    inner = np.r_[10:22, 42:54]  # excludes pixels at edges, where texels are interpolated
    difference = np.abs(found.astype(int) - expected)[np.ix_(inner, inner)]
    assert difference.max() <= 2


def test_cleared_texture_has_no_effect(painted: raycam.World) -> None:
    camera = raycam.Camera.look_at([0, 3, 4], [0, 3.01, 1], size=(16, 8), fov=20)
    cleared = set_texture(set_texture(painted, 1, "color", None), 1, "normal", None)
    plain = raycam.World()
    plain.add_object(
        plane={"size": [2, 1]}, location=[0, 3, 1], type="principled", color=[0.5, 0.5, 0.5], roughness=1.0
    )
    plain.add_light("sun", direction=[0, 0, -1], irradiance=3)
    cleared.set_object(1, roughness=1.0)
    images = [
        raycam.render(each, camera, channels="color", samples=16, integrator="direct")["color"]
        for each in (cleared, plain)
    ]
    assert images[1].max() > 0.1
    assert np.allclose(images[0], images[1], atol=0.01 * images[1].max())


def test_uploaded_image_becomes_the_texture_and_undo_restores_it(painted: raycam.World) -> None:
    session = Session(Edits(painted), None)
    file = io.BytesIO()
    Image.fromarray(np.full((4, 4, 3), (0, 255, 0), np.uint8)).save(file, "PNG")
    data = base64.b64encode(file.getvalue()).decode()
    session.receive(messages.Upload("green.png", len(file.getvalue()), 0, data))
    session.receive(messages.Texture(1, -1, "color", "green.png"))
    world = session.view.opened.edits.world
    assert np.array_equal(thumbnail(world, 1, "color"), np.full((64, 64, 3), (0, 255, 0)))
    assert list_textures(world, 1)[0]["file"] == "green.png"
    sent: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: sent.append(message))
    answer(session, messages.Thumbnails(1, 0))
    (message,) = (each for each in sent if each["type"] == "thumbnails")
    shown = Image.open(io.BytesIO(base64.b64decode(message["images"]["color"].partition(",")[2])))
    assert np.allclose(np.asarray(shown)[32, 32], (0, 255, 0), atol=4)
    session.receive(messages.Undo())
    session.uploads.close()
    assert np.array_equal(
        thumbnail(session.view.opened.edits.world, 1, "color"), thumbnail(painted, 1, "color")
    )


@pytest.mark.parametrize("key", ["roughness", "metallic", "emission"])
def test_cleared_texture_keeps_the_value_of_the_material(painted: raycam.World, key: str) -> None:
    world = painted.copy()
    world.set_object(1, roughness=0.3, metallic=0.6, emission=2.0)
    before = json.loads(world._core.material(1, 0))
    after = json.loads(set_texture(world, 1, key, None)._core.material(1, 0))
    values = [
        [
            found["emission"]["value"],
            *(found["model"]["Principled"][key]["value"] for key in ("roughness", "metallic")),
        ]
        for found in (before, after)
    ]
    assert values[0] == values[1]


def test_replaced_texture_is_restored_from_the_saved_glb(painted: raycam.World, tmp_path: Path) -> None:
    Image.fromarray(PAINT[::-1].copy()).save(tmp_path / "other.png")
    changed = set_texture(painted, 1, "color", str(tmp_path / "other.png"))
    changed.to_gltf(tmp_path / "saved.glb")
    again = raycam.load(tmp_path / "saved.glb")
    number = [each.name for each in again.objects].index("painted")
    assert np.allclose(thumbnail(again, number, "color"), thumbnail(changed, 1, "color"), atol=1)


def test_textures_of_a_read_only_view_and_missing_files_are_refused(painted: raycam.World) -> None:
    closed = Session(Edits(painted, allowed=False), None)
    with raises(raycam.SettingsError, code="read_only"):
        closed.receive(messages.Texture(1, -1, "color", ""))
    with raises(raycam.SettingsError):
        closed.receive(messages.Upload("green.png", 4, 0, "AAAA"))
    session = Session(Edits(painted), None)
    for name in ("missing.png", "../x.png", "world.toml"):
        with raises(raycam.SettingsError):
            session.receive(messages.Texture(1, -1, "color", name))
    with raises(raycam.Error):
        session.receive(messages.Texture(7, -1, "color", ""))
    assert session.view.opened.edits.about()["undo"] == 0


def test_texture_of_one_material_keeps_the_other_material(tmp_path: Path) -> None:
    world = two_materials(tmp_path)
    Image.new("RGB", (4, 4), (0, 255, 0)).save(tmp_path / "green.png")
    changed = set_texture(world, 0, "color", str(tmp_path / "green.png"), 1)
    assert [list_textures(changed, 0, slot)[0]["used"] for slot in range(2)] == [False, True]
    assert list_textures(changed, 0, 1)[0]["file"] == "green.png"
    assert list_textures(changed, 0, 2) == []
    shown = thumbnail(changed, 0, "color", 1)
    assert shown is not None
    assert np.allclose(shown, (0, 255, 0))
    with raises(raycam.WorldError, code="unknown_name"):
        set_texture(world, 0, "color", str(tmp_path / "green.png"), 2)
