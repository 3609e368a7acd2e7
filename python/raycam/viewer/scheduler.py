"""The render thread: moving pictures first, then what rests, and nothing that is out of date.

Next work is a moving picture of the session with the oldest change; else the shown channel of a session that came to
rest; else a slice of more samples. A change of the session that is being rendered ends its picture.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from ..errors import Cancelled, Error
from ..notices import collected
from ..render import render
from ..render.channel_picture import encode_jpeg
from ..render.frame import Frame
from .session import Session
from .stills import SAMPLED, truth
from .wire import pack

__all__ = ["IN_FLIGHT", "Scheduler", "failure"]

IN_FLIGHT = 2
"""Pictures that a client may not have acknowledged yet."""
MOVING_QUALITY = 80  # of JPEG
REST = 0.06  # seconds without a change after which a view rests: more than between two steps of a flight
TICK = 0.03  # seconds between two looks for work where nothing wakes the thread
SHORTEST = 0.001  # seconds between them at least

Work = Callable[[], None]


def failure(error: Exception) -> str:
    """The sentence for a client about a fault of raycam's own."""
    kind = type(error).__name__
    return f"raycam failed at this ({kind}: {error}); the terminal of the view has the details, please report them"


class Scheduler(threading.Thread):
    """Renders for all sessions, one picture at a time."""

    def __init__(self, sessions: Callable[[], list[Session]]) -> None:
        super().__init__(name="raycam viewer", daemon=True)
        self._sessions = sessions
        self._wake = threading.Event()
        self._ends = False

    def wake(self) -> None:
        """Looks for work at once."""
        self._wake.set()

    def end(self) -> None:
        """Ends the thread, after the picture that it is at is stopped."""
        self._ends = True
        for session in self._sessions():
            session.cancel.cancel()
        self._wake.set()

    def run(self) -> None:
        """Renders until it is ended."""
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
            except Exception as error:  # a fault of raycam's: the other sessions go on
                traceback.print_exc()
                self._failed(session, failure(error))

    def _failed(self, session: Session, text: str) -> None:
        """Tells of a picture that could not be made, and waits with the next one."""
        session.send_message({"type": "error", "text": text})
        session.touched = time.monotonic() + 1.0

    def _pause(self) -> float:
        """Seconds until the next look for work: that until a view rests, if it is short."""
        now = time.monotonic()
        left = [each.touched + REST - now for each in self._sessions()]
        return max(SHORTEST, min([TICK, *(each for each in left if each > 0)]))

    def _next(self) -> tuple[Session, Work] | None:
        """The session and the work that come next."""
        ready = [
            each
            for each in self._sessions()
            if each.send is not None
            and each.visible
            and each.sent - each.acknowledged < IN_FLIGHT
            and each.version
        ]
        moving = [each for each in ready if each.moved != each.version]
        if moving:
            session = min(moving, key=lambda each: each.touched)
            return session, lambda: self._move(session)
        now = time.monotonic()
        for session in sorted(ready, key=lambda each: -each.touched):
            if now - session.touched < REST:
                continue
            if session.channel not in SAMPLED and session.shown != (session.version, session.channel):
                return session, lambda session=session: self._rest(session)
            if (
                session.channel in SAMPLED
                and session.still is not None
                and session.shown[0] != session.version
            ):
                return session, lambda session=session: self._show_still(session)
            if session.start_refinement().samples < session.most_samples():
                return session, lambda session=session: self._refine(session)
        return None

    def _move(self, session: Session) -> None:
        """One moving picture, of one sample and the size that fits."""
        with session.lock:
            version, still, channel = session.version, session.size, session.channel
            camera, view, exposure = session.given, session.view, session.exposure
            world = session.world
        size = session.pace.size(still)
        started = time.perf_counter()
        common: dict[str, Any] = {"ambient_occlusion": False, "threads": session.threads}
        frame = render(
            world,
            camera.resized(size),
            integrator="direct" if channel in ("color", "error") else "flat",
            samples=2 if channel == "error" else 1,
            channels=channel,
            **common,
        )
        seconds = time.perf_counter() - started
        session.pace.measured(size, seconds)
        if channel == "color":
            fields: dict[str, Any] = {"encoding": "jpeg"}
            buffers = [encode_jpeg(frame.to_srgb8(exposure, view), MOVING_QUALITY)]
        else:
            header, data = pack(channel, frame[channel], level=1)
            fields, buffers = {"encoding": "plane", "plane": header}, [data]
        session.moved = version
        self._send(session, version, fields, buffers, still=still, samples=1, seconds=seconds, moving=True)

    def _rest(self, session: Session) -> None:
        """The shown channel of the exact rays, at full size."""
        with session.lock:
            version, camera, channel, cancel = (
                session.version,
                session.camera,
                session.channel,
                session.cancel,
            )
            world = session.world
        started = time.perf_counter()
        frame = truth(
            world,
            camera,
            (channel,),
            threads=session.threads,
            cancel=cancel,
        )
        session.shown = (version, channel)
        self._send_plane(session, version, frame, channel, 1, time.perf_counter() - started)

    def _refine(self, session: Session) -> None:
        """More samples."""
        with session.lock:
            version, refinement, channel = session.version, session.start_refinement(), session.channel
            cancel = session.cancel
        started = time.perf_counter()
        frame = refinement.step(cancel)
        if frame is None or session.version != version:
            return
        session.still = frame
        session.send_message({"type": "about", **session.about()})
        if channel in SAMPLED:
            session.shown = (version, channel)
            self._send_plane(
                session, version, frame, channel, refinement.samples, time.perf_counter() - started
            )
        else:
            session.send_message({"type": "progress", "samples": refinement.samples})

    def _show_still(self, session: Session) -> None:
        """The channel that is chosen now, of samples that are there already."""
        with session.lock:
            version, frame, channel, samples = (
                session.version,
                session.still,
                session.channel,
                session.start_refinement().samples,
            )
        if frame is not None:
            session.shown = (version, channel)
            self._send_plane(session, version, frame, channel, samples, 0.0)

    def _send_plane(
        self, session: Session, version: int, frame: Frame, channel: str, samples: int, seconds: float
    ) -> None:
        header, data = pack(channel, frame[channel], level=1)
        fields = {"encoding": "plane", "plane": header}
        self._send(
            session, version, fields, [data], still=frame.size, samples=samples, seconds=seconds, moving=False
        )

    def _send(
        self,
        session: Session,
        version: int,
        fields: dict[str, Any],
        buffers: list[bytes],
        *,
        still: tuple[int, int],
        samples: int,
        seconds: float,
        moving: bool,
    ) -> None:
        """Sends a picture, numbered for its acknowledgement."""
        session.sent += 1
        message = {
            "type": "picture",
            "overlay": session.overlay(session.given.resized(still)),
            "picture": session.sent,
            "version": version,
            "channel": session.channel if moving else fields["plane"]["name"],
            "width": still[0],
            "height": still[1],
            "samples": samples,
            "integrator": session.integrator,
            "ms": round(1000 * seconds, 1),
            **_progress(session, moving, still, seconds),
            "moving": moving,
            **fields,
        }
        session.send_message(message, buffers)


def _progress(session: Session, moving: bool, size: tuple[int, int], seconds: float) -> dict[str, Any]:
    """The samples in a second, and how far a still picture has changed since half as many samples."""
    refinement = session.refinement
    if moving:
        return {"rate": 0, "change": None}
    if refinement is None or session.channel not in SAMPLED:
        return {"rate": round(size[0] * size[1] / seconds) if seconds > 0 else 0, "change": None}
    change = refinement.change
    said = None if change is None else {"share": round(change[0], 6), "since": change[1]}
    return {"rate": round(refinement.rate), "change": said}
