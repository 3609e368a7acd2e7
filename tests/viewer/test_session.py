"""Sessions: what a message changes, and the size of pictures."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.answers import SLOW
from raycam.viewer.messages import MESSAGES
from raycam.viewer.session import LARGEST, Session, lens_of
from support.gltf_document import Document, animated
from support.patience import until


@pytest.fixture
def session(small_world: raycam.World) -> Session:
    made = Session(small_world, small_world.camera("front"))
    made.receive({"type": "size", "width": 96, "height": 64, "ratio": 1})
    return made


def nav(kind: str, **changed: Any) -> dict[str, Any]:
    return {"type": "nav", "seq": 1, "kind": kind, "dx": 0, "dy": 0, "dz": 0, "u": 48, "v": 32, **changed}


@pytest.mark.parametrize(
    ("width", "height", "ratio", "size"),
    [
        (96, 64, 1, (96, 64)),
        (300, 64, 1, (96, 64)),
        (48, 32, 2, (96, 64)),
        (10000, 10000, 10, (1280, 853)),
        (1, 1, 0.1, (1, 1)),
    ],
)
def test_pictures_fill_the_space_with_the_sides_of_the_camera(
    session: Session, width: int, height: int, ratio: float, size: tuple[int, int]
) -> None:
    session.receive({"type": "size", "width": width, "height": height, "ratio": ratio})
    assert session.size == session.camera.size == size
    assert size <= LARGEST


@pytest.mark.parametrize("kind", ["orbit", "look", "pan", "move", "roll", "dolly", "fit"])
def test_moving_makes_a_new_version_of_a_free_camera(session: Session, kind: str) -> None:
    before, version = session.given, session.version
    assert session.name == "front"
    session.receive(nav(kind, dx=5, dy=3, dz=2))
    assert session.given != before
    assert session.given.size == before.size
    assert np.allclose(session.given.K, before.K)
    assert (session.version, session.name, session.still) == (version + 1, "", None)


def test_home_is_where_it_began(session: Session) -> None:
    before = session.given
    session.receive(nav("orbit", dx=50))
    session.receive(nav("home"))
    assert session.given == before


def test_the_pivot_is_the_point_under_the_pointer(session: Session, small_world: raycam.World) -> None:
    session.receive(nav("pivot"))
    origin, direction = session.camera.rays(np.array([48, 32]) + session.camera.corner)
    assert np.allclose(session.pivot, small_world.cast_rays(origin, direction)["position"])
    before = session.pivot
    session.receive(nav("pivot", u=0.0, v=-1e4))
    assert np.array_equal(session.pivot, before)


def test_coming_nearer_beside_everything_keeps_going(session: Session) -> None:
    session.receive(nav("move", dy=10000, dz=0))
    before = session.given.C
    session.receive(nav("dolly", dz=3, u=1, v=1))
    assert np.isfinite(session.given.C).all()
    assert not np.allclose(session.given.C, before)


def test_parallel_rays_see_things_larger(small_world: raycam.World) -> None:
    camera = raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], size=(48, 32), height=4)
    session = Session(small_world, camera)
    place = np.array([50.0, 20.0])
    before, _ = session.camera.rays(place + session.camera.corner)
    session.receive(nav("dolly", dz=2, u=place[0], v=place[1]))
    assert np.allclose(session.camera.project(before)[0] - session.camera.corner, place)
    assert np.allclose(session.given.K[:2, :2], 1.15**2 * camera.K[:2, :2])
    assert (session.given.is_parallel, session.given.size) == (True, camera.size)
    session.receive(nav("fit"))
    low, high = small_world.bounds if small_world.bounds is not None else ([], [])
    corners = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    pixels, _ = session.camera.project(corners)
    assert (pixels >= session.camera.corner).all()
    assert (pixels < np.array(session.size)).all()
    assert np.ptp(pixels, axis=0).max() > 0.5 * min(session.size)


def test_the_object_under_the_pointer_is_framed(session: Session, small_world: raycam.World) -> None:
    width, height = session.size
    session.receive(nav("frame", u=width / 2, v=height / 2))
    assert np.allclose(session.pivot, [0, 0, 0])  # the box's middle
    pixels, _ = session.camera.project(small_world.triangles(0).reshape(-1, 3))
    assert (pixels > 0).all()
    assert (pixels < np.array(session.size)).all()
    session.receive(nav("frame", u=width - 1.0, v=0.0))  # nothing is there: the whole world
    assert np.allclose(session.pivot, np.mean(small_world.bounds, axis=0))


def test_home_is_the_camera_that_it_began_with(session: Session) -> None:
    session.receive({"type": "camera", "name": "side"})
    session.receive(nav("home"))
    assert session.name == "front"


def test_another_world_of_a_script_is_told_with_all_its_names(session: Session) -> None:
    said: list[dict[str, Any]] = []
    session.send = lambda message, buffers: said.append(message)
    session.welcome()
    session.receive({"type": "edit", "kind": "object", "number": 0, "key": "scale", "value": 2.0})
    assert "welcome" not in [each["type"] for each in said]
    assert session.bounds[1][2] == pytest.approx(1.0)
    other = raycam.World()
    other.add_object(sphere={"radius": 3}, name="moon")
    other.add_camera(raycam.Camera.look_at([9, 0, 0], [0, 0, 0], size=(48, 32), fov=60), "orbiter")
    said.clear()
    session.edits.replace(other)
    (welcome,) = [each for each in said if each["type"] == "welcome"]
    assert (welcome["cameras"], welcome["names"]["instance"]) == (["orbiter"], {0: "moon"})
    assert (session.name, session.bounds[1][2]) == ("", pytest.approx(3.0))
    said.clear()
    session.receive({"type": "undo"})
    assert [each["cameras"] for each in said if each["type"] == "welcome"] == [["front", "side"]]


def test_an_animation_begins_with_its_own_pose(tmp_path: Path) -> None:
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}))
    animated(document, "translation", [0, 1], [[5, 0, 0], [6, 0, 0]], node=node)
    world = raycam.load(document.save(tmp_path / "m.glb"))
    first = Session(world, world.default_camera(), start={"animation": world.animations[0].name})
    shown = [np.asarray(each.matrix).tolist() for each in first.world.objects]
    assert shown == [
        np.asarray(each.matrix).tolist() for each in world.at(0.0, world.animations[0].name).objects
    ]
    assert shown != [np.asarray(each.matrix).tolist() for each in world.objects]


def test_cameras_of_the_world_are_looked_through(session: Session, small_world: raycam.World) -> None:
    session.receive({"type": "camera", "name": "side"})
    assert (session.given, session.name) == (small_world.camera("side"), "side")
    session.receive({"type": "camera", "name": ""})
    assert (session.given, session.name) == (small_world.camera("side"), "")
    with pytest.raises(raycam.WorldError):
        session.receive({"type": "camera", "name": "behind"})


def test_light_channel_and_display(session: Session) -> None:
    version = session.version
    session.receive({"type": "channel", "name": "depth"})
    session.receive({"type": "display", "exposure": 1.5, "view": "agx"})
    assert (session.channel, session.exposure, session.view, session.version) == (
        "depth",
        1.5,
        "agx",
        version,
    )
    session.receive({"type": "quality", "integrator": "path"})
    assert (session.integrator, session.most_samples(), session.version) == ("path", 256, version + 1)
    with pytest.raises(raycam.WorldError, match="shadow"):
        session.receive({"type": "channel", "name": "shadow"})
    for name, anew in (("error", 1), ("error", 1), ("color", 2), ("depth", 2)):
        session.receive({"type": "channel", "name": name})
        assert session.version == version + 1 + anew  # the error takes samples of its own


def test_acknowledgements_are_of_pictures_that_were_sent(session: Session) -> None:
    session.sent = 5
    session.receive({"type": "ack", "picture": 2**53})
    assert session.acknowledged == 5
    session.receive({"type": "ack", "picture": 1})
    assert session.acknowledged == 5


def test_every_message_is_for_the_session_or_the_server(session: Session) -> None:
    for kind in MESSAGES.keys() - {"hello", "probe", *SLOW, "nav", "camera", "upload"}:
        example = {"name": "depth", "exposure": 0.0, "view": "standard", "integrator": "direct", "picture": 0}
        more = {
            "t": 0,
            "animation": "",
            "fx": 50,
            "fy": 50,
            "cx": 24,
            "cy": 16,
            "distortion": [],
            "cameras": True,
            "grid": True,
            "explained": True,
            "tool": "none",
            "handle": "x",
            "stroke": 1,
            "begin": [1, 1],
            "end": [2, 2],
            "location": [1, 2, 3],
            "roll": 0,
            "pitch": 0,
            "yaw": 0,
            "u": 1,
            "v": 1,
        }
        with contextlib.suppress(raycam.Error):  # there is no variant, no edit and nothing to undo
            edit = {"kind": "object", "number": 9, "key": "visible", "value": True}
            session.receive(
                {
                    "width": 9,
                    "height": 6,
                    "ratio": 1,
                    "visible": True,
                    **example,
                    **more,
                    **edit,
                    "type": kind,
                }
            )


def test_settings_of_the_world_are_where_it_begins() -> None:
    world = raycam.World.from_dict(
        {"object": [{"box": {"size": 1}}], "render": {"integrator": "path", "exposure": 1, "view": "agx"}}
    )
    session = Session(world, world.default_camera())
    assert (session.integrator, session.exposure, session.view, session.name) == ("path", 1.0, "agx", "")
    assert session.welcome()["cameras"] == []


@pytest.mark.parametrize("format", ["python", "toml"])
def test_cameras_are_copied_with_all_digits(session: Session, format: str) -> None:
    session.receive(nav("orbit", dx=7, dy=3))
    text = session.copied(format)
    if format == "python":
        names: dict[str, Any] = {"raycam": raycam}
        exec(text, names)
        assert names["camera"] == session.given
    else:
        import tomllib

        assert raycam.Camera.from_dict(tomllib.loads(text)["camera"]) == session.given


def test_time_and_variant_change_the_world_and_the_camera_of_a_video(small_world: raycam.World) -> None:
    description = {
        "object": [{"name": "box", "box": {"size": 1}}],
        "camera": {"size": [48, 32], "fov": 40, "location": [4, 0, 1], "target": [0, 0, 0]},
    }
    moving = raycam.World.from_dict(description)
    moving.set_video(fps=10, seconds=2, orbit={"target": [0, 0, 0]})
    session = Session(moving, next(iter(moving.cameras.values())))
    session.receive({"type": "size", "width": 48, "height": 32, "ratio": 1})
    version = session.version
    assert session.welcome()["time"] == {"now": 0.0, "seconds": 2.0, "animation": ""}
    session.receive({"type": "time", "t": 1.0, "animation": ""})
    assert session.version == version + 1
    camera = next(iter(moving.cameras.values()))
    assert session.given == moving.camera_at(camera, 1.0) != camera
    session.receive({"type": "time", "t": 1e6, "animation": ""})
    assert session.time == 2.0
    for kind in ({"type": "time", "t": 0, "animation": "walk"}, {"type": "variant", "name": "red"}):
        with pytest.raises(raycam.WorldError, match="there is no"):
            session.receive(kind)


def test_the_lens_is_changed_by_numbers(session: Session) -> None:
    lens = lens_of(session.given)
    assert (lens["model"], lens["distortion"], lens["names"]) == ("pinhole", [], [])
    session.receive({"type": "lens", "fx": 50.0, "fy": 60.0, "cx": 20.0, "cy": 16.0, "distortion": []})
    assert session.given.K.tolist() == [[50, 0, 20], [0, 60, 16], [0, 0, 1]]
    assert session.name == ""
    session.given = session.given.replace(distortion=[0.1, 0, 0, 0], model="fisheye")
    assert lens_of(session.given)["names"] == ["k1", "k2", "k3", "k4"]
    session.receive({"type": "lens", "fx": 50, "fy": 60, "cx": 20, "cy": 16, "distortion": [0.2, 0.1, 0, 0]})
    assert session.given.model == "fisheye"
    assert session.given.distortion is not None
    assert session.given.distortion.tolist() == [0.2, 0.1, 0, 0]
    with pytest.raises(raycam.Error):
        session.receive({"type": "lens", "fx": 50, "fy": 60, "cx": 20, "cy": 16, "distortion": [0.2]})


@pytest.mark.parametrize("lens", ["pinhole", "fisheye"])
def test_what_is_copied_is_the_camera(session: Session, lens: str) -> None:
    import tomllib

    if lens == "fisheye":
        session.given = session.given.replace(distortion=[0.1, 0, 0, 0.25], model="fisheye")
    names: dict[str, Any] = {"raycam": raycam}
    exec(session.copied("python"), names)
    assert names["camera"] == session.given
    table = tomllib.loads(session.copied("toml"))["camera"]
    assert raycam.Camera.from_dict(table, up=session.given.up) == session.given
    session.name = ""
    command = session.copied("command")
    assert "--size 96x64 --integrator direct --samples 64 --camera camera.toml" in command
    text = command.split("<<'EOF'\n")[1].split("EOF\n")[0]
    assert tomllib.loads(text)["camera"] == table


def test_what_is_shown_first_is_chosen_and_checked() -> None:
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
    assert session.given == world.camera_at(camera, 0.5) != camera
    for wrong, text in (
        ({"channel": "dept"}, "did you mean 'depth'"),
        ({"variant": "red"}, "unknown variant 'red'"),
        ({"animation": "Run"}, "unknown animation 'Run'"),
        ({"view": "agz"}, "did you mean 'agx'"),
        ({"exposure": float("nan")}, "exposure is nan"),
        ({"time": -1.0}, "time is -1.0"),
        ({"time": 2.5}, "no time 2.5 s: what moves in it lasts 2 s"),
    ):
        with pytest.raises(raycam.SettingsError, match=text):
            raycam.view(world, block=False, browser=False, start=wrong)


def test_clicked_pixels_are_told(small_world: raycam.World, capsys: pytest.CaptureFixture[str]) -> None:
    told: list[dict[str, Any]] = []

    def fail(picked: dict[str, Any]) -> None:
        if len(told) == 1:
            raise ZeroDivisionError

    with raycam.view(small_world, block=False, browser=False) as viewer:
        assert viewer.on_pick(told.append) is not None
        viewer.on_pick(fail)
        session = viewer._session()
        width, height = session.size
        for u, v in ((width // 2, height // 2), (0, 0), (1279, 1000)):  # the last one is not in the picture
            session.receive({"type": "pick", "u": u, "v": v})
        until(lambda: len(told) == 2)
    seen = raycam.render(small_world, session.camera, channels=["position", "instance", "triangle"])
    for picked in told:
        column, row = picked["pixel"]
        assert picked["camera"] == session.camera
        for name, array in seen.items():
            np.testing.assert_array_equal(picked[name], array[row, column])
    assert "ZeroDivisionError" in capsys.readouterr().err
