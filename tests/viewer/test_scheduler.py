"""The order of rendering."""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.render.channel_picture import encode_jpeg
from raycam.viewer import stills
from raycam.viewer.scheduler import REST_S, Scheduler
from raycam.viewer.session import Session
from raycam.viewer.session.connection import MAX_UNACKNOWLEDGED
from support.patience import PATIENCE, until
from support.raises import warns
from support.session_messages import receive


def ready(world: raycam.World, touched: float = 0.0) -> Session:
    session = Session(world, world.camera("front"), samples=16)
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    session.connection.open(lambda message, buffers: None)
    session.images.mark_moved(session.images.version)
    session.images.touched = touched
    return session


def step(scheduler: Scheduler) -> Session | None:
    """Does the next step of work; returns its session."""
    found = scheduler._next()
    if found is None:
        return None
    session, work = found
    work()
    session.connection.acknowledge(session.connection.sent)
    return session


def test_moving_views_are_rendered_first_in_order_of_age(small_world: raycam.World) -> None:
    rests, late, early = (
        ready(small_world) for _ in range(3)
    )  # `rests` has no moving view, but an image to refine
    early.images.restart()
    late.images.restart()
    late.images.touched = early.images.touched + 1e-3
    scheduler = Scheduler(lambda: [rests, late, early])
    assert [step(scheduler) for _ in range(2)] == [early, late]


def test_preparation_runs_without_clients_and_ends_when_one_connects() -> None:
    begun, ended = threading.Event(), threading.Event()

    def prepare(cancel: raycam.Cancel) -> None:
        begun.set()
        until(lambda: cancel.is_cancelled)
        ended.set()
        raise raycam.Cancelled

    scheduler = Scheduler(list, prepare)
    scheduler.start()
    assert begun.wait(PATIENCE)
    scheduler.wake()
    assert ended.wait(PATIENCE)
    scheduler.end()
    scheduler.join(PATIENCE)
    assert not scheduler.is_alive()


def test_failed_preparation_does_not_prevent_images(small_world: raycam.World) -> None:
    def prepare(cancel: raycam.Cancel) -> None:
        raise raycam.WorldError("no memory", code="too_large")

    session, sent = ready(small_world), threading.Event()
    session.connection.open(lambda message, buffers: sent.set() if message["type"] == "picture" else None)
    scheduler = Scheduler(lambda: [session], prepare)
    scheduler.start()
    assert sent.wait(PATIENCE)
    scheduler.end()
    scheduler.join(PATIENCE)


def test_refinement_starts_after_a_pause(small_world: raycam.World) -> None:
    # The last change is in the future, so that the pause lasts long even on a busy machine.
    session = ready(small_world, time.monotonic() + PATIENCE)
    assert Scheduler(lambda: [session])._next() is None
    session.images.touched -= PATIENCE + REST_S
    assert Scheduler(lambda: [session])._next() is not None


def test_refinement_ends_at_the_requested_samples(small_world: raycam.World) -> None:
    session = ready(small_world)
    scheduler = Scheduler(lambda: [session])
    while step(scheduler):
        pass
    assert session.images.refinement_of(session.view).samples == 16
    assert session.connection.sent >= 1


@pytest.fixture
def studio_session(monkeypatch: pytest.MonkeyPatch) -> Session:
    """A session with a model in the studio; each step samples at least one tile of its image."""
    monkeypatch.setattr(stills, "SLICE", 0.0)
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, type="glass")
    session = Session(world, samples=16, is_model=True)
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    session.images.touched = 0.0
    return session


def test_early_images_in_the_studio_are_blended_with_the_moving_image(studio_session: Session) -> None:
    heard: list[tuple[dict[str, Any], bytes]] = []
    images = studio_session.images
    studio_session.connection.open(
        lambda message, buffers: heard.append((message, *buffers)) if message["type"] == "picture" else None
    )
    scheduler = Scheduler(lambda: [studio_session])
    kept = []
    while step(scheduler):
        kept += [images.still is not None] * (len(heard) - len(kept))
        images.touched = 0.0
    shown = [message["samples"] for message, _ in heard if not message["moving"]]
    assert shown[0] < 8
    assert shown[-1] == 16
    assert [each >= 8 for each in shown] == [
        each for each, (message, _) in zip(kept, heard, strict=True) if not message["moving"]
    ]


