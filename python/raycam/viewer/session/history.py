"""Undo of one client's changes to its view: camera, lens, look, variant and integrator.

`Message.UNDO` marks these messages; channel, exposure and time only change the display. Edits of the world are shared
by all clients, and `Edits` undoes them. Steps of both kinds have ascending numbers, so that `Session` undoes the newest
step.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ...errors import WorldError
from ..client_messages import Message
from ..scene.edits import next_step_number
from .view import View

__all__ = ["History"]

MAX_STEPS = 200
GROUP_PAUSE_S = 1.0
"""Camera moves and changes of the look with shorter pauses are one step."""


class History:
    """The views before and after the current view."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._before: list[tuple[int, View]] = []
        self._after: list[tuple[int, View]] = []
        self._last: tuple[type[Message] | None, float] = (None, 0.0)
        self._now = now

    @property
    def undo_number(self) -> int:
        """The number of the step that `undo` undoes; -1 if there is no step."""
        return self._before[-1][0] if self._before else -1

    @property
    def redo_number(self) -> float:
        """The number of the step that `redo` repeats; infinity if there is no step."""
        return self._after[-1][0] if self._after else float("inf")

    @property
    def counts(self) -> tuple[int, int]:
        """The numbers of steps that can be undone and repeated."""
        return len(self._before), len(self._after)

    def record(self, message: Message, before: View, after: View) -> bool:
        """Records the change that a message caused; returns True if it is a new step."""
        if message.UNDO == "no" or after.shows_like(before):
            return False
        kind, moment = self._last
        self._last = (type(message), self._now())
        if message.UNDO == "group" and type(message) is kind and self._now() - moment < GROUP_PAUSE_S:
            return False
        self._before = [*self._before[-MAX_STEPS + 1 :], (next_step_number(), before)]
        self._after = []
        return True

    def undo(self, view: View) -> View:
        """The view before the last step; raises `WorldError` if there is no step."""
        return self._step(self._before, self._after, view, "undo")

    def redo(self, view: View) -> View:
        """The view after the step that was undone last; raises `WorldError` if there is no step."""
        return self._step(self._after, self._before, view, "redo")

    def _step(
        self, source: list[tuple[int, View]], target: list[tuple[int, View]], view: View, name: str
    ) -> View:
        if not source:
            raise WorldError(f"there is nothing to {name}", code="nothing_to_undo")
        self._last = (None, 0.0)
        number, found = source.pop()
        target.append((number, view))
        return view.restored(found)
