"""Following: one leader, whose view and images all followers show."""

from __future__ import annotations

import base64
import contextlib
import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import raycam
from raycam.viewer import scheduler as scheduling
from raycam.viewer.server import MOST_FOLLOWERS, MOST_SESSIONS, TRY_AGAIN_LATER, Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.raises import raises
from support.session_messages import orbited
from support.viewer_client import Client
from support.viewer_page import drag, place_of, text_of
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

SAMPLES = 16
Join = Callable[..., Client]


@pytest.fixture
def class_server(small_world: raycam.World) -> Iterator[Server]:
    made = Server(
        lambda: Session(small_world, small_world.camera("front"), samples=SAMPLES, allows_open=True),
        port=0,
        follow=True,
    )
    yield made
    made.close()


@pytest.fixture
def join(class_server: Server) -> Iterator[Join]:
    """Connects a client with the leader's or the followers' address."""
    opened = contextlib.ExitStack()

    def enter(*, leads: bool = False, session: str = "") -> Client:
        host, port = class_server.address
        url = class_server.url if leads else class_server.followers_urls[0]
        return Client(
            opened.enter_context(
                connect(
                    f"ws://{host}:{port}/socket",
                    origin=Origin(f"http://{host}:{port}"),
                    subprotocols=[
                        Subprotocol("raycam.view.1"),
                        Subprotocol(f"token.{url.partition('#t=')[2]}"),
                    ],
                    compression=None,
                    max_size=None,
                    proxy=None,
                    close_timeout=0.1,  # clients with unread images do not receive the answer to their close frame
                )
            ),
            session,
        )

    with opened:
        yield enter


def session_of(server: Server, client: Client) -> Session:
    return server.sessions[client.welcome["session"]]


def test_thirty_followers_show_the_images_that_are_rendered_once(
    class_server: Server, join: Join, monkeypatch: pytest.MonkeyPatch, small_world: raycam.World
) -> None:
    rendered: list[tuple[Any, ...]] = []
    render = scheduling.moving_frame
    monkeypatch.setattr(
        scheduling, "moving_frame", lambda *values: rendered.append(values) or render(*values)
    )
    leader = join(leads=True)
    leader.hear("picture", samples=SAMPLES)
    followers = [join() for _ in range(30)]
    for each in followers:
        assert each.hear("picture", samples=SAMPLES)[1] == [leader.pictures[-1][1]]
    count = len(rendered)
    assert count <= 2  # the image in motion, and the image of full size
    leader.say("camera", seq=1, name="side")
    leader.hear("picture", moving=False, samples=SAMPLES)
    for each in followers:
        assert each.hear("picture", moving=False, samples=SAMPLES)[1] == [leader.pictures[-1][1]]
    assert len(rendered) <= count + 2
    for each in (leader, *followers):
        each.say("probe", id=7, u=24, v=16)
        values = each.hear("values", id=7)[0]["values"]
        assert values["instance"]["name"] == "box"
        assert [float(number) for number in values["depth"]["numbers"]] == [
            raycam.render(small_world, small_world.camera("side"), channels="depth")["depth"][16, 24]
        ]


def test_leader_controls_camera_channel_exposure_time_and_held_pixel(
    class_server: Server, join: Join
) -> None:
    leader, follower = join(leads=True), join()
    leader.say("camera", seq=1, name="side")
    follower.hear("camera", name="side")
    leader.say("channel", name="depth")
    assert follower.hear("display", channel="depth")[0]["held"] is None
    assert follower.hear("picture", channel="depth")[0]["channel"] == "depth"
    leader.say("display", exposure=2, view="agx")
    assert follower.hear("display", exposure=2)[0]["view"] == "agx"
    leader.say("hold", pixel=[24, 16])
    assert follower.hear("display")[0]["held"] == [24, 16]
    leader.say("hold", pixel=[])
    assert follower.hear("display")[0]["held"] is None
    assert session_of(class_server, leader).view is session_of(class_server, follower).view


