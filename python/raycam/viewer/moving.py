"""Images of a moving view: one sample per pixel, or two for the error channel."""

from __future__ import annotations

import time
from typing import Any

from .._core import Cancel
from ..render import render
from ..render.frame import Frame
from .session import Pace, View

__all__ = ["PREPARED_SIZE", "moving_frame", "prepare"]

PREPARED_SIZE = (160, 120)
"""The size of the images that prepare a world: a quarter of the smallest usual window."""


def moving_frame(
    view: View, size: tuple[int, int], threads: int | None = None, cancel: Cancel | None = None
) -> Frame:
    """Renders the view's channel in a given size (width, height).

    Raises the errors of `render`, and `Cancelled` when `cancel` is cancelled.
    """
    common: dict[str, Any] = {"ambient_occlusion": False, "threads": threads, "cancel": cancel}
    if view.channel == "color":
        common |= view.look.behind
    return render(
        view.preview,
        view.camera.resized(size),
        integrator="direct" if view.channel in ("color", "error") else "flat",
        samples=2 if view.channel == "error" else 1,
        channels=view.channel,
        **common,
    )


def prepare(view: View, pace: Pace, threads: int | None, cancel: Cancel) -> None:
    """Renders small images of a view, so that the first client does not have to wait.

    The images prepare acceleration structures and textures. The render time is recorded in `pace`.

    Raises the errors of `moving_frame`.
    """
    for is_prepared in (False, True):
        started = time.perf_counter()
        moving_frame(view, PREPARED_SIZE, threads, cancel)
        if is_prepared:
            pace.measured(PREPARED_SIZE, time.perf_counter() - started, channel=view.channel)
