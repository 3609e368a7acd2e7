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


@contextmanager
def bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """Yields a function `progress(done, total)` that draws a bar on stderr while the block lasts.

    Without a terminal, nothing is drawn.
    """
    start = time.monotonic()
    shown: Progress | None = None

    def progress(done: int, total: int) -> None:
        nonlocal shown
        if (
            shown is None
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

    Without a terminal, nothing is drawn.
    """
    start = time.monotonic()
    first: int | None = None
    shown: Progress | None = None

    def progress(done: int, total: int, failed: int) -> None:
        nonlocal shown, first
        first = done + failed if first is None else first
        if (
            shown is None
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