@pytest.mark.parametrize(
    "message",
    [
        {"kind": "camera", "seq": 1, "name": "side"},
        {"kind": "channel", "name": "depth"},
        {"kind": "edit_", "number": 0, "key": "visible", "value": False},
        {"kind": "undo"},
        {"kind": "control", "id": 1, "value": 1},
        {"kind": "film", "seconds": 1, "degrees": 360},
        {"kind": "open", "name": "x.ply", "others": []},
    ],
    ids=lambda message: message["kind"],
)
def test_followers_change_nothing(class_server: Server, join: Join, message: dict[str, Any]) -> None:
    leader, follower = join(leads=True), join()
    before = session_of(class_server, leader).view
    fields = {name: value for name, value in message.items() if name != "kind"}
    if message["kind"] == "edit_":
        follower.socket.send(
            '{"type": "edit", "kind": "object", "number": 0, "key": "visible", "value": false}'
        )
    else:
        follower.say(message["kind"], **fields)
    assert follower.hear("notice")[0]["text"]
    assert session_of(class_server, leader).view is before
    follower.say("locate", id=1, u=1, v=1)  # the follower is still connected
    follower.hear("answer", id=1)


def test_detached_follower_has_its_own_camera_until_it_follows_again(
    class_server: Server, join: Join
) -> None:
    leader, follower = join(leads=True), join()
    follower.say("follow", mode="detach")
    assert not follower.hear("following", attached=False)[0]["leads"]
    follower.socket.send(json.dumps(orbited(follower.welcome["camera"], 30)))
    follower.hear("picture", samples=SAMPLES)
    own, led = (session_of(class_server, each) for each in (follower, leader))
    assert own.view.camera != led.view.camera
    follower.socket.send('{"type": "edit", "kind": "object", "number": 0, "key": "visible", "value": false}')
    follower.hear("notice")
    assert led.view.base.objects[0].visible
    follower.say("follow", mode="attach")
    follower.hear("following", attached=True)
    follower.hear("picture", samples=SAMPLES)
    assert own.view is led.view
    assert own.images is led.images


def test_edits_of_the_leader_reach_every_follower_exactly_once(class_server: Server, join: Join) -> None:
    leader, follower, free = join(leads=True), join(), join()
    free.say("follow", mode="detach")
    free.hear("following", attached=False)
    leader.socket.send('{"type": "edit", "kind": "object", "number": 0, "key": "visible", "value": false}')
    for each in (leader, follower, free):
        contents = each.hear("contents")[0]
        while contents["objects"][0]["visible"]:
            contents = each.hear("contents")[0]
        assert contents["editable"] == (each is leader)
        assert not session_of(class_server, each).view.base.objects[0].visible
    assert session_of(class_server, leader).view is session_of(class_server, follower).view


def test_only_clients_with_the_leader_address_can_take_the_lead(class_server: Server, join: Join) -> None:
    first, second, follower = join(leads=True), join(leads=True), join()
    follower.say("follow", mode="lead")
    assert "lead" in follower.hear("error")[0]["text"]
    second.say("follow", mode="lead")
    assert second.hear("following", leads=True)[0]["may_lead"]
    assert first.hear("following", attached=True)[0]["may_lead"]
    second.say("camera", seq=1, name="side")
    for each in (first, follower):
        each.hear("camera", name="side")
    assert session_of(class_server, first).view is session_of(class_server, second).view


def test_leader_who_comes_back_leads_the_same_view(class_server: Server, join: Join) -> None:
    leader, follower = join(leads=True), join()
    leader.say("camera", seq=1, name="side")
    follower.hear("picture", samples=SAMPLES)
    session = session_of(class_server, leader)
    leader.socket.close()
    until(lambda: not session.connection.is_open)
    other = join(leads=True)
    assert other.welcome["session"] == leader.welcome["session"]
    assert other.welcome["camera"]["name"] == "side"


