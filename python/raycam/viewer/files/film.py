"""Videos of a live view as bytes: a turn around the pivot, or the world's own motion."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import Cancelled, SettingsError
from ...render import render
from ...video.files import has_av, open_video
from ..scene.rotation import turned_around

if TYPE_CHECKING:
    from ...camera import Camera
    from ...world import World
    from ..session import Session, View

__all__ = ["filmed"]

LARGEST = (640, 480)
FPS = {".mp4": 24.0, ".gif": 12.0}
SAMPLES = 8
Shots = Callable[[int], tuple["World", "Camera"]]
"""The world and the camera of an image by its number."""
PROGRESS_INTERVAL_S = 0.5  # between two progress reports


def filmed(
    session: Session, seconds: float, degrees: float, tell: Callable[[int, int], None]
) -> tuple[str, str, bytes]:
    """Returns extension, media type and bytes of the video: MP4 if PyAV is installed, else GIF.

    `tell(done, total)` reports progress. For 0 degrees, the video shows the world's motion from time 0, at most for its
    duration. Raises `SettingsError` if the world does not move, and `Cancelled` if the client has left or stops it.
    """
    ending, media = (".mp4", "video/mp4") if has_av() else (".gif", "image/gif")
    view = session.view
    if degrees == 0 and view.seconds == 0:
        raise SettingsError(
            "nothing moves in this world; record a turn around it instead", code="missing_value"
        )
    if degrees == 0:
        seconds = min(seconds, view.seconds)
    width, height = view.camera.size
    scale = min(LARGEST[0] / width, LARGEST[1] / height, 1.0)
    size = max(2, round(width * scale) // 2 * 2), max(2, round(height * scale) // 2 * 2)
    count = max(2, round(seconds * FPS[ending]))
    shots = _turn(view, degrees, count) if degrees else _movement(view, FPS[ending])
    session.connection.film_stop.clear()
    tell(0, count)
    told = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="raycam-film-") as folder:
        path = Path(folder) / f"film{ending}"
        with open_video(path, size, FPS[ending], lossless=False, alpha=False, audio=None) as add:
            for i in range(count):
                if not session.connection.is_open or session.connection.film_stop.is_set():
                    raise Cancelled("the video was stopped")
                world, seen = shots(i)
                frame = render(
                    world,
                    seen.resized(size),
                    integrator=view.integrator,
                    samples=SAMPLES,
                    channels=["color"],
                    frame=i,
                    **view.render_options,
                    **view.look.behind,
                    threads=session.images.threads,
                )
                add(i, frame.to_srgb8(view.exposure, view.transform))
                if time.monotonic() - told > PROGRESS_INTERVAL_S:
                    told = time.monotonic()
                    tell(i + 1, count)
        return ending, media, path.read_bytes()


def _turn(view: View, degrees: float, count: int) -> Shots:
    """Returns the shots of a turn around the pivot, with `count` images."""
    return lambda i: (view.lit, turned_around(view.camera, view.pivot, np.radians(degrees * i / count)))


def _movement(view: View, fps: float) -> Shots:
    """Returns the shots of the world's motion, with `fps` images per second."""

    def shot(i: int) -> tuple[World, Camera]:
        world, camera = view.moment(min(i / fps, view.seconds))
        return view.look.light_up(world, world, camera), camera

    return shot
