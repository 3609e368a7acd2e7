"""Worlds changed in a browser by dragging handles and dropping files.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.gizmo import handles
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.viewer_page import Place, drag, held, opened, place_of, readout, text_of

pytestmark = pytest.mark.proof
SAMPLES = 4
SIZE = (48, 32)
DONE = f"document.getElementById('status').textContent.includes('{SAMPLES} samples')"
WORLD = """[[object]]
name = "wedge"
category = "part"
mesh = "wedge.obj"

[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]

[camera]
location = [3, -3, 2]
target = [0.3, 0.3, 0.2]
size = [48, 32]
fov = 40
"""
MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

Serve = Callable[..., Server]


@pytest.fixture
def serve(small_world: raycam.World) -> Iterator[Serve]:
    """Starts a server that shows the small world."""
    made: list[Server] = []

    def start(*, allows_open: bool = False) -> Server:
        camera = small_world.camera("front")
        new = lambda: Session(  # noqa: E731
            small_world, camera, samples=SAMPLES, title="small", allows_open=allows_open
        )
        made.append(Server(new, port=0))
        return made[-1]

    yield start
    for each in made:
        each.close()


def rest(tab: Tab, session: Session) -> None:
    """Waits for the last sample of the current view."""
    until(
        lambda: (
            not session.images.is_moving
            and session.images.still is not None
            and session.connection.sent == session.connection.acknowledged
        ),
        "no picture of the last change",
    )
    tab.wait(DONE)


def matrix_of(session: Session) -> np.ndarray:
    return np.array(session.view.base.objects[0].matrix)


def place_on_handle(tab: Tab, session: Session, handle: str) -> Place:
    """The window position of the end of a handle of the first object."""
    found = handles(matrix_of(session), np.zeros(3), session.view.still_camera, session.selection.tool)
    (lines,) = (each["lines"] for each in found if each["handle"] == handle)
    # The circles of two axes meet at every quarter turn: an eighth of a turn lies on one circle only.
    u, v = lines[0][len(lines[0]) // 8 if session.selection.tool == "turn" else -1]
    return place_of(tab, u - 0.5, v - 0.5, session.view.size)


# The gizmo ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("key", "tool"), [("g", "move"), ("r", "turn"), ("s", "scale")])
def test_handle_drag_is_one_step_of_undo(
    tab: Tab, serve: Serve, key: str, tool: str, small_world: raycam.World
) -> None:
    session = opened(tab, serve(), SAMPLES)
    before, image = matrix_of(session), truth(session)
    camera = session.view.camera
    tab.press(key)
    tab.wait("document.querySelector('[data-tool][aria-pressed=true]').dataset.tool !== 'none'")
    tab.evaluate("new Promise((done) => setTimeout(done, 300))")
    x, y = place_on_handle(tab, session, "x")
    drag(tab, (x, y), (x + 60, y + 35), steps=12)
    tab.wait("!document.getElementById('undo').disabled")
    rest(tab, session)
    after = matrix_of(session)
    assert session.view.camera == camera, "the drag turned the camera"
    moved, linear = after[:3, 3] - before[:3, 3], after[:3, :3]
    if tool == "move":
        assert abs(moved[0]) > 0.05
        assert np.allclose(moved[1:], 0)
        assert np.array_equal(linear, before[:3, :3])
    elif tool == "turn":
        assert np.allclose(linear @ linear.T, np.eye(3))
        assert np.allclose(linear[:, 0], [1, 0, 0])
        assert not np.allclose(linear, np.eye(3), atol=0.02)
    else:
        lengths = np.linalg.norm(linear, axis=0)
        assert abs(lengths[0] - 1) > 0.05
        assert np.allclose(lengths[1:], 1)
    assert (truth(session) != image).any(), "the picture shows nothing of it"
    assert np.array_equal(matrix_of(session), np.array(session.view.world.objects[0].matrix))
    assert np.array_equal(np.array(small_world.objects[0].matrix), before), "the script's world was changed"
    assert session.view.opened.edits.about()["undo"] == 1, "a drag is one step"
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="z", modifiers=2)
    tab.call("Input.dispatchKeyEvent", type="keyUp", key="z", modifiers=2)
    tab.wait("document.getElementById('undo').disabled && !document.getElementById('redo').disabled")
    assert np.array_equal(matrix_of(session), before)
    rest(tab, session)
    tab.evaluate("document.getElementById('redo').click()")
    tab.wait("document.getElementById('redo').disabled")
    assert np.array_equal(matrix_of(session), after)
    assert tab.said == []


def truth(session: Session) -> np.ndarray:
    """The channel `distance` of the displayed image."""
    return np.array(
        raycam.render(session.view.world, session.view.still_camera, channels="depth", samples=1)["depth"]
    )


def test_drag_outside_of_the_handles_turns_the_camera(tab: Tab, serve: Serve) -> None:
    session = opened(tab, serve(), SAMPLES)
    before, camera = matrix_of(session), session.view.camera
    tab.press("g")
    tab.wait("document.querySelector('[data-tool=move]').ariaPressed === 'true'")
    x, y = place_of(tab, 3, 3, SIZE)
    drag(tab, (x, y), (x + 60, y + 35))
    rest(tab, session)
    assert session.view.camera != camera
    assert np.array_equal(matrix_of(session), before)
    assert session.view.opened.edits.about()["undo"] == 0
    tab.wait("!document.getElementById('undo').disabled")
    tab.evaluate("document.getElementById('undo').click()")
    until(lambda: session.view.camera == camera)
    tab.wait("document.getElementById('undo').disabled && !document.getElementById('redo').disabled")


def test_values_of_a_moved_object_belong_to_its_new_position(tab: Tab, serve: Serve) -> None:
    session = opened(tab, serve(), SAMPLES)
    tab.press("g")
    tab.evaluate("new Promise((done) => setTimeout(done, 300))")
    x, y = place_on_handle(tab, session, "z")
    drag(tab, (x, y), (x, y - 50), steps=8)
    tab.wait("!document.getElementById('undo').disabled")
    rest(tab, session)
    seen = raycam.render(
        session.view.base, session.view.still_camera, channels=["position", "instance"], samples=1
    )
    rows, columns = np.nonzero(seen["instance"] == 0)
    middle = len(rows) // 2
    tab.click(*place_of(tab, columns[middle], rows[middle], session.view.size))
    tab.wait("document.querySelectorAll('#values tr').length >= 17")
    column, row = held(tab)
    assert seen["instance"][row, column] == 0
    assert np.array(readout(tab)["position"], np.float64).tolist() == seen["position"][row, column].tolist()


# Files ----------------------------------------------------------------------------------------------------


def files(folder: Path) -> list[Path]:
    """A world file and its mesh."""
    paths = [folder / "dropped.toml", folder / "wedge.obj"]
    for path, text in zip(paths, (WORLD, MESH), strict=True):
        path.write_text(text)
    return paths


def test_dropped_files_are_opened_with_allow_open(tab: Tab, serve: Serve, tmp_path: Path) -> None:
    session = opened(tab, serve(allows_open=True), SAMPLES)
    paths = files(tmp_path)
    tab.drop(*place_of(tab, 24, 16, SIZE), paths)
    tab.wait("document.getElementById('title').textContent === 'dropped.toml'")
    tab.wait("document.getElementById('about').textContent.includes('1 object, 4 triangles')")
    rest(tab, session)
    expected = raycam.load(paths[0])
    assert session.view.base.objects[0].name == "wedge"
    width, height = session.view.size
    tab.click(*place_of(tab, width // 2, height // 2, (width, height)))
    tab.wait("document.querySelectorAll('#values tr').length >= 17")
    column, row = held(tab)
    frame = raycam.render(expected, session.view.still_camera, channels=["position", "depth"], samples=1)
    assert readout(tab)["depth"] == [str(frame["depth"][row, column])]
    assert tab.said == []


def test_dropped_files_are_refused_without_allow_open(
    tab: Tab, serve: Serve, tmp_path: Path, small_world: raycam.World
) -> None:
    session = opened(tab, serve(), SAMPLES)
    version = session.images.version
    tab.drop(*place_of(tab, 24, 16, SIZE), files(tmp_path))
    tab.wait("document.getElementById('message').textContent.includes('--allow-open')")
    assert session.view.base is small_world
    assert session.images.version == version
    assert session.uploads._folder is None
    assert text_of(tab, "title") == "small"
    assert tab.evaluate("location.protocol") == "http:", "the browser went to the file"


@pytest.mark.parametrize(
    ("name", "text", "word"),
    [
        ("broken.toml", WORLD.replace("sun", "sunn"), "sunn"),
        ("cut.glb", "glTF", "glb"),
        ("notes.txt", "hello", "No world found in these files"),
        ("far.toml", WORLD.replace("wedge.obj", "../../etc/passwd"), "passwd"),
    ],
)
def test_invalid_dropped_files_show_an_error_and_keep_the_view(
    tab: Tab, serve: Serve, tmp_path: Path, small_world: raycam.World, name: str, text: str, word: str
) -> None:
    session = opened(tab, serve(allows_open=True), SAMPLES)
    path = tmp_path / name
    path.write_text(text)
    tab.drop(*place_of(tab, 24, 16, SIZE), [path])
    # Excludes the notice that the file was received, which also contains the file's name.
    tab.wait("document.getElementById('message').classList.contains('error')")
    tab.wait(f"document.getElementById('message').textContent.includes('{word}')")
    tab.wait("!document.getElementById('message').hidden")
    assert session.view.base is small_world
    x, y = place_of(tab, 24, 16, SIZE)
    camera = session.view.camera
    for _ in itertools.repeat(None, 2):
        drag(tab, (x, y), (x + 40, y))
    rest(tab, session)
    assert session.view.camera != camera, "the view moves no more"
