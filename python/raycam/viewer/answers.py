"""Slow answers (explanations, files, videos), which are computed in the background."""

from __future__ import annotations

import threading
import traceback

from ..errors import Cancelled, Error, SettingsError
from ..render.channel_picture import encode_jpeg
from ..world import World
from .client_messages import (
    Copy,
    Explain,
    Film,
    Message,
    Open,
    Photograph,
    Probe,
    Scan,
    Snapshot,
    Thumbnails,
    Tile,
)
from .files.outputs import film, snapshot
from .probe import explained, values_at
from .scene.scan_points import scan_points
from .scene.textures import list_textures, thumbnail
from .scheduler import failure
from .session import Session
from .session.copied import copied
from .stills import SAMPLED, truth
from .wire import data_url, pack

__all__ = ["AT_ONCE", "GRACE", "MOST_WAITING", "SLOW", "Answers", "answer", "probe"]

SLOW = (Explain, Snapshot, Copy, Film, Open, Photograph, Scan, Thumbnails, Tile)
"""The messages whose answers take a long time."""
AT_ONCE = 4
"""Maximum number of answers computed at the same time, for all clients."""
MOST_WAITING = 4
"""Maximum number of a client's messages that wait for their answers."""
GRACE = 2.0
"""Seconds for which closing waits for unfinished answers."""


class Answers:
    """Computes the answers to the messages of all clients.

    The answers to one client are computed in order, the answers to different clients concurrently.

    Daemon threads compute the answers, and exist only while messages wait. `close` waits for these threads for at most
    `GRACE` seconds.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: list[tuple[Session, Message]] = []
        self._busy: list[Session] = []
        self._threads = 0
        self._ends = False

    def queue_message(self, session: Session, message: Message) -> None:
        """Queues a message for an answer.

        If too many messages of the client are waiting, a notice is sent instead.
        """
        with self._changed:
            if sum(each is session for each, _ in self._waiting) >= MOST_WAITING:
                session.notify("Too many requests at once: wait for the answers first.")
                return
            self._waiting.append((session, message))
            if self._threads < AT_ONCE and not self._ends:
                self._threads += 1
                threading.Thread(target=self._run, name="raycam answers", daemon=True).start()

    def forget(self, session: Session) -> None:
        """Cancels a client's answers; the result of the current answer is dropped."""
        with self._changed:
            self._waiting = [each for each in self._waiting if each[0] is not session]

    def close(self) -> None:
        """Stops all answers.

        Videos are cancelled, and their files are removed. Other answers have up to `GRACE` seconds to finish.
        """
        with self._changed:
            self._ends, self._waiting = True, []
            for session in self._busy:
                session.connection.film_stop.set()
            self._changed.wait_for(lambda: not self._busy, GRACE)

    def _run(self) -> None:
        """Computes answers until no message waits for this thread."""
        while (taken := self._take()) is not None:
            session, message = taken
            try:
                answer(session, message)
            except Exception as fault:  # an error in raycam; later answers are still computed
                traceback.print_exc()
                session.complain(failure(fault))
            finally:
                with self._changed:
                    self._busy = [each for each in self._busy if each is not session]
                    self._changed.notify_all()

    def _take(self) -> tuple[Session, Message] | None:
        """Returns the next message of a client without a running answer.

        The result is None if no message waits, which ends the thread.
        """
        with self._changed:
            for number, (session, _) in enumerate(self._waiting):
                if all(each is not session for each in self._busy):
                    self._busy.append(session)
                    return self._waiting.pop(number)
            self._threads -= 1
            return None


def probe(session: Session, message: Probe) -> None:
    """Sends the values of a pixel in the image that the client shows.

    After a change of the camera or of the window's size, the client shows the previous image until the new image
    arrives. The values are those of the shown image. If its view is no longer stored, nothing is sent, and the client
    repeats the request with the next image.
    """
    found = session.view_of_image(message.image)
    if found is None or message.u >= found[0].size[0] or message.v >= found[0].size[1]:
        return
    view, still = found
    camera = view.still_camera
    still = still if still and still.size == camera.size else None
    values = values_at(view.world, camera, still, message.u, message.v, view.object_names)
    session.connection.send(
        {"type": "values", "id": message.id, "u": message.u, "v": message.v, "values": values}
    )


def send_tile(session: Session, message: Tile) -> None:
    """Sends the exact numbers of a part of the shown channel.

    Nothing is sent for a part outside of the image, or if the image is out of date: then the client repeats the request
    with the next image.
    """
    found = session.view_of_image(message.image)
    if found is None:
        return
    view, still = found
    width, height = view.size
    region = (
        message.u,
        message.v,
        min(message.width, width - message.u),
        min(message.height, height - message.v),
    )
    if region[2] < 1 or region[3] < 1:
        return
    u, v, columns, rows = region
    if view.channel in SAMPLED:
        if still is None or still.size != view.size or view.channel not in still:
            return
        plane = still[view.channel][v : v + rows, u : u + columns]
    else:
        plane = truth(view.world, view.still_camera, (view.channel,), region=region, threads=1)[view.channel]
    header, data = pack(view.channel, plane, level=1)
    place = {"id": message.id, "channel": view.channel, "u": u, "v": v}
    session.connection.send({"type": "tile", "plane": header, **place}, [data])


def send_thumbnails(session: Session, world: World, number: int, slot: int) -> None:
    """Sends small images of the textures of a material, or none if the object or its slot is unknown."""
    images = {}
    for key in (each["texture"] for each in list_textures(world, number, slot) if each["used"]):
        image = thumbnail(world, number, key, slot)
        if image is not None:
            images[key] = data_url("image/jpeg", encode_jpeg(image))
    session.connection.send({"type": "thumbnails", "number": number, "slot": slot, "images": images})


def answer(session: Session, message: Message) -> None:
    """Answers a message of one of the types `SLOW`; an error is sent to the client."""
    view = session.view
    try:
        if isinstance(message, Explain):
            view = session.require_image(message.image)
            if message.u >= view.size[0] or message.v >= view.size[1]:
                raise SettingsError(
                    f"pixel {message.u}, {message.v} is outside the image of {view.size[0]} x {view.size[1]} pixels",
                    code="out_of_range",
                )
            parts, lines = explained(view.lit, view.still_camera, message.u, message.v)
            session.connection.send({"type": "explained", **parts})
            session.show_rays(lines, view.world)
        elif isinstance(message, Scan):
            session.show_scan(scan_points(view.world, message.lidar) if message.lidar else None, view.world)
        elif isinstance(message, Tile):
            send_tile(session, message)
        elif isinstance(message, Thumbnails):
            send_thumbnails(session, view.opened.edits.world, message.number, max(message.slot, 0))
        elif isinstance(message, Copy):
            text = copied(view, message.format, session.images.samples_of(view), session.notify)
            session.connection.send({"type": "copied", "text": text})
        elif isinstance(message, Photograph):
            session.send_photograph(message.name)
        elif isinstance(message, Open):
            session.open_upload(message.name, message.others)
        elif isinstance(message, Film):
            _send_file(session, *film(session, message.seconds, message.degrees))
        elif isinstance(message, Snapshot):
            _send_file(session, *snapshot(session, message.format))
    except Cancelled as error:
        session.notify(f"{str(error).capitalize()}.")
    except (Error, MemoryError, OSError) as error:
        session.complain(str(error) or "out of memory")


def _send_file(session: Session, name: str, media: str, data: bytes) -> None:
    session.connection.send({"type": "file", "name": name, "media": media}, [data])
