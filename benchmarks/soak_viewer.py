"""Runs a live view with many clients for hours, and checks that its memory does not grow.

The server runs in a process of its own. Two clients stay connected; others connect, leave and reconnect.
Memory is the server's resident set. During the warm-up, the maximum number of clients is connected once.
After the warm-up, the mean memory of the last five minutes may exceed the mean of the first five by 5 %. At the end,
no additional threads or descriptors may be left, and no client may have received an older view after a newer
view.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import raycam
import report
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.session_messages import SEQUENCE, orbited
from support.viewer_client import Client

SPACES = [(640, 480), (640, 480), (480, 360), (320, 240)]
SEATS = 8  # maximum number of simultaneous clients
GROWTH = 0.05
WARM_UP = 5  # minutes
SPAN = 5  # minutes over which means are computed
CHANNELS = ["color", "depth", "normal", "instance", "position", "error"]
# Errors that a client may receive: undo without an edit, images that are not ready, pixels outside the image.
REFUSALS = ("nothing to", "no samples yet", "outside the image", "out of date")
# The percentage of each kind of message.
KINDS = {
    **{"orbit": 40, "pan": 8, "dolly": 8, "home": 2, "probe": 24, "channel": 3, "edit": 6, "undo": 4},
    **{"redo": 2, "gizmo": 1, "explain": 0.5, "size": 0.5, "quality": 0.5, "snapshot": 0.3, "overlay": 0.2},
}


class Server:
    """Runs `raycam view` in a separate process."""

    def __init__(self, world: str) -> None:
        command = [sys.executable, "-m", "raycam", "view", world, "--no-browser", "--samples", "32"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout
        for line in self.process.stdout:
            found = re.search(r"http://([\d.]+:\d+)/#t=(\S+)", line)
            if found:
                self.place, self.token = found.groups()
                break
        else:
            raise SystemExit("the server did not start")
        self._rest = threading.Thread(target=self.process.stdout.read, daemon=True)
        self._rest.start()

    def memory(self) -> float:
        """Returns the resident memory in MiB."""
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        found = re.search(r"VmRSS:\s+(\d+) kB", text)
        assert found
        return int(found[1]) / 1024

    def threads(self) -> int:
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def descriptors(self) -> int:
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def connect(self, session: str = "") -> Client:
        origin, protocols = Origin(f"http://{self.place}"), ["raycam.view.1", f"token.{self.token}"]
        made = connect(
            f"ws://{self.place}/socket",
            origin=origin,
            subprotocols=[Subprotocol(each) for each in protocols],
            compression=None,
            max_size=None,
            proxy=None,
        )
        return Client(made, session)


class Visitor:
    """A client that sends random messages and checks the responses."""

    def __init__(self, server: Server, chance: random.Random, session: str = "") -> None:
        self._chance = chance
        self._client = server.connect(session)
        self.session = self._client.welcome["session"]
        self.heard: dict[str, int] = {}
        self.wrong: list[str] = []
        self.thrown_out = 0
        self._version = -1
        self._camera = self._client.welcome["camera"]
        self._thread = threading.Thread(target=self._hear, daemon=True)
        self._thread.start()

    def _hear(self) -> None:
        try:
            while True:
                message, _ = self._client.next()
                self._client.pictures.clear()
                self.heard[message["type"]] = self.heard.get(message["type"], 0) + 1
                if message["type"] == "camera":
                    self._camera = message
                if message["type"] == "picture":
                    if message["version"] < self._version:
                        self.wrong.append(f"view {message['version']} after {self._version}")
                    self._version = message["version"]
                if message["type"] == "error" and not any(word in message["text"] for word in REFUSALS):
                    self.wrong.append(message["text"])
        except (ConnectionClosed, TimeoutError) as reason:
            if isinstance(reason, TimeoutError):
                self.wrong.append("no message arrived for a minute")

    def say(self) -> None:
        """Sends one random message."""
        chance = self._chance
        (kind,) = chance.choices(list(KINDS), KINDS.values())
        u, v = chance.randrange(300), chance.randrange(200)
        if kind in ("orbit", "pan", "dolly"):
            self._client.socket.send(json.dumps(self._moved(kind)))
        elif kind == "home":
            self._send("home", seq=next(SEQUENCE))
        elif kind in ("probe", "explain"):
            if self._client.image:
                self._client.say(kind, id=chance.randrange(1000), u=u, v=v)
        elif kind == "edit":
            key, value = chance.choice(
                [("move", [chance.uniform(-0.05, 0.05) for _ in range(3)]), ("turn", 5)]
            )
            self._send("edit", kind="object", number=0, key=key, value=value)
            self._send("edit_material", number=0, slot=-1, key="color", value="#80a0c0")
        elif kind == "gizmo":
            self._send("select", number=0, slot=-1, tool=chance.choice(["move", "turn", "scale"]))
            stroke = chance.randrange(2**40)
            for step in range(6):
                self._send("gizmo", handle="x", stroke=stroke, begin=[u, v], end=[u + step, v])
        else:
            width, height = chance.choice(SPACES)
            fields: dict[str, dict[str, Any]] = {
                "channel": {"name": chance.choice(CHANNELS)},
                "size": {"width": width, "height": height, "ratio": 1},
                "quality": {"integrator": chance.choice(["direct", "path"])},
                "snapshot": {"format": chance.choice(["png", "html", "npz"])},
                "overlay": {
                    "cameras": chance.random() < 0.5,
                    "explained": True,
                    "grid": chance.random() < 0.5,
                },
            }
            self._send(kind, **fields.get(kind, {}))

    def _moved(self, kind: str) -> dict[str, Any]:
        """The message `move` of an orbit, a pan or a dolly from the newest camera."""
        chance, move = self._chance, orbited(self._camera, 0)
        if kind == "orbit":
            return orbited(self._camera, chance.uniform(-9, 9))
        pivot, location = np.array(move["pivot"]), np.array(move["C"])
        if kind == "pan":
            shift = np.array([chance.uniform(-0.05, 0.05), chance.uniform(-0.05, 0.05), 0])
            return {**move, "C": (location + shift).tolist(), "pivot": (pivot + shift).tolist()}
        return {**move, "C": (pivot + chance.choice([0.95, 1 / 0.95]) * (location - pivot)).tolist()}

    def _send(self, kind: str, /, **fields: Any) -> None:
        self._client.socket.send(json.dumps({"type": kind, **fields}))

    def leave(self) -> None:
        self._client.socket.close()
        self._thread.join(30)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30, help="duration in minutes")
    parser.add_argument("--rate", type=float, default=60, help="messages per second, summed over all clients")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    # Shells start background jobs with SIGINT ignored. The server would inherit this, but must be stopped by SIGINT.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    server = Server(str(raycam.data.path("spot.toml")))
    try:
        visit(server, random.Random(options.seed), options.minutes, options.rate)
    finally:
        server.process.kill()


def visit(server: Server, chance: random.Random, minutes: float, rate: float) -> None:
    """Runs clients that connect, send messages and leave, for some minutes.

    Then writes the report.
    """
    first = server.connect()
    first.hear("picture", moving=False)
    first.say("explain", id=1, u=24, v=15)
    first.hear("explained")
    first.say("snapshot", format="npz")
    first.hear("file")
    first.say("probe", id=2, u=24, v=15)
    first.hear("values")
    first.socket.close()
    time.sleep(1)
    threads, descriptors = server.threads(), server.descriptors()
    visitors = [Visitor(server, chance) for _ in range(SEATS)]
    sessions: list[str] = []
    done: list[Visitor] = []
    rows: list[list[str]] = []
    begun, said = time.monotonic(), 0
    kept: dict[int, float] = {}
    while (now := time.monotonic() - begun) < 60 * minutes:
        if now >= 60 * len(rows):
            kept[len(rows)] = server.memory()
            heard = sum(each.heard.get("picture", 0) for each in [*visitors, *done])
            figures = [f"{kept[len(rows)]:.1f}", str(server.threads()), str(server.descriptors())]
            rows.append([str(len(rows)), *figures, f"{said:,}", f"{heard:,}"])
            print(" ".join(rows[-1]), flush=True)
        if chance.random() < 0.2 / rate:  # every five seconds, a client connects, reconnects or leaves
            if len(visitors) < SEATS and chance.random() < 0.4:
                back = sessions.pop() if sessions and chance.random() < 0.5 else ""
                visitors.append(Visitor(server, chance, back))
            elif len(visitors) > 2:
                gone = visitors.pop(chance.randrange(2, len(visitors)))
                gone.leave()
                sessions.append(gone.session)
                done.append(gone)
        at = chance.randrange(len(visitors))
        try:
            visitors[at].say()
        except ConnectionClosed as reason:  # the client reconnects to its session, as a page does
            print(f"a client was disconnected: {reason}", flush=True)
            visitors[at].thrown_out += 1
            done.append(visitors[at])
            visitors[at] = Visitor(server, chance, visitors[at].session)
        said += 1
        time.sleep(max(0.0, begun + said / rate - time.monotonic()))
    for each in visitors:
        each.leave()
        done.append(each)
    time.sleep(5)
    # The thread pool of asyncio reaches its final size within the warm-up.
    pooled = max(int(row[2]) for row in rows[: WARM_UP + 1])
    left = (server.threads() - max(threads, pooled), server.descriptors() - descriptors)
    server.process.send_signal(signal.SIGINT)
    ended = server.process.wait(30)
    tell(rows, kept, min(WARM_UP, len(rows) - 1), left, ended, done)


def tell(
    rows: list[list[str]],
    kept: dict[int, float],
    warm: int,
    left: tuple[int, int],
    ended: int,
    done: list[Visitor],
) -> None:
    """Writes the report, and fails if memory or threads grew, or if a client reported an error."""
    minutes = list(kept.values())[warm:]
    begin, end = (statistics.mean(each) for each in (minutes[:SPAN], minutes[-SPAN:]))
    growth, most = end / begin - 1, max(minutes) / begin - 1
    heard: dict[str, int] = {}
    for each in done:
        for kind, count in each.heard.items():
            heard[kind] = heard.get(kind, 0) + count
    wrong = [text for each in done for text in each.wrong]
    notes = [
        f"Resident memory of the server, mean of {SPAN} minutes: {begin:.1f} MiB from minute {warm} on, {end:.1f} at "
        f"the end, {growth:+.1%}; maximum {most:+.1%}; limit {GROWTH:.0%}.",
        f"{len(done)} clients. After all clients left: {max(0, left[0])} more threads than after the warm-up, "
        f"{max(0, left[1])} more descriptors. The server's exit status: {ended}. "
        f"Clients disconnected by a keepalive timeout, on a busy machine: {sum(each.thrown_out for each in done)}. "
        f"Load of the machine at the end: {os.getloadavg()[0]:.1f}.",
        "Messages received: " + ", ".join(f"{count:,} {kind}" for kind, count in sorted(heard.items())) + ".",
        f"Older views after newer views, and errors: {len(wrong)}. {'; '.join(sorted(set(wrong))[:5])}",
    ]
    head = ["minute", "memory, MiB", "threads", "descriptors", "messages sent", "images received"]
    report.write("soak_viewer", "A live view for half an hour", notes, head, rows)
    if growth > GROWTH or max(left) > 0 or wrong:
        raise SystemExit("the result is not as expected")


if __name__ == "__main__":
    main()
