"""Use of the live view in a browser.

Flight, lenses, time, light, files, reloads and foreign pages are checked. Requires Chromium: `make proof`.
"""

from __future__ import annotations

import http.server
import itertools
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer.files import film
from raycam.viewer.scheduler import Scheduler
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.gltf_document import Document, animated, variant_square
from support.patience import until
from support.session_messages import receive
from support.viewer_page import opened, place_of, text_of

pytestmark = pytest.mark.proof
SAMPLES = 4
DONE = f"document.getElementById('status').textContent.includes('{SAMPLES} samples')"
WORLD = """[[object]]
name = "ball"
sphere = { radius = 1 }
color = "#c83c28"
location = [0, 0, 1]

[[object]]
name = "floor"
plane = { size = [12, 12] }

[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]

[[camera]]
name = "plain"
location = [5, -5, 4]
target = [0, 0, 0.6]
size = [96, 64]
fov = 45

[[camera]]
name = "wide"
location = [2, -3, 3]
target = [0, 0, 0.6]
size = [96, 64]
focal = 40
lens = "fisheye"
distortion = [0.05, -0.01, 0.002, 0]

[video]
fps = 10
seconds = 2
interpolation = "linear"
keyframe = [{ time = 0, object = "ball", location = [0, 0, 1] }, { time = 2, object = "ball", location = [2, 0, 1] }]
"""

# A page of another origin tries to open the socket, to read and run the script, and to embed the page.
TRY = """(async () => {
  const [base, token] = ["%s", %s];
  const socket = await new Promise((done) => {
    const made = new WebSocket(`ws://${base}/socket`, ["raycam.view.1", `token.${token}`]);
    made.onopen = () => done("open");
    made.onerror = () => done("refused");
  });
  const read = await fetch(`http://${base}/client.js`).then(() => "read", () => "refused");
  const load = (kind, src) => new Promise((done) => {
    const made = Object.assign(document.createElement(kind), { src });
    made.onload = () => done("loaded");
    made.onerror = () => done("refused");
    document.body.append(made);
  });
  const script = await load("script", `http://${base}/client.js`);
  await load("iframe", `http://${base}/`);
  return { socket, read, script };
})()"""


@pytest.fixture
def world(tmp_path: Path) -> raycam.World:
    path = tmp_path / "w.toml"
    path.write_text(WORLD)
    return raycam.load(path)


@pytest.fixture
def live(world: raycam.World) -> Iterator[Server]:
    camera = world.camera("plain")
    made = Server(lambda: Session(world, camera, samples=SAMPLES, title="w"), port=0)
    yield made
    made.close()


def rest(tab: Tab, session: Session) -> None:
    """Waits for the last sample of the current view."""
    until(lambda: not session.images.is_moving and session.images.still is not None)
    until(
        lambda: (
            session.images.refinement_of(session.view).samples >= SAMPLES
            and session.connection.sent == session.connection.acknowledged
        )
    )
    tab.wait(DONE)


def on_the_screen(tab: Tab, size: tuple[int, int]) -> list[np.ndarray]:
    """Crops of the screen that may be the displayed image at 1:1.

    The crops differ by one pixel, because the image's centre may be rounded in either direction.
    """
    tab.evaluate("document.getElementById('one-to-one').click()")
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    data = tab.evaluate(
        "(() => { const c = document.getElementById('picture');"
        "return [c.width, ...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]; })()"
    )
    screen = np.array(data[1:], np.uint8).reshape(-1, data[0], 4)[..., :3].astype(int)
    left, top = (screen.shape[1] - size[0]) // 2, (screen.shape[0] - size[1]) // 2
    near = itertools.product(range(max(top - 1, 0), top + 2), range(max(left - 1, 0), left + 2))
    return [screen[y : y + size[1], x : x + size[0]] for y, x in near]


def test_click_calls_the_callback_of_the_script(tab: Tab, world: raycam.World) -> None:
    told: list[dict[str, Any]] = []
    with raycam.view(
        world, world.camera("plain"), samples=SAMPLES, block=False, browser=False, port=0
    ) as viewer:
        viewer.on_pick(told.append)
        tab.open(viewer.url)
        tab.wait(DONE)
        assert viewer._server is not None
        (session,) = viewer._server.sessions.values()
        x, y = place_of(tab, 240, 180, session.view.size)
        for kind in ("mousePressed", "mouseReleased"):
            tab.mouse(kind, x, y, button="left", clickCount=1)
        until(lambda: len(told) == 1)
        seen = raycam.render(world, session.view.still_camera, channels="instance")["instance"]
    (picked,) = told
    assert picked["pixel"] == (240, 180)
    assert picked["instance"] == seen[180, 240]


