"""Texts copied from the live view; the copied command renders the displayed image."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import cli
from raycam.viewer.answers import answer
from raycam.viewer.client_messages import Copy
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.gltf_document import variant_square
from support.session_messages import orbit, receive

WORLD = """[render]
exposure = 0.5
[[object]]
name = "box"
box = { size = 1 }
color = "#c83c28"
[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]
[[camera]]
name = "-first; one"
location = [4, -4, 3]
target = [0, 0, 0]
size = [48, 32]
fov = 40
[[camera]]
name = "wide"
location = [2, -2, 1]
target = [0, 0, 0]
size = [32, 32]
focal = 12
lens = "fisheye"
distortion = [0.05, -0.01, 0, 0]
[video]
fps = 10
seconds = 2
orbit = { target = [0, 0, 0] }
"""
ORBIT = {"type": "orbit"}
LATER = {"type": "time", "t": 0.75, "animation": ""}
DISPLAY = {"type": "display", "exposure": -1.0, "view": "agx"}


def tell(session: Session, said: dict[str, Any]) -> None:
    """Passes a message to the session; `ORBIT` turns the camera as the client does."""
    if said is ORBIT:
        orbit(session, 14)
    else:
        receive(session, said)


def copied_command(session: Session) -> tuple[str, list[str]]:
    """The command and its notices."""
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))
    answer(session, Copy("command"))
    return said[-1]["text"], [each["text"] for each in said if each["type"] == "notice"]


def assert_gives_what_is_seen(session: Session, folder: Path) -> None:
    command, said = copied_command(session)
    assert said == []
    line = command.replace("raycam render", f"{shlex.quote(sys.executable)} -m raycam render")
    path = os.pathsep.join([str(Path(raycam.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        ["sh", "-e", "-c", line],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (command, done.stderr)
    shown = raycam.render(
        session.view.world,
        session.view.still_camera,
        integrator=session.view.integrator,
        samples=session.images.samples_of(session.view),
    ).to_srgb8(session.view.exposure, session.view.transform)
    with Image.open(folder / "picture.png") as image:
        rendered = np.asarray(image).astype(int)
    # A camera turned back to the start of an orbit differs in the last digits, so an edge may move by a pixel.
    assert np.mean((np.abs(rendered - shown) > 1).any(axis=-1)) < 0.002


@pytest.mark.parametrize("camera", ["-first; one", "wide"])
@pytest.mark.parametrize("said", [[], [ORBIT], [LATER], [LATER, ORBIT, DISPLAY]])
def test_copied_command_renders_the_displayed_image(
    tmp_path: Path, camera: str, said: list[dict[str, Any]]
) -> None:
    path = tmp_path / "a world.toml"
    path.write_text(WORLD)
    world = raycam.load(path)
    session = Session(world, world.camera(camera), samples=2, title=path.name, source=path)
    receive(session, {"type": "size", "width": 60, "height": 40, "ratio": 1})
    for each in said:
        tell(session, each)
    assert_gives_what_is_seen(session, tmp_path)


def test_copied_command_gives_a_notice_if_the_video_places_the_camera(tmp_path: Path) -> None:
    path = tmp_path / "w.toml"
    poses = [f"{{ time = {t}, target = [0, 0, 0], location = [{4 - t}, {t}, 1] }}" for t in (0, 2)]
    keys = f"keyframe = [{', '.join(poses)}]"
    path.write_text(WORLD.replace("orbit = { target = [0, 0, 0] }", keys))
    world = raycam.load(path)
    session = Session(world, world.camera("wide"), samples=2, source=path)
    for said in (LATER, ORBIT):
        tell(session, said)
    (text,) = copied_command(session)[1]
    assert "0.75 s" in text


@pytest.mark.filterwarnings("ignore::raycam.Notice")
def test_copied_command_contains_the_variant(tmp_path: Path) -> None:
    path = variant_square().save(tmp_path / "v.glb")
    world = raycam.load(path)
    session = Session(world, world.default_camera((48, 32)), samples=2, source=path)
    receive(session, {"type": "variant", "name": world.variants[0]})
    assert_gives_what_is_seen(session, tmp_path)


def test_copied_command_lists_omitted_changes(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"), title="of a script")
    receive(session, {"type": "edit", "kind": "object", "number": 0, "key": "scale", "value": 2.0})
    command, said = copied_command(session)
    assert shlex.split(command)[2:4] == ["of a script", "-o"]
    assert ["edits" in said[0], "file" in said[1]] == [True, True]


def test_cameras_of_another_file_are_listed_and_written_by_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "w.toml").write_text(WORLD)
    table = (
        '[[camera]]\nname = "added"\nlocation = [0, -5, 1]\ntarget = [0, 0, 0]\nsize = [32, 24]\nfov = 50\n'
    )
    (tmp_path / "more.toml").write_text(table)
    matrix = "!!opencv-matrix {rows: 3, cols: 3, dt: d, data: [30., 0., 16., 0., 30., 12., 0., 0., 1.]}"
    (tmp_path / "k.yaml").write_text(
        f"%YAML:1.0\n---\nimage_width: 32\nimage_height: 24\ncamera_matrix: {matrix}\n"
    )
    monkeypatch.chdir(tmp_path)
    sessions: list[Session] = []
    monkeypatch.setattr(Viewer, "wait", lambda viewer, **options: sessions.append(viewer._session()))
    for file in ("more.toml", "k.yaml"):
        assert (
            cli.main(["view", "w.toml", "--no-browser", "--port", "0", "--samples", "2", "--cameras", file])
            == 0
        )
    listed, unposed = (each.welcome()["cameras"] for each in sessions)
    assert listed == ["-first; one", "wide", "added"]
    assert len(unposed) == 3
    assert "without a pose" in capsys.readouterr().err
    receive(sessions[0], {"type": "camera", "seq": 1, "name": "added"})
    assert_gives_what_is_seen(sessions[0], tmp_path)
