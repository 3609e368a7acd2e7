"""Slow answers do not delay other clients or close().

Each client's answers are sent in order, and those of different clients in parallel.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import raycam
from raycam.viewer import answers
from raycam.viewer.answers import AT_ONCE, MOST_WAITING, Answers
from raycam.viewer.client_messages import Explain
from raycam.viewer.session import Session
from support.patience import until


class Slow:
    """Answers that wait until they are released."""

    def __init__(self) -> None:
        self.begun: list[tuple[Session, int]] = []
        self.gate = threading.Event()

    def __call__(self, session: Session, message: Explain) -> None:
        self.begun.append((session, message.id))
        assert self.gate.wait(60)


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[Slow]:
    made = Slow()
    monkeypatch.setattr(answers, "answer", made)
    yield made
    made.gate.set()


def listening(world: raycam.World) -> tuple[Session, list[dict[str, Any]]]:
    heard: list[dict[str, Any]] = []
    session = Session(world, world.camera("front"))
    session.connection.open(lambda message, buffers: heard.append(message))
    return session, heard


def test_answers_are_ordered_per_client_and_do_not_delay_others(
    slow: Slow, small_world: raycam.World
) -> None:
    all_answers = Answers()
    (one, _), (two, _) = listening(small_world), listening(small_world)
    for number in range(3):
        all_answers.queue_message(one, Explain(number, 0, 0, 0))
    all_answers.queue_message(two, Explain(9, 0, 0, 0))
    until(lambda: len(slow.begun) == 2)
    assert slow.begun == [(one, 0), (two, 9)]
    slow.gate.set()
    until(lambda: len(slow.begun) == 4)
    assert [number for session, number in slow.begun if session is one] == [0, 1, 2]
    all_answers.close()


def test_answers_in_progress_and_in_the_queue_are_limited(slow: Slow, small_world: raycam.World) -> None:
    all_answers = Answers()
    clients = [listening(small_world) for _ in range(AT_ONCE + 1)]
    for session, _ in clients:
        all_answers.queue_message(session, Explain(0, 0, 0, 0))
    until(lambda: len(slow.begun) == AT_ONCE)
    session, heard = clients[-1]
    for number in range(1, MOST_WAITING + 1):
        all_answers.queue_message(session, Explain(number, 0, 0, 0))
    assert [each["type"] for each in heard] == ["notice"]
    # No further answer is started for a client that has left.
    all_answers.forget(session)
    slow.gate.set()
    all_answers.close()
    assert len(slow.begun) == AT_ONCE


def test_close_stops_videos_without_a_long_wait(
    slow: Slow, small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answers, "GRACE", 0.1)
    all_answers = Answers()
    session, _ = listening(small_world)
    all_answers.queue_message(session, Explain(0, 0, 0, 0))
    all_answers.queue_message(session, Explain(1, 0, 0, 0))
    until(lambda: len(slow.begun) == 1)
    all_answers.close()
    assert session.connection.film_stop.is_set()
    slow.gate.set()
    until(lambda: not any(each.name == "raycam answers" for each in threading.enumerate()))
    assert len(slow.begun) == 1


def test_error_is_reported_and_the_next_answer_computed(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done: list[int] = []

    def fails_once(session: Session, message: Explain) -> None:
        done.append(message.id)
        if message.id == 0:
            raise RuntimeError("broken")

    monkeypatch.setattr(answers, "answer", fails_once)
    all_answers = Answers()
    session, heard = listening(small_world)
    for number in range(2):
        all_answers.queue_message(session, Explain(number, 0, 0, 0))
    until(lambda: done == [0, 1])
    assert ["RuntimeError: broken" in each["text"] for each in heard] == [True]
    assert "broken" in capsys.readouterr().err
