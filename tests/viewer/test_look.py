"""The look of a view: the same images as `raycam.render`, kept while the world is edited."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.session import Session
from raycam.viewer.session.copied import copied
from raycam.viewer.viewer import Viewer
from support.gltf_document import Document, animated
from support.raises import raises
from support.session_messages import receive

REGION = (300, 330, 24, 24)
LOOK: dict[str, Any] = {
    "type": "look",
    "light": "sun",
    "rotation": 0,
    "azimuth": 30,
    "elevation": 45,
    "ground": "auto",
    "ground_color": "",
    "backdrop": "light",
    "background": "",
}


def model() -> raycam.World:
    """A model without lights and cameras."""
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    world.add_object(sphere={"radius": 0.4}, location=[0.9, -0.6, -0.1], name="ball")
    return world


def color(world: raycam.World, camera: raycam.Camera, **options: Any) -> Any:
    """The colour of the image region that the tests compare."""
    return raycam.render(world, camera, channels="color", region=REGION, **options)["color"]


def test_model_without_lights_equals_render() -> None:
    world = model()
    view = Session(world).view
    assert (view.look.light, view.integrator, view.transform) == ("studio", "path", "pbr_neutral")
    shown = color(view.lit, view.still_camera, integrator="path", samples=2, **view.render_options)
    expected = raycam.render(world, channels="color", region=REGION, samples=2)["color"]
    assert np.array_equal(shown, expected)


def test_model_file_with_a_sun_is_shown_in_the_studio_room() -> None:
    world = model()
    world.add_light("sun", direction=[1, 1, -2], irradiance=500)
    view = Session(world, is_model=True).view
    assert (view.look.light, view.integrator, view.transform) == ("room", "path", "pbr_neutral")
    assert view.exposure < -6
    assert [light["type"] for light in view.lit.lights] == ["sun", "environment"]
    assert [light["type"] for light in view.preview.lights] == ["sun", "sky"]
    assert len(view.lit.objects) == len(world.objects) + 1
    corner = raycam.render(view.lit, view.still_camera, channels="color", region=(0, 0, 8, 8), samples=2)[
        "color"
    ]
    moving = raycam.render(view.preview, view.still_camera, channels="color", region=(0, 0, 8, 8))["color"]
    np.testing.assert_allclose(moving.mean(), corner.mean(), rtol=0.1)
    assert 0.2 < corner.mean() * 2**view.exposure < 0.7
    assert Session(world).view.look.light == "own"
    with Viewer(world, port=0, is_model=True, studio=False) as viewer:
        assert viewer._first.view.look.light == "own"


def test_model_without_materials_is_grey_until_it_gets_a_color() -> None:
    corners = "".join(f"v {x} 0 0\nv {x + 1} 0 0\nv {x} 1 0\n" for x in (0, 2))
    world = raycam.load(f"{corners}o a\nf 1 2 3\no b\nf 4 5 6\n".encode(), kind="obj")
    session = Session(world, is_model=True)
    own = session.view.world

    def colors(world: raycam.World) -> list[float]:
        return [json.loads(world._core.material(number, 0))["color"][0] for number in (0, 1)]

    assert colors(session.view.lit) == colors(session.view.preview) == pytest.approx([0.35, 0.35])
    assert colors(own) == pytest.approx([0.8, 0.8])
    assert "albedo" in str(session.about()["notices"])
    edit = {"type": "edit_material", "number": 0, "slot": -1, "key": "color", "value": "#ffffff"}
    receive(session, edit)
    assert colors(session.view.lit) == pytest.approx([1.0, 0.35])
    assert colors(Session(world).view.lit) == pytest.approx([0.8, 0.8])


def test_up_axis_turns_camera_and_floor_and_can_be_undone() -> None:
    session = Session(model())
    before = session.view

    def floor() -> np.ndarray:
        (number,) = (each.id for each in session.view.lit.objects if each.name == "studio floor")
        return session.view.lit.triangles(number).reshape(-1, 3)

    assert np.ptp(floor()[:, 2]) < 1e-6
    receive(session, {"type": "up", "axis": "y"})
    view = session.view
    assert (view.base.up, view.camera.up, view.shape) == ("y", "y", "home")
    assert view.camera == view.base.view_from(size=view.camera.size)
    assert np.ptp(floor()[:, 1]) < 1e-6
    np.testing.assert_array_equal(view.base.triangles(), before.base.triangles())
    assert "--up y" in copied(view, "command", 4, print)
    receive(session, {"type": "undo"})
    assert (session.view.base.up, session.view.camera) == ("z", before.camera)
    assert "--up" not in copied(session.view, "command", 4, print)


def test_world_with_a_camera_keeps_the_default_lights() -> None:
    world = model()
    camera = world.view_from()
    world.add_camera(camera, "own")
    view = Session(world).view
    assert view.look.light == "default"
    assert np.array_equal(color(view.lit, camera, samples=2), color(world, camera, samples=2))


def test_faint_emission_does_not_replace_the_default_light() -> None:
    for camera in (None, model().view_from()):
        session = Session(model(), camera)
        before = color(session.view.lit, session.view.still_camera, samples=4, integrator="direct")
        edit = {"type": "edit_material", "number": 1, "slot": -1, "key": "emission", "value": 1e-4}
        receive(session, edit)
        after = color(session.view.lit, session.view.still_camera, samples=4, integrator="direct")
        assert after.mean() == pytest.approx(before.mean(), rel=0.1)
        unlit = color(session.view.world, session.view.still_camera, samples=4, integrator="direct")
        assert unlit.mean() < 0.01 * before.mean()  # the image without the view's own light


def test_hiding_the_only_light_makes_the_room_dark() -> None:
    world = model()
    world.add_object(sphere={"radius": 0.1}, location=[0, 0, 2], emission=[5, 5, 5], name="lamp")
    session = Session(world)
    before = color(session.view.lit, session.view.still_camera, samples=4)
    receive(session, {"type": "edit", "kind": "object", "number": 2, "key": "visible", "value": False})
    after = color(session.view.lit, session.view.still_camera, samples=4)
    assert session.view.look.light == "own"
    assert before.max() > 0
    assert after.max() == 0


def test_ground_stays_while_objects_move() -> None:
    session = Session(model())

    def floor() -> float:
        (number,) = (each.id for each in session.view.lit.objects if each.name == "studio floor")
        return float(session.view.lit.triangles(number)[..., 2].max())

    before = floor()
    for number in (0, 1):
        edit = {"type": "edit", "kind": "object", "number": number, "key": "move", "value": [0, 0, 3]}
        receive(session, edit)
    assert floor() == before
    assert session.view.world.bounds is not None
    assert session.view.world.bounds[0][2] > before + 2


def test_floor_is_hidden_from_cameras_below_it_and_from_ground_truth() -> None:
    session = Session(model())
    assert len(session.view.lit.objects) == 3
    assert len(session.view.world.objects) == 2
    receive(session, {"type": "side", "seq": 1, "name": "bottom"})
    assert len(session.view.lit.objects) == 2
    receive(session, {"type": "channel", "name": "coverage"})
    assert session.view.shown is session.view.world


@pytest.mark.parametrize(("width", "height", "ratio"), [(730, 400, 1), (300, 600, 2), (200, 200, 1.5)])
def test_image_fills_the_window(width: int, height: int, ratio: float) -> None:
    world = model()
    session = Session(world)
    receive(session, {"type": "size", "width": width, "height": height, "ratio": ratio})
    view = session.view
    assert view.size == view.still_camera.size == (round(width * ratio), round(height * ratio))
    pixels, visible = view.still_camera.project(world.triangles().reshape(-1, 3))
    assert visible.all()
    assert (pixels > 0).all()
    assert (pixels < view.size).all()
    assert 2 * np.arctan(view.size[1] / (2 * view.camera.K[1, 1])) == pytest.approx(np.radians(45))


def test_resized_window_keeps_a_moved_camera() -> None:
    session = Session(model())
    receive(session, {"type": "pose", "location": [4, -4, 3], "roll": 0, "pitch": 20, "yaw": 135})
    before = session.view.camera
    receive(session, {"type": "size", "width": 900, "height": 300, "ratio": 1})
    after = session.view.camera
    assert after.size == (900, 300)
    assert np.allclose(after.location, before.location)
    assert np.allclose(after.R, before.R)
    forward = before.rays(np.array([before.K[:2, 2]]))[1]
    assert np.allclose(after.rays(np.array([after.K[:2, 2]]))[1], forward)


def test_cameras_of_the_world_keep_their_aspect_ratio() -> None:
    world = model()
    world.add_camera(raycam.Camera.look_at([4, -4, 3], [0, 0, 0], size=(48, 32), fov=40), "own")
    session = Session(world)
    receive(session, {"type": "size", "width": 900, "height": 300, "ratio": 1})
    assert session.view.size == (450, 300)


def test_options_select_light_ground_background_and_view_direction() -> None:
    world = model()
    options: dict[str, Any] = {"sun": (20, 30), "ground": "", "background": "#ffffff"}
    with Viewer(world, port=0, view_from="front", zoom=0.8, fov=30, **options) as viewer:
        session = viewer._first
        look = session.view.look
        assert (look.light, look.sun, look.ground, look.background) == ("sun", (20, 30), "plain", "#ffffff")
        assert viewer.camera == world.view_from("front", zoom=0.8, fov=30)
        kinds = [light["type"] for light in session.view.lit.lights]
        assert kinds == ["sun", "sky"]
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["hdri"]):
        Viewer(world, port=0, hdri_rotation=20)
    with raises(raycam.SettingsError, code="invalid_value", mentions=["sun"]):
        Viewer(world, port=0, sun=(1, 2, 3))


def test_client_changes_the_look_and_restores_it() -> None:
    session = Session(model())
    first = session.view.look
    version = session.images.version
    receive(session, LOOK)
    assert [each["type"] for each in session.view.lit.lights] == ["sun", "sky"]
    assert session.images.version > version
    receive(session, {"type": "restore_look"})
    assert session.view.look.equals(first)
    assert [each["type"] for each in session.view.lit.lights] == ["environment", "sun"]


def test_background_color_is_shown_at_the_image_corner(tmp_path: Path) -> None:
    session = Session(model())
    receive(session, {**LOOK, "light": "studio", "backdrop": "color", "background": "#336699"})
    images = session.images.refinement_of(session.view)
    images.most = 4
    frame = images.step(session.images.cancel)
    assert frame is not None
    corner = frame.to_srgb8(view="standard")[0, 0]
    assert np.abs(corner.astype(int) - [0x33, 0x66, 0x99]).max() <= 1


def test_object_that_an_animation_moves_cannot_be_moved(tmp_path: Path) -> None:
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}))
    animated(document, "translation", [0, 1], [[5, 0, 0], [6, 0, 0]], node=node)
    session = Session(raycam.load(document.save(tmp_path / "m.glb")))
    for key, value in {"move": [1, 0, 0], "turn": 30, "scale": 2}.items():
        with raises(raycam.WorldError, code="conflicting_values"):
            receive(session, {"type": "edit", "kind": "object", "number": 0, "key": key, "value": value})
    assert session.selection.about()["animated"]
    receive(session, {"type": "edit_material", "number": 0, "slot": -1, "key": "color", "value": "#ff0000"})


def test_isolation_is_one_step_of_undo() -> None:
    session = Session(model())
    receive(session, {"type": "edit", "kind": "object", "number": 1, "key": "isolate", "value": True})
    assert [each.visible for each in session.view.base.objects] == [False, True]
    receive(session, {"type": "undo"})
    assert [each.visible for each in session.view.base.objects] == [True, True]
