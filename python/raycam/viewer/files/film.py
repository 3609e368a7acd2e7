"""A turn of the camera around the pivot, as the bytes of a video."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import Cancelled
from ...render import render
from ...video.files import has_av, open_video
from ..scene.navigation import turned_around

if TYPE_CHECKING:
    from ..session import Session

__all__ = ["turntable"]

LARGEST = (640, 480)
FPS = {".mp4": 24.0, ".gif": 12.0}
SAMPLES = 8
TELL = 1.0  # seconds between two notices


def turntable(
    session: Session, seconds: float, degrees: float, tell: Callable[[int, int], None]
) -> tuple[str, str, bytes]:
    """Ending, media type and bytes of the film: MP4 where PyAV is there, else GIF. `tell(done, total)` is progress.

    Raises `Cancelled` where the client has left.
    """
    ending, media = (".mp4", "video/mp4") if has_av() else (".gif", "image/gif")
    with session.lock:
        world, camera, pivot = session.world, session.given, session.pivot
        view, exposure, integrator = session.view, session.exposure, session.integrator
    width, height = camera.size
    scale = min(LARGEST[0] / width, LARGEST[1] / height, 1.0)
    size = max(2, round(width * scale) // 2 * 2), max(2, round(height * scale) // 2 * 2)
    camera = camera.resized(size)
    count = max(2, round(seconds * FPS[ending]))
    told = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="raycam-film-") as folder:
        path = Path(folder) / f"film{ending}"
        with open_video(path, size, FPS[ending], lossless=False, alpha=False, audio=None) as add:
            for i in range(count):
                if session.send is None:
                    raise Cancelled("the client has left")
                seen = turned_around(camera, pivot, np.radians(degrees * i / count))
                frame = render(
                    world,
                    seen,
                    integrator="path" if integrator == "path" else "direct",
                    samples=SAMPLES,
                    channels=["color"],
                    frame=i,
                    threads=session.threads,
                )
                add(i, frame.to_srgb8(exposure, view))
                if time.monotonic() - told > TELL:
                    told = time.monotonic()
                    tell(i + 1, count)
        return ending, media, path.read_bytes()