def test_first_samples_have_a_small_share_of_the_early_image() -> None:
    preview, noisy = np.zeros((1, 1, 3), np.uint8), np.full((1, 1, 3), 200, np.uint8)
    assert stills.blended(preview, noisy, 0.25).tolist() == [[[50, 50, 50]]]
    assert stills.blended(noisy, preview, 0.25).tolist() == [[[150, 150, 150]]]


def test_change_cancels_a_settling_image(studio_session: Session) -> None:
    studio_session.connection.open(lambda message, buffers: None)
    scheduler, images = Scheduler(lambda: [studio_session]), studio_session.images
    step(scheduler)
    images.settling_size = studio_session.view.size
    images.touched = 0.0
    found = scheduler._next()
    assert found is not None
    images.cancel.cancel()
    with pytest.raises(raycam.Cancelled):
        found[1]()


def test_notices_of_an_image_are_sent(small_world: raycam.World) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    camera = small_world.camera("front")
    with warns(raycam.Notice, code="default_lights") as told:
        raycam.render(world, camera)
    session = Session(world, camera, samples=4)
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    session.images.mark_moved(session.images.version)
    session.images.touched, heard = 0.0, []
    session.connection.open(lambda message, buffers: heard.append(message))
    scheduler = Scheduler(lambda: [session])
    while step(scheduler):
        pass
    about = [each for each in heard if each["type"] == "about"][-1]
    assert about["notices"] == [str(told[0].message)]
    assert about["about"].startswith("1 object, 12 triangles")


def test_hidden_closed_and_slow_clients_get_no_images(small_world: raycam.World) -> None:
    hidden, gone, behind = (ready(small_world) for _ in range(3))
    hidden.connection.set_visible(False)
    gone.connection.close()
    for _ in range(MAX_UNACKNOWLEDGED):
        behind.connection.number_image()
    assert Scheduler(lambda: [hidden, gone, behind])._next() is None


def test_change_cancels_the_image_in_progress(small_world: raycam.World) -> None:
    session = ready(small_world)
    found = Scheduler(lambda: [session])._next()
    assert found is not None
    before = session.images.cancel
    session.images.restart()
    assert before.is_cancelled
    assert not session.images.cancel.is_cancelled
    session.images.mark_moved(session.images.version)
    session.images.cancel.cancel()
    with pytest.raises(raycam.Cancelled):
        found[1]()


def test_channel_change_reuses_computed_channels(small_world: raycam.World) -> None:
    session = ready(small_world)
    heard: list[tuple[str, int]] = []
    session.connection.open(
        lambda message, buffers: (
            heard.append((message["channel"], message["samples"])) if message["type"] == "picture" else None
        )
    )
    scheduler = Scheduler(lambda: [session])
    for channel in ("color", "depth", "alpha", "color"):
        receive(session, {"type": "channel", "name": channel})
        while step(scheduler):
            pass
    assert heard[-4:] == [("color", 16), ("depth", 1), ("alpha", 16), ("color", 16)]


def test_render_errors_are_sent_and_the_thread_continues(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, heard = ready(small_world), []
    session.connection.open(lambda message, buffers: heard.append(message))
    scheduler = Scheduler(lambda: [session])

    def fail(session: Session) -> None:
        scheduler.end()
        raise raycam.WorldError("no such thing")

    monkeypatch.setattr(scheduler, "_refine", fail)
    scheduler.run()
    assert heard == [{"type": "error", "text": "no such thing"}]


def test_jpeg_images_approximate_the_frame(small_world: raycam.World) -> None:
    import cv2

    rgb = raycam.render(small_world, small_world.camera("front").resized((96, 64)), samples=4).to_srgb8()
    back = cv2.imdecode(np.frombuffer(encode_jpeg(rgb), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert np.abs(back.astype(int) - rgb).mean() < 3
