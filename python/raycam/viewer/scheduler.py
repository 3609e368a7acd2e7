"""The render thread: images during motion first, then still images.

Outdated images are cancelled.

The first available task is done next: a moving image of the session with the oldest change; the shown channel of a
session without changes; a slice of additional samples. A session with followers comes first; attached followers share
its images. A change of the session that is being rendered cancels its image.
"""

from __future__ import annotations

import contextlib
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from .._core import Cancel
from ..errors import Cancelled, Error
from ..notices import collected
from ..render.channel_picture import encode_jpeg
from ..render.frame import Frame
from .moving import moving_frame
from .session import Pane, Session, View
from .stills import SAMPLED, Refinement, blended, truth
from .wire import pack, reduced

__all__ = ["Scheduler", "failure"]

MOVING_QUALITY, REFINING_QUALITY, STILL_QUALITY = 70, 80, 93
"""The JPEG qualities of moving images, of still images that are being refined, and of finished still images."""
REST_S = 0.06
"""Time without a change after which a view is at rest: longer than between two steps of a flight."""
IDLE_S = 0.03
"""Time between two checks for work, unless something wakes the thread."""
MIN_WAIT_S = 0.001
RETRY_S = 1.0
"""Time to wait before the next image after a failed image."""

Work = Callable[[], None]


def failure(error: Exception) -> str:
    """The sentence for a client about a fault in raycam itself."""
    kind = type(error).__name__
    return f"raycam failed ({kind}: {error}): the terminal of the view shows the details; please report them"