def test_follower_who_comes_before_the_leader_shows_the_first_view(class_server: Server, join: Join) -> None:
    follower = join()
    assert follower.hear("picture", samples=SAMPLES)[0]["moving"] is False
    leader = join(leads=True)
    leader.say("camera", seq=1, name="side")
    follower.hear("camera", name="side")


def test_follower_cannot_resume_the_session_of_the_leader(class_server: Server, join: Join) -> None:
    leader = join(leads=True)
    leader.socket.close()
    until(lambda: not session_of(class_server, leader).connection.is_open)
    assert join(session=leader.welcome["session"]).welcome["session"] != leader.welcome["session"]


def test_tokens_are_sent_only_to_clients_that_may_lead(class_server: Server, join: Join) -> None:
    leader, follower = join(leads=True), join()
    token = class_server.token
    seen: list[str] = []
    for each in (follower, leader):
        each.say("locate", id=1, u=1, v=1)
        while (message := each.next()[0])["type"] != "answer":
            seen.append(str(message))
        if each is follower:
            assert not any(token in text for text in seen)
    assert any(class_server.followers_urls[0].partition("#t=")[2] in text for text in seen)


def test_numbers_of_followers_and_of_free_viewers_are_limited(class_server: Server, join: Join) -> None:
    followers = [join() for _ in range(MOST_FOLLOWERS)]
    with pytest.raises(ConnectionClosed) as closed:
        join()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == TRY_AGAIN_LATER
    for each in followers[: MOST_SESSIONS - 1]:
        each.say("follow", mode="detach")
        each.hear("following", attached=False)
    late = followers[MOST_SESSIONS]
    late.say("follow", mode="detach")
    assert str(MOST_SESSIONS - 1) in late.hear("error")[0]["text"]
    assert session_of(class_server, late).role.is_attached
    assert join(leads=True).welcome["session"] == class_server.following.leader.connection.id  # type: ignore[union-attr]


def test_slow_follower_receives_the_newest_image_later(class_server: Server, join: Join) -> None:
    leader, slow = join(leads=True), join()
    confirm = slow.say
    slow.say = lambda kind, /, **fields: None if kind == "ack" else confirm(kind, **fields)  # type: ignore[method-assign]
    for step in range(4):
        leader.say("camera", seq=step + 1, name=("side", "front")[step % 2])
        leader.hear("picture", moving=False, samples=SAMPLES)
    session = session_of(class_server, slow)
    assert session.connection.sent - session.connection.acknowledged <= 2
    confirm("ack", picture=session.connection.sent)
    slow.hear("picture", samples=SAMPLES)
    assert slow.pictures[-1][1] == leader.pictures[-1][1]


def test_view_without_followers_has_no_address_for_them(small_world: raycam.World) -> None:
    with (
        raycam.view(small_world, browser=False, block=False, port=0) as viewer,
        raises(raycam.SettingsError, code="conflicting_values"),
    ):
        print(viewer.followers_urls)


@pytest.mark.proof
def test_browser_follows_looks_around_and_follows_again(class_server: Server, join: Join, tab: Tab) -> None:
    leader = join(leads=True)
    tab.said.clear()
    tab.show(1280, 800)
    tab.open(class_server.followers_urls[0])
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    assert text_of(tab, "following-text") == "You follow the leader."
    assert tab.evaluate(
        "document.getElementById('message').hidden"
    )  # the page's own settings cause no notice
    assert tab.evaluate("document.getElementById('edit').hidden")
    leader.say("camera", seq=1, name="side")
    leader.say("channel", name="depth")
    leader.say("hold", pixel=[24, 16])
    tab.wait("document.getElementById('camera').value === 'side'")
    tab.wait("document.getElementById('channel').value === 'depth'")
    tab.wait("document.getElementById('pixel-place').textContent === 'column 24, row 16 (held)'")
    leader.say("channel", name="color")
    leader.say("display", exposure=1, view="standard")
    tab.wait("document.getElementById('exposure-text').textContent === '+1 stops'")
    (session,) = (each for each in class_server.sessions.values() if each.role.is_attached)
    view = session.view
    begin, end = place_of(tab, 24, 16, view.size), place_of(tab, 27, 16, view.size)
    drag(tab, begin, end)
    tab.wait("!document.getElementById('message').hidden")  # the message explains how to move freely
    assert session.view is view
    tab.wait("document.getElementById('camera').value === 'side'")
    tab.wait("document.getElementById('pixel-place').textContent === 'column 24, row 16 (held)'")
    tab.evaluate("document.getElementById('following-button').click()")
    tab.wait(
        "document.getElementById('following-text').textContent === 'You look around independently of the leader.'"
    )
    drag(tab, begin, end)
    until(lambda: session.view.camera != view.camera)
    assert class_server.following is not None
    assert class_server.following.leader.view.camera == view.camera
    tab.evaluate("document.getElementById('following-button').click()")
    tab.wait("document.getElementById('camera').value === 'side'")
    until(lambda: session.view is class_server.following.leader.view)  # type: ignore[union-attr]
    assert not [line for line in tab.said if "error" in line.lower()]


