"""The limit of probes per second: of more probes, only the newest is answered."""

from __future__ import annotations

import asyncio
import time
from types import SimpleNamespace
from typing import Any

import pytest
import raycam
from raycam.viewer import probe_limit
from raycam.viewer.client_messages import Probe
from raycam.viewer.probe_limit import MOST_PROBES, ProbeLimit
from raycam.viewer.session import Session
from support.patience import until
from support.viewer_client import Client


def test_probes_beyond_60_per_second_are_dropped_except_the_newest(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    client.hear("picture", samples=16)
    answered: list[int] = []
    monkeypatch.setattr(probe_limit, "probe", lambda session, message: answered.append(message.id))
    now = time.monotonic()
    # The clock is stopped, so that no probe becomes allowed again.
    monkeypatch.setattr(probe_limit, "time", SimpleNamespace(monotonic=lambda: now))
    for id in range(300):
        client.say("probe", id=id, u=1, v=1)
    client.say("copy", format="toml")
    client.hear("copied")  # the server handles this message after all probes
    assert answered == list(range(MOST_PROBES))
    now += 1.5
    until(lambda: len(answered) > MOST_PROBES)
    client.say("probe", id=300, u=1, v=1)
    client.say("copy", format="toml")
    client.hear("copied")
    assert answered[MOST_PROBES:] == [299, 300]


@pytest.fixture
def session(small_world: raycam.World) -> Session:
    return Session(small_world, small_world.camera("front"))


def test_newer_probe_replaces_a_probe_that_waits(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    answered: list[int] = []
    monkeypatch.setattr(probe_limit, "probe", lambda session, message: answered.append(message.id))
    now = 0.0
    monkeypatch.setattr(probe_limit, "time", SimpleNamespace(monotonic=lambda: now))

    async def hover() -> None:
        nonlocal now
        limit = ProbeLimit(session)
        for id in range(MOST_PROBES + 1):
            await limit.answer(Probe(id, 1, 1, 1))
        now = 1.5
        await limit.answer(Probe(100, 1, 1, 1))
        await asyncio.sleep(1.2)
        limit.close()

    asyncio.run(hover())
    assert answered == [*range(MOST_PROBES), 100]


def test_error_of_a_late_probe_is_shown(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))

    def fail(session: Session, message: Probe) -> None:
        if message.id == MOST_PROBES:
            raise raycam.WorldError("broken", code="index_out_of_range")

    monkeypatch.setattr(probe_limit, "probe", fail)

    async def hover() -> None:
        limit = ProbeLimit(session)
        for id in range(MOST_PROBES + 1):
            await limit.answer(Probe(id, 1, 1, 1))
        while not said:
            await asyncio.sleep(0.02)

    asyncio.run(hover())
    assert said == [{"type": "error", "text": "broken"}]


def test_closed_limit_answers_nothing(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    answered: list[int] = []
    monkeypatch.setattr(probe_limit, "probe", lambda session, message: answered.append(message.id))

    async def leave() -> None:
        limit = ProbeLimit(session)
        for id in range(MOST_PROBES + 1):
            await limit.answer(Probe(id, 1, 1, 1))
        limit.close()
        await asyncio.sleep(1.2)

    asyncio.run(leave())
    assert answered == list(range(MOST_PROBES))