def test_page_starts_with_the_given_options(tab: Tab, world: raycam.World) -> None:
    start = {"channel": "depth", "exposure": 1.5, "view": "agx", "time": 0.5}
    server = Server(lambda: Session(world, world.camera("plain"), samples=SAMPLES, start=start), port=0)
    try:
        tab.open(server.url)
        tab.wait("document.getElementById('channel').value === 'depth'")
        (session,) = server.sessions.values()
        until(lambda: session.images.is_shown("depth"))
        assert (session.view.channel, session.view.exposure, session.view.transform, session.view.time) == (
            "depth",
            1.5,
            "agx",
            0.5,
        )
        assert tab.evaluate("document.getElementById('time').value") == "0.5"
    finally:
        server.close()


def test_view_through_a_distorted_lens_equals_render(tab: Tab, live: Server, world: raycam.World) -> None:
    tab.show(700, 360)
    session = opened(tab, live, SAMPLES)
    tab.press("c")
    until(lambda: session.view.camera_name == "wide")
    rest(tab, session)
    assert session.view.camera == world.camera("wide")
    expected = raycam.render(
        world,
        session.view.still_camera,
        samples=SAMPLES,
        integrator="direct",
        channels=["color", "alpha", "coverage"],
    )
    shown = on_the_screen(tab, session.view.size)
    same = [
        np.abs(each - expected.to_srgb8().astype(int)).mean()
        for each in shown
        if each.shape == (*session.view.size[::-1], 3)
    ]
    assert min(same) <= 2  # the tolerance for JPEG compression
    tab.show(1280, 800)


