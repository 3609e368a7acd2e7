"""Progress bars with the remaining time, on a terminal and for longer work only."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

__all__ = ["bar", "frames_bar"]

# Seconds. Shorter work shows no bar, and so does not import `rich`.
SHOW_AFTER_SECONDS = 0.5
SHOWN = True
"""False for no progress at all: `--quiet`."""
LINE_AFTER_SECONDS = 20.0
"""The time between two lines of progress where there is no terminal: in a pipe, a log or a notebook."""


@contextmanager
def bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """Yields a function `progress(done, total)` that draws a bar on stderr while the block lasts.

    Without a terminal, a line tells it every `LINE_AFTER_SECONDS`.
    """
    start = time.monotonic()
    shown: Progress | None = None
    lines = _Lines(title)

    def progress(done: int, total: int) -> None:
        nonlocal shown
        lines.print_progress(done, total)
        if (
            SHOWN
            and shown is None
            and sys.stderr.isatty()
            and done < total
            and time.monotonic() - start > SHOW_AFTER_SECONDS
        ):
            shown = _rich_bar()
            shown.start()
            shown.add_task(title, total=total)
        if shown is not None:
            shown.update(shown.task_ids[0], completed=done, total=total)

    try:
        yield progress
    finally:
        if shown is not None:
            shown.stop()


class _Lines:
    """Progress in lines on stderr, where there is no terminal."""

    def __init__(self, title: str, what: str = "") -> None:
        self._title, self._what = title, what
        self._start = self._last = time.monotonic()

    def print_progress(self, done: int, total: int) -> None:
        """Prints a line if the last one was long ago."""
        now = time.monotonic()
        if not SHOWN or sys.stderr.isatty() or now - self._last < LINE_AFTER_SECONDS or not 0 < done < total:
            return
        self._last = now
        left = (now - self._start) * (total - done) / done
        count = f"{done} of {total} {self._what}" if self._what else f"{done / total:.0%}"
        print(f"raycam: {self._title}: {count}, about {left:.0f} s left", file=sys.stderr, flush=True)


def _rich_bar() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )


@contextmanager
def frames_bar(title: str, what: str = "frames") -> Iterator[Callable[[int, int, int], None]]:
    """Yields a function `progress(done, total, failed)` that draws a bar of frames (or `what` they are), their rate,
    the remaining time and the failures.

    Without a terminal, a line tells them every `LINE_AFTER_SECONDS`.
    """
    start = time.monotonic()
    lines = _Lines(title, what)
    first: int | None = None
    shown: Progress | None = None

    def progress(done: int, total: int, failed: int) -> None:
        nonlocal shown, first
        first = done + failed if first is None else first
        lines.print_progress(done + failed, total)
        if (
            SHOWN
            and shown is None
            and sys.stderr.isatty()
            and done < total
            and time.monotonic() - start > SHOW_AFTER_SECONDS
        ):
            shown = _rich_frames(what)
            shown.start()
            shown.add_task(title, total=total, rate="", failed="")
        if shown is not None:
            rate = (done + failed - first) / max(time.monotonic() - start, 1e-9)
            shown.update(
                shown.task_ids[0],
                completed=done + failed,
                total=total,
                rate=f"{rate:.3g}/s",
                failed=f"{failed} failed" if failed else "",
            )

    try:
        yield progress
    finally:
        if shown is not None:
            shown.stop()


def _rich_frames(what: str) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(what + "  {task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("[red]{task.fields[failed]}"),
        console=Console(stderr=True),
        transient=True,
    )