class Scheduler(threading.Thread):
    """Renders for all sessions, one image at a time."""

    def __init__(
        self, sessions: Callable[[], list[Session]], prepare: Callable[[Cancel], None] | None = None
    ) -> None:
        """Creates the scheduler, which first calls `prepare` on its thread.

        The preparation is cancelled when a client connects.
        """
        super().__init__(name="raycam viewer", daemon=True)
        self._sessions = sessions
        self._prepare = prepare
        self._preparation = Cancel()
        self._wake = threading.Event()
        self._ends = False

    def wake(self) -> None:
        """Makes the thread look for work immediately."""
        self._preparation.cancel()
        self._wake.set()

    def end(self) -> None:
        """Ends the thread and cancels its image."""
        self._ends = True
        self._preparation.cancel()
        for session in self._sessions():
            session.images.cancel.cancel()
        self._wake.set()

    def run(self) -> None:
        """Renders until `end`."""
        if self._prepare is not None:
            # Errors are ignored here, because a client's first image reports the same errors.
            with contextlib.suppress(Error, Cancelled, MemoryError), collected():
                self._prepare(self._preparation)
        while not self._ends:
            chosen = self._next()
            if chosen is None:
                self._wake.wait(self._pause())
                self._wake.clear()
                continue
            session, work = chosen
            try:
                with collected():  # the page shows the notices
                    work()
            except Cancelled:
                continue
            except (Error, MemoryError) as error:
                self._failed(session, str(error) or "out of memory")
            except Exception as error:  # an error in raycam; the other sessions continue
                traceback.print_exc()
                self._failed(session, failure(error))

    def _failed(self, session: Session, text: str) -> None:
        """Reports a failed image, and waits before the next image."""
        session.complain(text)
        session.images.delay(RETRY_S)

    def _pause(self) -> float:
        """Returns the seconds until the scheduler looks for work again.

        The wait ends when the next view has been unchanged for `REST_S`, but at the latest after `IDLE_S`.
        """
        now = time.monotonic()
        left = [each.images.touched + REST_S - now for each in self._sessions()]
        return max(MIN_WAIT_S, min([IDLE_S, *(each for each in left if each > 0)]))

    def _next(self) -> tuple[Session, Work] | None:
        """The next session and its work."""
        own = [each for each in self._sessions() if not each.role.is_attached]
        ready = [each for each in own if each.connection.is_ready and each.images.version]
        moving = [each for each in ready if each.images.is_moving and each.connection.may_move]
        if moving:
            session = min(moving, key=lambda each: (not each.connection.followers, each.images.touched))
            return session, lambda: self._move(session)
        now = time.monotonic()
        for session in sorted(ready, key=lambda each: (not each.connection.followers, -each.images.touched)):
            images = session.images
            if images.is_moving or now - images.touched < REST_S:
                continue
            view = session.view
            if view.channel not in SAMPLED and not images.is_shown(view.channel):
                return session, lambda session=session: self._rest(session)
            if view.channel in SAMPLED and images.still is not None and not images.is_shown():
                return session, lambda session=session: self._show_still(session)
            panes = [each for each in session.panes if each.is_due]
            if panes:
                pane = min(panes, key=lambda each: each.samples)
                return session, lambda session=session, pane=pane: self._refine_pane(session, pane)
            size = images.settling_size
            if size is not None and view.channel == "color":
                return session, lambda session=session, size=size: self._settle(session, size)
            if images.refinement_of(view).samples < images.samples_of(view):
                return session, lambda session=session: self._refine(session)
        return None

    def _move(self, session: Session) -> None:
        """Renders one moving image, with one sample, as large as the time allows."""
        self._send_moving(session, session.images.pace.size(session.view.size, session.view.channel))

    def _settle(self, session: Session, size: tuple[int, int]) -> None:
        """Renders the moving image in a larger size.

        This image is shown until the first still image is ready. A change of the view cancels it.
        """
        self._send_moving(session, size, session.images.cancel)

    def _send_moving(self, session: Session, size: tuple[int, int], cancel: Cancel | None = None) -> None:
        view, version = session.snapshot()
        images = session.images
        started = time.perf_counter()
        frame = moving_frame(view, size, images.threads, cancel)
        seconds = time.perf_counter() - started
        if view.channel == "color":
            fields: dict[str, Any] = {"encoding": "jpeg"}
            buffers = [encode_jpeg(frame.to_srgb8(view.exposure, view.transform), MOVING_QUALITY)]
        else:
            header, data = pack(view.channel, reduced(frame[view.channel]), level=1)
            fields, buffers = {"encoding": "plane", "plane": header, "exact": False}, [data]
        images.pace.measured(size, seconds, len(buffers[0]), view.channel)
        session.connection.note_moving(len(buffers[0]))
        if view.channel == "color" and size == view.size:
            images.keep_preview(version, frame)
        needs_full = view.look.first_samples > 1
        images.mark_moved(version, images.pace.settling_size(view.size, size, reaches_full=needs_full))
        fields |= {"moving": True, "samples": 1, "rate": 0, "change": None}
        self._send(session, view, version, fields, buffers, seconds)

    def _rest(self, session: Session) -> None:
        """Renders the shown channel at full size, if it describes the pixels' centre rays."""
        with session.lock:
            view, version, cancel = session.view, session.images.version, session.images.cancel
        started = time.perf_counter()
        frame = truth(
            view.world, view.still_camera, (view.channel,), threads=session.images.threads, cancel=cancel
        )
        session.images.mark_shown(version, view.channel)
        self._send_plane(session, view, version, frame, 1, time.perf_counter() - started)

    def _refine(self, session: Session) -> None:
        """Adds samples to the still image."""
        images = session.images
        with session.lock:
            view, version, cancel = session.view, images.version, images.cancel
            refinement = images.refinement_of(view)
        started = time.perf_counter()
        frame = refinement.step(cancel)
        if frame is not None and refinement.is_early and version == images.version:
            self._send_early(session, view, version, frame, refinement)
            return
        if frame is None or not images.keep_still(version, frame):
            if view.channel in SAMPLED and version == images.version:
                session.connection.broadcast(_progress(session, view, refinement))
            return
        session.connection.broadcast({"type": "about", **session.about()})
        if view.channel in SAMPLED:
            images.mark_shown(version, view.channel)
            seconds = time.perf_counter() - started
            self._send_plane(session, view, version, frame, refinement.samples, seconds, refinement)
        else:
            session.connection.broadcast(_progress(session, view, refinement))
        session.check_placement()

    def _send_early(
        self, session: Session, view: View, version: int, frame: Frame, refinement: Refinement
    ) -> None:
        """Sends an early image, blended with the moving image.

        The early image has fewer samples than the first still image. The blended image is less noisy than its samples,
        and its light approaches the still image's.
        """
        if view.channel != "color":
            session.connection.broadcast(_progress(session, view, refinement))
            return
        pixels, preview = frame.to_srgb8(view.exposure, view.transform), session.images.preview
        if preview is not None:
            share = refinement.samples / refinement.first
            pixels = blended(preview.to_srgb8(view.exposure, view.transform), pixels, share)
        fields = {
            "moving": False,
            "samples": refinement.samples,
            "wanted": session.images.samples_of(view),
            "rate": round(refinement.rate),
            "change": None,
            "encoding": "jpeg",
        }
        data = encode_jpeg(pixels, REFINING_QUALITY)
        self._send(session, view, version, fields, [data], refinement.seconds)

    def _refine_pane(self, session: Session, pane: Pane) -> None:
        """Adds samples to one of several cameras, and sends its image."""
        images = pane.images
        with session.lock:
            view, version, cancel, frame = pane.view, images.version, images.cancel, images.still
            is_sent_again = pane.is_still_due
            refinement = images.refinement_of(view)
        if view.channel not in SAMPLED:
            channels = (view.channel,)
            frame = truth(view.world, view.still_camera, channels, threads=images.threads, cancel=cancel)
        elif not is_sent_again:
            frame = refinement.step(cancel)
            if frame is not None and not images.keep_still(version, frame):
                return
        if frame is None:
            return
        images.mark_shown(version, view.channel)
        wanted = images.samples_of(view)
        samples = refinement.samples if view.channel in SAMPLED else wanted
        fields, data = _encoded(view, frame, is_finished=samples >= wanted)
        message = {
            "type": "pane",
            "name": pane.name,
            "channel": view.channel,
            "samples": samples,
            "wanted": wanted,
        }
        session.connection.send_pane({**message, **fields}, [data])

    def _show_still(self, session: Session) -> None:
        """Sends the chosen channel of the existing samples."""
        images = session.images
        with session.lock:
            view, version, frame = session.view, images.version, images.still
            refinement = images.refinement_of(view)
        if frame is not None:
            images.mark_shown(version, view.channel)
            self._send_plane(session, view, version, frame, refinement.samples, 0.0, refinement)

    def _send_plane(
        self,
        session: Session,
        view: View,
        version: int,
        frame: Frame,
        samples: int,
        seconds: float,
        refinement: Refinement | None = None,
    ) -> None:
        """Sends a channel of a still image, with the number of samples per second and the change.

        The change is the difference from the image with half as many samples. Colours are sent as a compressed image,
        and other channels as rounded numbers. A client that compares images or has chosen a range of values receives
        exact numbers: once when the client requests them, and then whenever an image is finished.
        """
        connection = session.connection
        is_finished = refinement is None or samples >= session.images.samples_of(view)
        is_exact = connection.needs_exact(is_finished)
        width, height = frame.size
        rate, change = round(width * height / seconds) if seconds > 0 else 0, None
        if refinement is not None:
            rate, found = round(refinement.rate), refinement.change
            change = None if found is None else {"share": round(found[0], 6), "since": found[1]}
        fields: dict[str, Any] = {"moving": False, "samples": samples, "rate": rate, "change": change}
        if refinement is not None:
            fields["wanted"] = session.images.samples_of(view)
        encoding, data = _encoded(view, frame, is_finished=is_finished, is_exact=is_exact)
        if is_exact:
            connection.mark_exact_sent()
        self._send(session, view, version, fields | encoding, [data], seconds)

    def _send(
        self,
        session: Session,
        view: View,
        version: int,
        fields: dict[str, Any],
        buffers: list[bytes],
        seconds: float,
    ) -> None:
        """Sends an image to a client and its followers."""
        if session.role.is_attached:  # the session was attached after the image was started
            return
        number = session.images.sent.add(view, version)
        width, height = view.size
        message = {
            "type": "picture",
            "overlay": session.overlay(view),
            "version": version,
            "image": number,
            "camera": session.images.sent.camera,
            "channel": view.channel,
            "width": width,
            "height": height,
            "integrator": view.integrator,
            "ms": round(1000 * seconds, 1),
            **fields,
        }
        session.connection.send_image(message, buffers)


def _encoded(
    view: View, frame: Frame, *, is_finished: bool, is_exact: bool = False
) -> tuple[dict[str, Any], bytes]:
    """The shown channel of a still image: fields that describe the encoding, and the bytes.

    Colours are a compressed image and other channels rounded numbers, unless exact numbers are required.
    """
    if view.channel == "color" and not is_exact:
        quality = STILL_QUALITY if is_finished else REFINING_QUALITY
        return {"encoding": "jpeg"}, encode_jpeg(frame.to_srgb8(view.exposure, view.transform), quality)
    plane = frame[view.channel] if is_exact else reduced(frame[view.channel])
    header, data = pack(view.channel, plane, level=6 if is_finished else 1)
    return {"encoding": "plane", "plane": header, "exact": is_exact or plane.dtype.kind == "i"}, data


def _progress(session: Session, view: View, refinement: Refinement) -> dict[str, Any]:
    """Returns the message with the still image's current and final number of samples."""
    return {"type": "progress", "samples": refinement.samples, "wanted": session.images.samples_of(view)}