def test_fly_keys_move_the_camera_forward(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    before = session.view.camera
    tab.evaluate("document.getElementById('picture').focus()")
    tab.press("n")
    tab.wait("document.getElementById('message').textContent.startsWith('Fly')")
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW")
    until(lambda: session.view.camera != before)
    tab.call("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    rest(tab, session)
    way = session.view.camera.location - before.location
    assert way @ before.forward == pytest.approx(np.linalg.norm(way))
    assert np.array_equal(session.view.camera.R, before.R)


def test_walking_keeps_the_camera_height_above_the_ground(
    tab: Tab, live: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = opened(tab, live, SAMPLES)
    before = session.view.camera.location
    tab.evaluate("document.getElementById('picture').focus()")
    for said in ("Fly", "Walk"):
        tab.press("n")
        tab.wait(f"document.getElementById('message').textContent.startsWith('{said}')")
    x, y = place_of(tab, 240, 180, session.view.size)
    tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-100)
    tab.wait("document.getElementById('message').textContent === 'Speed: 1.3 times.'")
    assert np.array_equal(session.view.camera.location, before)
    places, show = [before], session.show
    monkeypatch.setattr(session, "show", lambda view: (places.append(view.camera.location), show(view)))
    # Over the ball, whose top is at 2 m, and down again; slow machines sample only some of the positions.
    tab.call("Input.dispatchKeyEvent", type="keyDown", key="W", code="KeyW", modifiers=8)
    until(lambda: places[-1][0] < -2)
    tab.call("Input.dispatchKeyEvent", type="keyUp", key="W", code="KeyW", modifiers=8)
    heights = [float(place[2]) for place in places if abs(place[0]) < 5]
    assert before[2] + 1 < max(heights) <= before[2] + 2
    outside = [place[2] for place in places if 1.5 < np.hypot(*place[:2]) < 5]
    assert outside == pytest.approx([before[2]] * len(outside), abs=1e-3)
    tab.press("n")
    tab.wait("document.getElementById('message').textContent.startsWith('Orbit')")


def test_delayed_image_is_reported(tab: Tab, live: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    let_go = threading.Event()
    next_work = Scheduler._next

    def only_moving(scheduler: Scheduler) -> object:
        moves = any(each.images.is_moving for each in scheduler._sessions())
        return next_work(scheduler) if moves or let_go.is_set() else None

    monkeypatch.setattr(Scheduler, "_next", only_moving)
    tab.open(live.url)
    tab.wait("document.getElementById('status').textContent === 'rendering the next image, 2 s'")
    let_go.set()
    tab.wait(DONE)


def test_time_slider_moves_the_world(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    before = np.array(session.view.world.objects[0].matrix)
    tab.wait("!document.getElementById('timeline').hidden")
    tab.evaluate(
        "(() => { const bar = document.getElementById('time'); bar.value = String(bar.max * 0.5);"
        "for (const kind of ['input', 'change']) bar.dispatchEvent(new Event(kind, { bubbles: true })); })()"
    )
    until(lambda: session.view.time > 0)
    rest(tab, session)
    moved = np.array(session.view.world.objects[0].matrix)[:3, 3] - before[:3, 3]
    assert moved[0] == pytest.approx(session.view.time, abs=0.3)


def test_variant_list_changes_the_materials(tab: Tab, tmp_path: Path) -> None:
    world = raycam.load(variant_square().save(tmp_path / "v.glb"))
    server = Server(lambda: Session(world, world.default_camera(), samples=SAMPLES, title="v"), port=0)
    try:
        session = opened(tab, server, SAMPLES)
        names = tab.evaluate("[...document.getElementById('variant').options].map((each) => each.value)")
        assert names == ["", *world.variants]
        assert not tab.evaluate("document.getElementById('variants').hidden")
        tab.evaluate(
            "(() => { const list = document.getElementById('variant'); list.value = 'red';"
            "list.dispatchEvent(new Event('change', { bubbles: true })); })()"
        )
        until(lambda: session.view.variant == "red")
        rest(tab, session)
        expected = raycam.render(
            world.with_variant("red"), session.view.still_camera, samples=SAMPLES, integrator="direct"
        ).to_srgb8()
        shown = on_the_screen(tab, session.view.size)
        assert (
            min(np.abs(each - expected.astype(int)).mean() for each in shown if each.shape == expected.shape)
            <= 2  # the tolerance for JPEG compression
        )
    finally:
        server.close()


def test_exposure_keys_brighten_the_image(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    until(lambda: session.connection.sent == session.connection.acknowledged)
    before = on_the_screen(tab, session.view.size)[0]
    tab.evaluate("document.getElementById('picture').focus()")
    for _ in range(3):
        tab.press("=")
    until(lambda: session.view.exposure == pytest.approx(1.0))
    until(lambda: on_the_screen(tab, session.view.size)[0].mean() > 1.1 * before.mean())


def test_snapshot_file_equals_render(tab: Tab, live: Server, world: raycam.World, tmp_path: Path) -> None:
    session = opened(tab, live, SAMPLES)
    tab.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    tab.evaluate("document.getElementById('snapshot-png').click()")
    until(lambda: (tmp_path / "w.png").exists() and not list(tmp_path.glob("*.crdownload")))
    with Image.open(tmp_path / "w.png") as image:
        found = np.array(image.convert("RGB"))
    expected = raycam.render(world, session.view.still_camera, samples=SAMPLES, integrator="direct")
    assert np.array_equal(found, expected.to_srgb8())


def downloaded(tab: Tab, folder: Path, button: str, name: str) -> Path:
    """The complete file downloaded with a button."""
    tab.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
    tab.evaluate(f"document.getElementById('{button}').click()")
    until(lambda: (folder / name).exists() and not list(folder.glob("*.crdownload")))
    return folder / name


@pytest.mark.parametrize(
    ("button", "name", "count"), [("film", "w_turntable.mp4", 96), ("film-time", "w_animation.mp4", 48)]
)
def test_saved_video_is_playable(
    tab: Tab, live: Server, tmp_path: Path, button: str, name: str, count: int
) -> None:
    opened(tab, live, SAMPLES)
    with av.open(str(downloaded(tab, tmp_path, button, name))) as video:
        stream = video.streams.video[0]
        assert stream.average_rate == 24
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in video.decode(stream)]
    assert [each.shape for each in frames] == [(64, 96, 3)] * count
    assert np.abs(frames[count // 2] - frames[0]).mean() > 1, "it moves"
    tab.wait("document.getElementById('film-stop').hidden && !document.getElementById('film').disabled")


def test_video_without_pyav_is_saved_as_a_gif(
    tab: Tab, live: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "has_av", lambda: False)
    opened(tab, live, SAMPLES)
    with Image.open(downloaded(tab, tmp_path, "film-time", "w_animation.gif")) as image:
        assert (image.n_frames, image.size) == (24, (96, 64))


def test_stop_button_cancels_the_video(tab: Tab, live: Server, tmp_path: Path) -> None:
    session = opened(tab, live, SAMPLES)
    receive(session, {"type": "quality", "integrator": "path"})
    tab.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    tab.evaluate("document.getElementById('film').click()")
    tab.wait("!document.getElementById('film-stop').hidden")
    assert text_of(tab, "film-stop").startswith("Stop the video: ")
    assert tab.evaluate("document.getElementById('film-time').disabled")
    tab.evaluate("document.getElementById('film-stop').click()")
    tab.wait("document.getElementById('message').textContent === 'The video was stopped.'")
    tab.wait("document.getElementById('film-stop').hidden && !document.getElementById('film').disabled")
    assert [each.name for each in tmp_path.iterdir()] == ["w.toml"]


def test_reload_keeps_the_token(tab: Tab, live: Server) -> None:
    opened(tab, live, SAMPLES)
    tab.call("Page.reload")
    tab.wait("document.readyState === 'complete' && !!document.getElementById('status')")
    tab.wait(DONE)
    assert live.token not in tab.evaluate("location.href")
    assert len([each for each in live.sessions.values() if each.connection.is_open]) == 1


def test_page_of_another_origin_is_refused_even_with_the_token(tab: Tab, live: Server) -> None:
    host, port = live.address

    class Evil(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>evil</title><body>")

        def log_message(self, *_: object) -> None:
            pass

    evil = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Evil)
    threading.Thread(target=evil.serve_forever, daemon=True).start()
    try:
        tab.said.clear()
        tab.call("Page.navigate", url=f"http://127.0.0.1:{evil.server_address[1]}/")
        tab.wait("document.title === 'evil'")
        tried = tab.evaluate(TRY % (f"{host}:{port}", json.dumps(live.token)))
    finally:
        evil.shutdown()
        evil.server_close()
    assert tried == {"socket": "refused", "read": "refused", "script": "refused"}
    assert any("frame-ancestors" in each for each in tab.said), "it could be framed"
    assert not live.sessions


def test_eval_is_blocked_by_the_content_security_policy(tab: Tab, live: Server) -> None:
    opened(tab, live, SAMPLES)
    found = tab.call(
        "Runtime.evaluate",
        expression="(() => { try { return eval('1'); } catch (error) { return error.name; } })()",
        returnByValue=True,
        allowUnsafeEvalBlockedByCSP=False,
    )
    assert found["result"]["value"] == "EvalError"


def test_clients_share_the_world_and_have_their_own_cameras(
    tab: Tab, live: Server, world: raycam.World
) -> None:
    session = opened(tab, live, SAMPLES)
    other = Session(session.view.opened.edits, world.camera("wide"), samples=SAMPLES, title="w")
    camera = session.view.camera
    version = session.images.version
    other.view.opened.edits.edit_material(0, None, "color", "#00ff00")
    until(lambda: session.images.version > version)
    rest(tab, session)
    assert session.view.world.objects[0].name == "ball"
    assert session.view.camera == camera
    assert not tab.evaluate("document.getElementById('undo').disabled")
    assert text_of(tab, "title") == "w"


@pytest.fixture
def sliding(tmp_path: Path) -> raycam.World:
    """A square that an animation moves in two seconds, from a place far from its place at rest."""
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}), name="square")
    animated(document, "translation", [0, 2], [[5, 0, 0], [9, 0, 0]], node=node)
    return raycam.load(document.save(tmp_path / "sliding.glb"))


def scrub(tab: Tab, time: float) -> None:
    tab.evaluate(
        f"(() => {{ const bar = document.getElementById('time'); bar.value = '{time}';"
        " bar.dispatchEvent(new Event('input')); })()"
    )


def test_first_image_and_first_camera_show_the_animated_world_at_its_time(
    tab: Tab, sliding: raycam.World
) -> None:
    tab.show(400, 300)
    server = Server(lambda: Session(sliding, integrator="direct", samples=SAMPLES, title="s"), port=0)

    def assert_shown(time: float) -> None:
        rest(tab, session)
        view, world = session.view, sliding.at(time)
        expected = raycam.render(
            view.look.light_up(world, world, view.camera), view.still_camera, samples=SAMPLES
        )
        shown = on_the_screen(tab, view.size)
        exact = expected.to_srgb8(view.exposure, view.transform).astype(int)
        assert min(np.abs(each - exact).mean() for each in shown if each.shape == exact.shape) <= 2
        assert 0.02 < (expected["instance"] == 0).mean() < 0.9

    try:
        session = opened(tab, server, SAMPLES)
        assert_shown(0)
        scrub(tab, 2)
        until(lambda: session.view.time == 2)
        tab.press("f")
        until(lambda: np.allclose(session.view.pivot, sliding.at(2.0).bounds.mean(axis=0)))
        assert_shown(2)
        scrub(tab, 0)
        tab.press("Home")
        until(
            lambda: (
                session.view.time == 0
                and session.view.camera == sliding.at(0.0).view_from(size=session.view.size)
            )
        )
        assert_shown(0)
    finally:
        tab.show(1280, 800)
        server.close()


def test_tools_explain_that_an_animation_moves_the_object(tab: Tab, sliding: raycam.World) -> None:
    with raycam.view(sliding, samples=SAMPLES, block=False, browser=False, port=0) as viewer:
        tab.open(viewer.url)
        tab.wait("document.querySelector('#tree-list li')")
        tab.evaluate("document.querySelector('[data-tool=move]').click()")
        tab.wait("document.getElementById('message').textContent.includes('An animation moves this object')")
        tab.wait("document.querySelector('#turns button').disabled")
