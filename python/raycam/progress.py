"""Progress bars with the remaining time, shown only on a terminal and only for longer work."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["bar", "frames_bar"]

SHOW_AFTER_SECONDS = 0.5
"""Time after which a progress bar appears, in seconds."""
SHOWN = True
"""False if no progress is shown (`--quiet`)."""
LINE_AFTER_SECONDS = 20.0
"""Time between two lines of progress without a terminal (in a pipe, a log or a notebook), in seconds."""
DRAW_AFTER_SECONDS = 0.1
"""Time between two updates of a progress bar, in seconds."""
BAR_WIDTH = 30
"""The characters of a bar."""


@contextmanager
def bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """Yields a function `progress(done, total)` that draws a bar with a `title` on stderr.

    The bar is shown while the block lasts. Without a terminal, a line is printed every `LINE_AFTER_SECONDS`.
    """
    drawn = _Bar(title)
    lines = _Lines(title)

    def progress(done: int, total: int) -> None:
        lines.print_progress(done, total)
        drawn.draw(done, total, f"{done / max(total, 1):4.0%}".replace("%", " %"))

    try:
        yield progress
    finally:
        drawn.clear()


@contextmanager
def frames_bar(title: str, what: str = "frames") -> Iterator[Callable[[int, int, int], None]]:
    """Yields a function `progress(done, total, failed)` that draws a bar of frames (or `what`).

    The bar also shows the `title`, the rate, the remaining time and the number of failures. Without a terminal, a
    line is printed every `LINE_AFTER_SECONDS`.
    """
    drawn = _Bar(title)
    lines = _Lines(title, what)

    def progress(done: int, total: int, failed: int) -> None:
        ended = done + failed
        lines.print_progress(ended, total)
        failures = f"  {failed} failed" if failed else ""
        drawn.draw(ended, total, f"{ended}/{total} {what}  {drawn.rate(ended):.3g}/s{failures}")

    try:
        yield progress
    finally:
        drawn.clear()


class _Bar:
    """A progress bar on a terminal, in one line of stderr.

    The bar is drawn without control sequences, which old consoles lack. The bar leaves the cursor at its
    start, so that other output overwrites the bar.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._start = time.monotonic()
        self._begun: int | None = None
        """The amount of work done before the bar began, for a resumed job."""
        self._last: float | None = None
        self._width = 0

    def rate(self, done: int) -> float:
        """Returns the work done per second since the bar appeared; earlier work is not counted."""
        self._begun = done if self._begun is None else self._begun
        return (done - self._begun) / max(time.monotonic() - self._start, 1e-9)

    def draw(self, done: int, total: int, text: str) -> None:
        """Draws the bar, followed by a text.

        The bar appears after `SHOW_AFTER_SECONDS` if the work is not finished, and is then drawn at most
        every `DRAW_AFTER_SECONDS`, and at the end.
        """
        now = time.monotonic()
        rate = self.rate(done)
        if not SHOWN or not sys.stderr.isatty() or total <= 0:
            return
        if self._last is None and (done >= total or now - self._start <= SHOW_AFTER_SECONDS):
            return
        if self._last is not None and done < total and now - self._last < DRAW_AFTER_SECONDS:
            return
        self._last = now
        full = BAR_WIDTH * min(done, total) // total
        drawn = "=" * full + (">" if full < BAR_WIDTH else "")
        left = _clock((total - done) / rate) if rate > 0 else "-:--:--"
        self._write(f"{self._title} [{drawn:{BAR_WIDTH}}] {text}  {left}")

    def clear(self) -> None:
        """Removes the bar."""
        if self._last is not None:
            self._write("")

    def _write(self, text: str) -> None:
        from shutil import get_terminal_size  # imported here, so that `import raycam` is fast

        text = text[: max(1, get_terminal_size().columns - 1)]
        sys.stderr.write("\r" + text.ljust(self._width) + "\r")
        sys.stderr.flush()
        self._width = len(text)


def _clock(seconds: float) -> str:
    """A time as hours, minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02}"


class _Lines:
    """Progress as lines on stderr, without a terminal."""

    def __init__(self, title: str, what: str = "") -> None:
        self._title, self._what = title, what
        self._start = self._last = time.monotonic()

    def print_progress(self, done: int, total: int) -> None:
        """Prints a line if enough time has passed since the last line."""
        now = time.monotonic()
        if not SHOWN or sys.stderr.isatty() or now - self._last < LINE_AFTER_SECONDS or not 0 < done < total:
            return
        self._last = now
        left = (now - self._start) * (total - done) / done
        count = f"{done} of {total} {self._what}" if self._what else f"{done / total:.0%}"
        print(f"raycam: {self._title}: {count}, about {left:.0f} s left", file=sys.stderr, flush=True)
