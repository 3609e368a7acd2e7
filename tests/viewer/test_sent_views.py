"""The views of the images that were sent last."""

from __future__ import annotations

import raycam
from raycam.viewer.session import Session
from raycam.viewer.session.sent_views import MAX_SENT_VIEWS, SentViews


def test_images_of_one_version_have_one_number(small_world: raycam.World) -> None:
    view, sent = Session(small_world, small_world.camera("front")).view, SentViews()
    assert sent.newest == (0, -1)
    first = sent.add(view, 1)
    assert sent.add(view, 1) == first
    second = sent.add(view.with_camera(small_world.camera("side")), 2)
    assert second > first
    assert sent.find(first) is view
    assert sent.find(second + 1) is None


def test_numbers_differ_between_sessions(small_world: raycam.World) -> None:
    view = Session(small_world, small_world.camera("front")).view
    assert SentViews().add(view, 1) != SentViews().add(view, 1)


def test_camera_number_changes_only_with_the_camera(small_world: raycam.World) -> None:
    view, sent = Session(small_world, small_world.camera("front")).view, SentViews()
    first = sent.add(view, 1)
    sent.add(view, 2)  # an edit of the world
    assert sent.camera == first
    moved = sent.add(view.with_camera(small_world.camera("side")), 3)
    assert sent.camera == moved


def test_oldest_views_and_views_of_a_closed_world_are_dropped(small_world: raycam.World) -> None:
    view, sent = Session(small_world, small_world.camera("front")).view, SentViews()
    numbers = [sent.add(view, version) for version in range(MAX_SENT_VIEWS + 1)]
    assert [sent.find(number) is view for number in numbers] == [False] + MAX_SENT_VIEWS * [True]
    other = Session(small_world, small_world.camera("front")).view
    newest = sent.add(other, MAX_SENT_VIEWS + 1)
    assert sent.find(newest) is other
    assert not any(map(sent.find, numbers))
