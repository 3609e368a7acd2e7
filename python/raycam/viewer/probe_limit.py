"""The limit of a client's probes per second."""

from __future__ import annotations

import asyncio
import time
from collections import deque

from ..errors import Error
from .answers import probe
from .client_messages import Probe
from .session import Session

__all__ = ["MOST_PROBES", "ProbeLimit"]

MOST_PROBES = 60
"""Maximum number of a client's probes that are answered per second."""


class ProbeLimit:
    """Answers a client's probes, at most `MOST_PROBES` per second.

    Of the probes beyond this limit, only the newest is answered, as soon as the limit permits. The other probes are out
    of date, because the pointer has moved on. They arrive together if the server was busy, and the newest may be a
    click.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._times = deque([float("-inf")] * MOST_PROBES, MOST_PROBES)
        """The times of the last answers."""
        self._late: Probe | None = None
        """The newest probe, if it waits for its answer."""
        self._task: asyncio.Task[None] | None = None

    async def answer(self, message: Probe) -> None:
        """Answers a probe now or later, unless newer probes replace it. Raises the errors of `probe`."""
        if self._wait > 0:
            self._late = message
            if self._task is None:
                self._task = asyncio.create_task(self._answer_late())
            return
        self._late = None
        await self._answer(message)

    def close(self) -> None:
        """Drops the probe that waits for its answer."""
        self._late = None
        if self._task is not None:
            self._task.cancel()

    @property
    def _wait(self) -> float:
        """Seconds until another probe can be answered; negative if it can be answered now."""
        return self._times[0] + 1.0 - time.monotonic()

    async def _answer_late(self) -> None:
        while (wait := self._wait) > 0:
            await asyncio.sleep(wait)
        message, self._late, self._task = self._late, None, None
        if message is None:
            return
        try:
            await self._answer(message)
        except Error as error:
            self._session.complain(str(error))

    async def _answer(self, message: Probe) -> None:
        self._times.append(time.monotonic())
        await asyncio.to_thread(probe, self._session, message)
