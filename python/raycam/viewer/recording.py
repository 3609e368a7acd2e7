"""Recordings of a live view, saved as one HTML page that plays without a server."""

from __future__ import annotations

import base64
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..arguments import real, size_of, whole
from ..errors import FormatError, Notice
from ..io.atomic_files import check_writable, write
from ..notices import collected, warn_all
from ..progress import bar
from ..render import render
from .session import View
from .stills import LIT_CHANNELS
from .web.document import assembled, json_text, still_image

__all__ = ["MAX_SECONDS", "Recording"]

Progress = Callable[[int, int], object]
"""Function that is called with the number of finished images and the number of all images."""

MAX_SECONDS = 600.0
"""The longest recording."""
SPACE = (640, 480)
"""The space for the images of a page, unless `save` chooses a size."""


class Recording:
    """The changes of a view over time.

    `Viewer.record` starts a recording. A recording that is used as a context manager stops at the end of the block.
    """

    def __init__(self, view: Callable[[], View], *, title: str, fps: float, seconds: float) -> None:
        """Records the result of `view` up to `fps` times per second, until `stop` or for `seconds`."""
        self._view = view
        self._title = title
        self._interval = 1 / real("fps", fps, 0.1, 60, what="a number of images per second")
        self._limit = real("seconds", seconds, 0.1, MAX_SECONDS, what="a time in seconds")
        self._views: list[tuple[float, View]] = [(0.0, view())]
        self._start = time.monotonic()
        self._seconds: float | None = None
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="raycam recording", daemon=True)
        self._thread.start()

    @property
    def seconds(self) -> float:
        """The duration so far, in seconds."""
        return time.monotonic() - self._start if self._seconds is None else self._seconds

    @property
    def times(self) -> list[float]:
        """The times in seconds at which the view changed; the first is 0."""
        return [each for each, _ in self._views]

    def stop(self) -> None:
        """Ends the recording; further calls have no effect."""
        self._ends.set()
        self._thread.join()

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        size: tuple[int, int] | None = None,
        samples: int = 16,
        progress: Progress | None = None,
    ) -> None:
        """Stops the recording and writes an HTML page that plays an image of each change.

        The page needs no server and makes no requests. `size` (width, height) is the size of the images (default: that
        of the view, at most 640 x 480), `samples` the number of samples per pixel. After each image, `progress` is
        called with the number of finished images and the number of all images; if it raises an exception, nothing is
        written. Without `progress`, a terminal shows a progress bar.

        Raises `FormatError` unless `path` ends with .html, `SettingsError` for invalid arguments, the errors of
        `raycam.render`, and `OSError` if the file cannot be written. Ending, arguments and folder are checked before
        the images are rendered.
        """
        if Path(path).suffix.lower() != ".html":
            raise FormatError(
                f"{os.fspath(path)}: a recording is saved as a page; expected a name that ends with .html (for a "
                "video, use Save video or Turntable in the view, or raycam.video.write_video)",
                code="unknown_format",
            )
        check_writable(path)
        samples = whole("samples", samples, 1, 1 << 16)
        size = None if size is None else size_of(size)
        self.stop()
        with bar("rendering images") as drawn:
            still, images, notices = self._images(size, samples, progress or drawn)
        document = {"times": self.times, "seconds": self.seconds, "title": self._title}
        blocks = [
            still,
            f'<script type="application/json" id="recording">{json_text(document)}</script>',
            *(
                f'<script type="text/plain" id="image-{number}">{data}</script>'
                for number, data in enumerate(images)
            ),
        ]
        write(path, assembled(self._title, blocks, folder="recording/").encode())
        warn_all(notices)

    def _images(
        self, size: tuple[int, int] | None, samples: int, progress: Progress
    ) -> tuple[str, list[str], list[Notice]]:
        """Renders an image for each change.

        Returns the first image as HTML, all images as base64 texts of JPEG files, and the notices.
        """
        still = ""
        images: list[str] = []
        notices: list[Notice] = []
        for number, (_, view) in enumerate(self._views):
            with collected() as found:
                frame = _render(view, size, samples, number)
            notices += found
            if not number:
                still = still_image(frame, view.exposure, view.transform, self._title, view.channel)
            images.append(
                base64.b64encode(frame.to_jpeg(view.exposure, view.transform, view.channel)).decode()
            )
            progress(number + 1, len(self._views))
        return still, images, notices

    def _run(self) -> None:
        """Records each change of the view."""
        while not self._ends.wait(self._interval):
            now, view = time.monotonic() - self._start, self._view()
            if now >= self._limit:
                break
            before = self._views[-1][1]
            if view is not before and not (view.renders_like(before) and _shown(view) == _shown(before)):
                self._views.append((now, view))
        self._seconds = min(time.monotonic() - self._start, self._limit)

    def __enter__(self) -> Recording:
        """Returns the recording, which stops when the block ends."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Stops the recording."""
        self.stop()


def _shown(view: View) -> tuple[str, float, str]:
    return view.channel, view.exposure, view.transform


def _render(view: View, size: tuple[int, int] | None, samples: int, number: int) -> Any:
    """The image of a view."""
    width, height = view.camera.size
    scale = min(SPACE[0] / width, SPACE[1] / height, 1.0)
    fitted = max(1, round(width * scale)), max(1, round(height * scale))
    options = {**view.render_options, **view.look.behind} if view.channel in LIT_CHANNELS else {}
    return render(
        view.shown,
        view.camera.resized(size or fitted),
        integrator=view.integrator,
        samples=max(samples, 2) if view.channel == "error" else samples,
        channels=[view.channel],
        frame=number,
        **options,
    )