@pytest.mark.proof
def test_browser_leads_and_counts_its_followers(class_server: Server, join: Join, tab: Tab) -> None:
    tab.said.clear()
    tab.evaluate("sessionStorage.clear()")
    tab.open(class_server.url)
    tab.wait("document.getElementById('following-text').textContent === 'You lead 0 followers.'")
    follower = join()
    tab.wait("document.getElementById('following-text').textContent === 'You lead 1 follower.'")
    leader = class_server.following.leader  # type: ignore[union-attr]
    tab.click(*place_of(tab, 300, 200, leader.view.size))
    held = follower.hear("display")[0]["held"]
    while held is None:
        held = follower.hear("display")[0]["held"]
    tab.wait(
        f"document.getElementById('pixel-place').textContent === 'column {held[0]}, row {held[1]} (held)'"
    )


@pytest.mark.proof
def test_followers_show_the_file_that_the_leader_opens(class_server: Server, join: Join, tab: Tab) -> None:
    def open_file(name: str) -> None:
        mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        leader.say("upload", name=name, bytes=len(mesh), offset=0, data=base64.b64encode(mesh).decode())
        leader.say("open", name=name, others=[])

    def tree() -> list[str]:
        names = "[...document.querySelectorAll('#tree-list .row-name')].map((each) => each.textContent)"
        return list(tab.evaluate(names))

    leader = join(leads=True)
    tab.said.clear()
    tab.evaluate("sessionStorage.clear()") if tab.evaluate("location.protocol") == "http:" else None
    tab.open(class_server.followers_urls[0])
    tab.wait("document.getElementById('following-text').textContent === 'You follow the leader.'")
    assert tree()[:2] == ["box", "floor"]
    open_file("wedge.obj")
    tab.wait("document.getElementById('title').textContent === 'wedge.obj'")
    tab.wait("document.querySelectorAll('#tree-list .row-name').length === 1")
    assert tree() == ["wedge"]
    (session,) = (each for each in class_server.sessions.values() if each.role.is_attached)
    tab.wait("document.getElementById('status').textContent.includes('sample')")
    tab.mouse(
        "mouseMoved", *place_of(tab, session.view.size[0] // 2, session.view.size[1] // 2, session.view.size)
    )
    tab.wait("document.getElementById('values').textContent.includes('wedge')")
    tab.evaluate("document.getElementById('following-button').click()")
    tab.wait("document.getElementById('following-text').textContent.startsWith('You look around')")
    open_file("other.obj")
    leader.hear("welcome", title="other.obj")
    tab.evaluate("document.getElementById('following-button').click()")
    tab.wait("document.getElementById('title').textContent === 'other.obj'")
    tab.wait("document.querySelector('#tree-list .row-name').textContent === 'other'")
    assert tab.evaluate("document.getElementById('status-connection').textContent") == "connected"
    assert not [line for line in tab.said if "error" in line.lower()]
