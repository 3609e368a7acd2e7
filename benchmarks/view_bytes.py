"""Counts the bytes that the live view sends.

    python benchmarks/view_bytes.py [WORLD] [--samples N]

The bytes are counted until an image is finished, for depth and normals, and during an orbit. They do not
depend on the speed of the machine, except through the numbers of refined images and of images in motion per
second, which are limited.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import raycam
from raycam.viewer.client_messages import Channel, Move, Size
from raycam.viewer.messages import packed
from raycam.viewer.scheduler import Scheduler
from raycam.viewer.session import Session

SIZE = (1280, 960)
ORBIT_S = 5.0
MOVES_PER_SECOND = 60


class Counter:
    """A client that acknowledges every image at once, and counts bytes."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.count = 0
        self.images: list[dict[str, Any]] = []
        session.connection.open(self.receive)

    def receive(self, message: dict[str, Any], buffers: Any) -> None:
        self.count += len(packed(message, buffers))
        if message["type"] == "picture":
            self.images.append(message)
            self.session.connection.acknowledge(message["picture"])

    def until(self, condition: Callable[[dict[str, Any]], bool]) -> int:
        """Waits for an image that meets a condition; returns the bytes since the last call."""
        begin = len(self.images)
        while not any(condition(each) for each in self.images[begin:]):
            time.sleep(0.05)
        count, self.count = self.count, 0
        return count


def orbit(session: Session, seconds: float) -> float:
    """Orbits for some seconds; returns the elapsed time."""
    started, number = time.monotonic(), 0
    while (passed := time.monotonic() - started) < seconds:
        camera = session.view.camera_message(0)
        c, s = math.cos(0.01), math.sin(0.01)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        pivot = np.array(camera["pivot"])
        R = (np.reshape(camera["R"], (3, 3)) @ turn.T).ravel().tolist()
        C = (pivot + turn @ (np.array(camera["C"]) - pivot)).tolist()
        number += 1
        session.receive(Move(number, R, C, camera["K"][0], camera["pivot"]))
        time.sleep(1 / MOVES_PER_SECOND)
    return passed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("world", nargs="?", help="world to view (default: the bundled spot.toml)")
    parser.add_argument("--samples", type=int, help="samples per pixel of the finished image")
    given = parser.parse_args()
    world = raycam.data.spot() if given.world is None else raycam.load(given.world)
    session = Session(world, samples=given.samples)
    client = Counter(session)
    scheduler = Scheduler(lambda: [session])
    scheduler.start()
    session.receive(Size(*SIZE, 1))
    session.greet()
    most = session.images.samples_of(session.view)
    print(f"image {session.view.size[0]} x {session.view.size[1]}, {session.view.integrator}, {most} samples")
    count = client.until(lambda each: each["samples"] >= most and not each["moving"])
    print(f"look until the image is finished: {count / 1e6:.2f} MB in {len(client.images)} images")
    for name in ("depth", "normal", "instance"):
        session.receive(Channel(name))
        count = client.until(lambda each, name=name: each["channel"] == name and not each["moving"])
        print(f"channel {name}: {count / 1e6:.2f} MB")
    for name in ("color", "depth"):
        session.receive(Channel(name))
        client.until(lambda each, name=name: each["channel"] == name and not each["moving"])
        images = len(client.images)
        seconds = orbit(session, ORBIT_S)
        shown = len(client.images) - images
        print(
            f"orbit, {name}: {client.count * 8 / seconds / 1e6:.1f} Mbit/s, {shown} images in {seconds:.0f} s"
        )
        client.count = 0
    scheduler.end()


if __name__ == "__main__":
    main()
