"""Sessions: the effect of messages, and the size of images."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.answers import SLOW
from raycam.viewer.client_messages import MESSAGES, Follow, Hello, Hold, Probe
from raycam.viewer.files.sources import combine_models
from raycam.viewer.scene.edits import Edits
from raycam.viewer.session import MAX_STILL_SIZE, Session, View, lens_of
from raycam.viewer.session.copied import copied
from raycam.world.load import load_with_assumed_axis
from support.gltf_document import Document, animated
from support.patience import until
from support.raises import fault, raises
from support.session_messages import orbit, orbited, receive


@pytest.fixture
def session(small_world: raycam.World) -> Session:
    made = Session(small_world, small_world.camera("front"))
    receive(made, {"type": "size", "width": 96, "height": 64, "ratio": 1})
    return made


@pytest.mark.parametrize(
    ("width", "height", "ratio", "size"),
    [
        (96, 64, 1, (96, 64)),
        (300, 64, 1, (96, 64)),
        (48, 32, 2, (96, 64)),
        (10000, 10000, 10, (1600, 1067)),
        (1, 1, 0.1, (1, 1)),
    ],
)
def test_images_fill_the_window_with_the_aspect_ratio_of_the_camera(
    session: Session, width: int, height: int, ratio: float, size: tuple[int, int]
) -> None:
    receive(session, {"type": "size", "width": width, "height": height, "ratio": ratio})
    assert session.view.size == session.view.still_camera.size == size
    assert size <= MAX_STILL_SIZE


def test_move_starts_a_new_version_of_a_free_camera(session: Session) -> None:
    before, version = session.view.camera, session.images.version
    assert session.view.camera_name == "front"
    orbit(session, 5)
    assert session.view.camera != before
    assert session.view.camera.size == before.size
    assert np.allclose(session.view.camera.K, before.K)
    assert (session.images.version, session.view.camera_name, session.images.still) == (version + 1, "", None)


def test_move_of_the_pivot_alone_keeps_the_image_and_the_camera(session: Session) -> None:
    before, version = session.view.camera, session.images.version
    receive(session, {**orbited(session.view.camera_message(0), 0), "pivot": [1, 2, 3]})
    assert (session.view.camera, session.images.version) == (before, version)
    assert session.view.pivot.tolist() == [1, 2, 3]


def test_invalid_rotation_is_refused_and_the_camera_sent_again(session: Session) -> None:
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))
    before = session.view.camera
    with pytest.raises(raycam.CameraError):
        receive(session, {**orbited(session.view.camera_message(0), 5), "R": [1.0] * 9})
    assert session.view.camera == before
    assert np.array_equal([each for each in said if each["type"] == "camera"][-1]["C"], before.C)


def test_camera_message_follows_each_move(session: Session) -> None:
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))
    move = orbited(session.view.camera_message(0), 5)
    receive(session, move)
    (answer,) = [each for each in said if each["type"] == "camera"]
    assert (answer["seq"], answer["C"], answer["name"]) == (move["seq"], move["C"], "")
    assert answer["pose"]["location"] == move["C"]


def test_home_of_a_free_camera_returns_to_its_pose(small_world: raycam.World) -> None:
    camera = small_world.camera("front").at_pose(np.eye(3), [0, 0, -5])
    session = Session(small_world, camera)
    orbit(session, 50)
    assert session.view.camera != camera
    receive(session, {"type": "home", "seq": 1})
    assert session.view.camera == camera


def test_home_returns_to_the_initial_camera(session: Session) -> None:
    receive(session, {"type": "camera", "seq": 1, "name": "side"})
    receive(session, {"type": "home", "seq": 1})
    assert session.view.camera_name == "front"


def test_new_world_of_a_script_sends_a_welcome_message_with_its_names(session: Session) -> None:
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))
    session.welcome()
    receive(session, {"type": "edit", "kind": "object", "number": 0, "key": "scale", "value": 2.0})
    assert "welcome" not in [each["type"] for each in said]
    assert session.view.bounds[1][2] == pytest.approx(1.0)
    other = raycam.World()
    other.add_object(sphere={"radius": 3}, name="moon")
    other.add_camera(raycam.Camera.look_at([9, 0, 0], [0, 0, 0], size=(48, 32), fov=60), "orbiter")
    said.clear()
    session.view.opened.edits.replace(other)
    (welcome,) = [each for each in said if each["type"] == "welcome"]
    assert (welcome["cameras"], welcome["names"]["instance"]) == (["orbiter"], {0: "moon"})
    assert (session.view.camera_name, session.view.bounds[1][2]) == ("", pytest.approx(3.0))
    said.clear()
    receive(session, {"type": "undo"})
    assert [each["cameras"] for each in said if each["type"] == "welcome"] == [["front", "side"]]


def test_world_that_is_replaced_while_a_session_starts_is_shown(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    edits, other = Edits(small_world), raycam.World()
    other.add_object(sphere={"radius": 3}, name="moon")
    script = threading.Thread(target=lambda: edits.replace(other))
    start = View.start

    def start_slowly(*arguments: Any, **options: Any) -> View:
        view = start(*arguments, **options)
        script.start()
        script.join(0.5)  # the script's assignment either ends now, or waits for the session
        return view

    monkeypatch.setattr(View, "start", start_slowly)
    session = Session(edits)
    script.join()
    assert edits.world is other
    assert session.view.world is other


OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n"
STL = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0\nendloop\nendfacet\nendsolid\n"


@pytest.mark.parametrize(
    ("load", "axis"),
    [
        (lambda folder: raycam.load(folder / "a.obj"), "z"),
        (lambda folder: load_with_assumed_axis(folder / "a.obj"), "y"),
        (lambda folder: load_with_assumed_axis(folder / "a.stl"), "z"),
        (lambda folder: raycam.load(OBJ.encode(), kind="obj"), "z"),
        (lambda folder: combine_models([folder / "a.obj", folder / "a.stl"]), "z"),
        (lambda folder: raycam.load(folder / "a.obj", up="z"), None),
        (lambda folder: load_with_assumed_axis(folder / "a.obj", up="y"), None),
        (lambda folder: raycam.load(folder / "a.glb"), None),
        (lambda folder: combine_models([folder / "a.glb", folder / "a.stl"]), None),
        (lambda folder: raycam.World.from_dict({"object": [{"mesh": "a.obj"}]}, folder=folder), None),
    ],
)
def test_notice_names_the_up_axis_that_no_file_specifies(
    tmp_path: Path, load: Callable[[Path], raycam.World], axis: str | None
) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "a.stl").write_text(STL)
    raycam.load(tmp_path / "a.obj").to_gltf(tmp_path / "a.glb")
    view = Session(load(tmp_path)).view
    notice = view.up_notice()
    assert view.camera_message(0)["up_assumed"] == (axis is not None)
    assert (notice.code if notice else None) == ("assumed_up_axis" if axis else None)
    assert axis is None or f"{axis} is assumed" in str(notice)


def test_notice_about_the_up_axis_is_shown_until_the_user_chooses_an_axis(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    session = Session(raycam.load(tmp_path / "a.obj"))

    def is_shown() -> bool:
        return any(each.startswith("up axis") for each in session.about()["notices"])

    assert is_shown()
    receive(session, {"type": "edit", "kind": "object", "number": 0, "key": "scale", "value": 2.0})
    assert is_shown()
    receive(session, {"type": "up", "axis": "y"})
    assert not is_shown()
    assert session.view.camera_message(0)["up_assumed"] is False
    receive(session, {"type": "undo"})
    assert is_shown()


def test_selected_animation_is_shown_at_its_initial_pose(tmp_path: Path) -> None:
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}))
    animated(document, "translation", [0, 1], [[5, 0, 0], [6, 0, 0]], node=node)
    world = raycam.load(document.save(tmp_path / "m.glb"))
    first = Session(world, world.default_camera(), start={"animation": world.animations[0].name})
    shown = [np.asarray(each.matrix).tolist() for each in first.view.world.objects]
    assert shown == [
        np.asarray(each.matrix).tolist() for each in world.at(0.0, world.animations[0].name).objects
    ]
    assert shown != [np.asarray(each.matrix).tolist() for each in world.objects]


def test_camera_message_selects_a_camera_of_the_world(session: Session, small_world: raycam.World) -> None:
    receive(session, {"type": "camera", "seq": 1, "name": "side"})
    assert (session.view.camera, session.view.camera_name) == (small_world.camera("side"), "side")
    receive(session, {"type": "camera", "seq": 1, "name": ""})
    assert (session.view.camera, session.view.camera_name) == (small_world.camera("side"), "")
    with pytest.raises(raycam.WorldError):
        receive(session, {"type": "camera", "seq": 1, "name": "behind"})


def test_light_channel_and_display_settings_change_the_view(session: Session) -> None:
    version = session.images.version
    receive(session, {"type": "channel", "name": "depth"})
    receive(session, {"type": "display", "exposure": 1.5, "view": "agx"})
    assert (session.view.channel, session.view.exposure, session.view.transform, session.images.version) == (
        "depth",
        1.5,
        "agx",
        version,
    )
    receive(session, {"type": "quality", "integrator": "path"})
    assert (session.view.integrator, session.images.samples_of(session.view), session.images.version) == (
        "path",
        256,
        version + 1,
    )
    with raises(raycam.WorldError, code="unknown_name", mentions=["shadow"]):
        receive(session, {"type": "channel", "name": "shadow"})
    for name, anew in (("error", 1), ("error", 1), ("color", 2), ("depth", 2)):
        receive(session, {"type": "channel", "name": name})
        assert session.images.version == version + 1 + anew  # the channel `error` requires its own samples


def test_acknowledgements_count_images_that_were_sent(session: Session) -> None:
    for _ in range(5):
        session.connection.number_image()
    receive(session, {"type": "ack", "picture": 2**53})
    assert session.connection.acknowledged == 5
    receive(session, {"type": "ack", "picture": 1})
    assert session.connection.acknowledged == 5


def test_moving_camera_is_sent_once_for_each_image(session: Session) -> None:
    heard: list[tuple[str, Any]] = []
    session.connection.open(lambda message, _: heard.append((message["type"], message.get("C"))))
    for degrees in (1, 2, 3):
        receive(session, orbited(session.view.camera_message(0), degrees))
    assert [kind for kind, _ in heard].count("camera") == 1
    session.connection.send_image({"type": "picture", "moving": True}, [b""])
    cameras = [C for kind, C in heard if kind == "camera"]
    assert cameras[1:] == [session.view.camera_message(0)["C"]]  # the newest camera is sent before the image
    assert heard[-1][0] == "picture"
    receive(session, orbited(session.view.camera_message(0), 4))
    receive(session, {"type": "home", "seq": 99})
    session.connection.send_image({"type": "picture", "moving": True}, [b""])
    assert [C for kind, C in heard if kind == "camera"][2:] == [session.view.camera_message(0)["C"]]


def test_every_message_has_one_handler() -> None:
    handlers = [*Session.ACTIONS, *SLOW, Hello, Probe, Hold, Follow]
    assert len(handlers) == len(set(handlers))
    assert set(handlers) == set(MESSAGES.values())


def test_parts_of_a_session_have_at_most_15_attributes(session: Session) -> None:
    for part in (
        session,
        session.connection,
        session.images,
        session.view,
        session.view.opened,
        session.overlays,
    ):
        assert len(vars(part).keys() - {"bounds", "object_names", "still_camera"}) <= 15, type(part)


def test_session_starts_with_the_settings_of_the_world() -> None:
    world = raycam.World.from_dict(
        {"object": [{"box": {"size": 1}}], "render": {"integrator": "path", "exposure": 1, "view": "agx"}}
    )
    session = Session(world, world.default_camera())
    assert (
        session.view.integrator,
        session.view.exposure,
        session.view.transform,
        session.view.camera_name,
    ) == ("path", 1.0, "agx", "")
    assert session.welcome()["cameras"] == []


@pytest.mark.parametrize("format", ["python", "toml"])
def test_cameras_are_copied_with_all_digits(session: Session, format: str) -> None:
    orbit(session, 7)
    text = copied(session.view, format, session.images.samples_of(session.view), session.notify)
    if format == "python":
        names: dict[str, Any] = {"raycam": raycam}
        exec(text, names)
        assert names["camera"] == session.view.camera
    else:
        import tomllib

        assert raycam.Camera.from_dict(tomllib.loads(text)["camera"]) == session.view.camera


def test_time_and_variant_change_the_world_and_the_camera_of_a_video(small_world: raycam.World) -> None:
    description = {
        "object": [{"name": "box", "box": {"size": 1}}],
        "camera": {"size": [48, 32], "fov": 40, "location": [4, 0, 1], "target": [0, 0, 0]},
    }
    moving = raycam.World.from_dict(description)
    moving.set_video(fps=10, seconds=2, orbit={"target": [0, 0, 0]})
    session = Session(moving, next(iter(moving.cameras.values())))
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    version = session.images.version
    assert session.welcome()["time"] == {"now": 0.0, "seconds": 2.0, "animation": ""}
    receive(session, {"type": "time", "t": 1.0, "animation": ""})
    assert session.images.version == version + 1
    camera = next(iter(moving.cameras.values()))
    assert session.view.camera == moving.camera_at(camera, 1.0) != camera
    receive(session, {"type": "time", "t": 1e6, "animation": ""})
    assert session.view.time == 2.0
    for kind in ({"type": "time", "t": 0, "animation": "walk"}, {"type": "variant", "name": "red"}):
        with pytest.raises(raycam.WorldError):
            receive(session, kind)


def test_lens_message_changes_the_lens(session: Session) -> None:
    lens = lens_of(session.view.camera)
    assert (lens["model"], lens["distortion"], lens["names"]) == ("pinhole", [], [])
    receive(session, {"type": "lens", "fx": 50.0, "fy": 60.0, "cx": 20.0, "cy": 16.0, "distortion": []})
    assert session.view.camera.K.tolist() == [[50, 0, 20], [0, 60, 16], [0, 0, 1]]
    assert session.view.camera_name == ""
    session.show(
        session.view.with_camera(session.view.camera.replace(distortion=[0.1, 0, 0, 0], model="fisheye"))
    )
    assert lens_of(session.view.camera)["names"] == ["k1", "k2", "k3", "k4"]
    receive(session, {"type": "lens", "fx": 50, "fy": 60, "cx": 20, "cy": 16, "distortion": [0.2, 0.1, 0, 0]})
    assert session.view.camera.model == "fisheye"
    assert session.view.camera.distortion is not None
    assert session.view.camera.distortion.tolist() == [0.2, 0.1, 0, 0]
    with pytest.raises(raycam.Error):
        receive(session, {"type": "lens", "fx": 50, "fy": 60, "cx": 20, "cy": 16, "distortion": [0.2]})


@pytest.mark.parametrize("lens", ["pinhole", "fisheye"])
def test_copied_texts_describe_the_camera(session: Session, lens: str) -> None:
    import tomllib

    if lens == "fisheye":
        camera = session.view.camera.replace(distortion=[0.1, 0, 0, 0.25], model="fisheye")
        session.show(session.view.with_camera(camera))
    names: dict[str, Any] = {"raycam": raycam}
    exec(copied(session.view, "python", session.images.samples_of(session.view), session.notify), names)
    assert names["camera"] == session.view.camera
    table = tomllib.loads(
        copied(session.view, "toml", session.images.samples_of(session.view), session.notify)
    )["camera"]
    assert raycam.Camera.from_dict(table, up=session.view.camera.up) == session.view.camera
    session.show(session.view.with_camera(session.view.camera))
    command = copied(session.view, "command", session.images.samples_of(session.view), session.notify)
    assert "--size 96x64 --integrator direct --samples 64 --camera camera.toml" in command
    text = command.split("<<'EOF'\n")[1].split("EOF\n")[0]
    assert tomllib.loads(text)["camera"] == table


def test_initial_view_options_are_applied_and_checked() -> None:
    world = raycam.World.from_dict(
        {
            "object": [{"name": "box", "box": {"size": 1}}],
            "camera": {"size": [48, 32], "fov": 40, "location": [4, 0, 1], "target": [0, 0, 0]},
        }
    )
    world.set_video(fps=10, seconds=2, orbit={"target": [0, 0, 0]})
    camera = next(iter(world.cameras.values()))
    start = {"time": 0.5, "channel": "depth", "exposure": 2, "view": "agx", "variant": None}
    session = Session(world, camera, start=start)
    said = session.welcome()
    assert (said["channel"], said["exposure"], said["view"], said["time"]["now"]) == (
        "depth",
        2.0,
        "agx",
        0.5,
    )
    assert session.view.camera == world.camera_at(camera, 0.5) != camera
    for wrong, text in (
        ({"channel": "dept"}, fault("unknown_name", "'depth'")),
        ({"variant": "red"}, fault("unknown_name", "'red'")),
        ({"animation": "Run"}, fault("unknown_name", "'Run'")),
        ({"view": "agz"}, fault("unknown_name", "'agx'")),
        ({"exposure": float("nan")}, fault("out_of_range", "100")),
        ({"time": -1.0}, fault("out_of_range", "-1.0")),
        ({"time": 2.5}, fault("out_of_range", "2.5")),
    ):
        with raises(raycam.SettingsError, **text):
            raycam.view(world, block=False, browser=False, start=wrong)


def test_clicked_pixels_call_the_callback(
    small_world: raycam.World, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[dict[str, Any]] = []

    def fail(picked: dict[str, Any]) -> None:
        if len(told) == 1:
            raise ZeroDivisionError

    with raycam.view(small_world, block=False, browser=False) as viewer:
        assert viewer.on_pick(told.append) is not None
        viewer.on_pick(fail)
        session = viewer._session()
        width, height = session.view.size
        image = session.images.sent.add(session.view, session.images.version)
        for u, v in (
            (width // 2, height // 2),
            (0, 0),
            (1279, 1000),
        ):  # the last pixel is outside of the image
            receive(session, {"type": "pick", "image": image, "u": u, "v": v})
        until(lambda: len(told) == 2)
    seen = raycam.render(
        small_world, session.view.still_camera, channels=["position", "instance", "triangle"]
    )
    for picked in told:
        column, row = picked["pixel"]
        assert picked["camera"] == session.view.still_camera
        for name, array in seen.items():
            np.testing.assert_array_equal(picked[name], array[row, column])
    assert "ZeroDivisionError" in capsys.readouterr().err
