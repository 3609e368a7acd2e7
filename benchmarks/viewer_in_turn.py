"""Measures the pages of several viewers, in alternation.

    python benchmarks/viewer_in_turn.py --viser PYTHON --model-viewer FILE [--rounds N]

The figures are the time to the first image, images per second while dragging, bytes, and processor time of
the browser and the server together. All viewers show `spot.glb`, which raycam includes, in a window of 640 x
480 pixels in Chromium without a graphics card. A relay between browser and server counts the bytes. `--viser`
names an interpreter with viser, `--model-viewer` the script `model-viewer.min.js`. For viewers that draw in
the browser, animation frames are counted; for raycam, the images that the page showed.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import io
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import raycam
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from bench_viewer import SOFTWARE, dragged
from support.chromium import Tab, chromium

SIZE = (640, 480)
LONGEST_S = 90.0
MIN_DEVIATION = 12.0  # minimum standard deviation of the bytes in the image's middle if it shows the model
VISER = """
import sys, time, viser
from pathlib import Path
server = viser.ViserServer(host="127.0.0.1", port=int(sys.argv[1]), verbose=False)
server.scene.set_up_direction("+y")
server.scene.add_glb("/spot", Path(sys.argv[2]).read_bytes())
print("ready", flush=True)
time.sleep(1000)
"""
MODEL_VIEWER = """<!doctype html><style>html, body, model-viewer { margin: 0; width: 100%; height: 100% }</style>
<script type="module" src="model-viewer.min.js"></script>
<model-viewer src="spot.glb" camera-controls shadow-intensity="1"></model-viewer>"""
COUNT_FRAMES = "globalThis.count = 0; (function next() { count++; requestAnimationFrame(next); })(); null"
COUNT_IMAGES = """globalThis.count = 0; new MutationObserver(() => {
  if (document.getElementById("status").textContent.startsWith("moving")) count++;
}).observe(document.getElementById("status"), { childList: true }); null"""


class CountingRelay:
    """Relays connections to a local port, and counts the bytes that the server sends."""

    def __init__(self, target: int) -> None:
        self.count = 0
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            near, _ = self._listener.accept()
            far = socket.create_connection(("127.0.0.1", self._target))
            threading.Thread(target=self._pump, args=(near, far, False), daemon=True).start()
            threading.Thread(target=self._pump, args=(far, near, True), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket, counts: bool) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                self.count += len(data) if counts else 0
                sink.sendall(data)
        source.close()
        sink.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def is_open(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port)).close()
    except OSError:
        return False
    return True


@contextlib.contextmanager
def served(name: str, options: argparse.Namespace, folder: Path) -> Iterator[tuple[int, str, int]]:
    """Yields a viewer's server: its port, the path of its page, and its process id."""
    port, glb = free_port(), str(raycam.data.path("spot.glb"))
    page = ""
    if name == "raycam":
        command = [sys.executable, "-m", "raycam", "view", glb, "--no-browser", "--port", str(port)]
    elif name == "viser":
        command = [options.viser, "-c", VISER, str(port), glb]
    else:
        (folder / "index.html").write_text(MODEL_VIEWER)
        for source, target in ((options.model_viewer, "model-viewer.min.js"), (glb, "spot.glb")):
            (folder / target).write_bytes(Path(source).read_bytes())
        command = [
            sys.executable,
            "-u",
            "-m",
            "http.server",
            str(port),
            "--bind",
            "127.0.0.1",
            "-d",
            str(folder),
        ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stdout
            line = process.stdout.readline()
            if name == "raycam":
                page = line.split()[2].split("/", 3)[3]
            while not is_open(port):
                time.sleep(0.02)
            yield port, page, process.pid
        finally:
            process.kill()


def processor_time(pids: set[int]) -> float:
    """Returns the processor seconds of processes and their descendants."""
    stats: dict[int, tuple[int, float]] = {}
    for each in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError):
            fields = each.read_text().rpartition(")")[2].split()
            seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
            stats[int(each.parent.name)] = (int(fields[1]), seconds)
    found = set(pids)
    while more := {pid for pid, (parent, _) in stats.items() if parent in found} - found:
        found |= more
    return sum(stats[pid][1] for pid in found if pid in stats)


def shows_model(tab: Tab) -> bool:
    try:
        data = tab.call("Page.captureScreenshot", format="png")["data"]
    except AssertionError:  # the browser is replacing the page
        return False
    shown = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("L"), np.float64)
    return float(shown[160:360, 220:420].std()) > MIN_DEVIATION


def measure(name: str, options: argparse.Namespace, tab: Tab, folder: Path) -> str:
    """Measures one round of a viewer; returns a line of the table."""
    with served(name, options, folder) as (port, page, pid):
        relay = CountingRelay(port)
        processes = {pid, tab.pid}
        begun, used = time.monotonic(), processor_time(processes)
        tab.call("Page.navigate", url=f"http://127.0.0.1:{relay.port}/{page}")
        while not shows_model(tab):
            if time.monotonic() - begun > LONGEST_S:
                return f"| {name} | no image within {LONGEST_S:.0f} s | | | | | |"
            time.sleep(0.05)
        first, first_used = time.monotonic() - begun, processor_time(processes) - used
        first_bytes = relay.count
        time.sleep(2)
        tab.evaluate(COUNT_IMAGES if name == "raycam" else COUNT_FRAMES)
        relay.count, used = 0, processor_time(processes)
        took = dragged(tab, options.seconds, lambda i: (200 + i % 200, 400 + 20 * np.sin(0.05 * i)))
        count = tab.evaluate("count")
        used = processor_time(processes) - used
        tab.call("Page.navigate", url="about:blank")
    return (
        f"| {name} | {first:.2f} s | {first_used:.2f} s | {first_bytes / 1e6:.2f} MB | {count / took:.1f} |"
        f" {1000 * used / max(count, 1):.0f} ms | {relay.count * 8 / took / 1e6:.2f} Mbit/s |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--viser", metavar="PYTHON", help="Python interpreter with viser")
    parser.add_argument("--model-viewer", metavar="FILE", help="the script model-viewer.min.js")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=4, help="seconds of each drag")
    options = parser.parse_args()
    names = [
        "raycam",
        *(["viser"] if options.viser else []),
        *(["model-viewer"] if options.model_viewer else []),
    ]
    print(
        "| viewer | first image | its processor time | its bytes | images/s | processor time an image | sent |"
    )
    print("| --- | --: | --: | --: | --: | --: | --: |")
    with tempfile.TemporaryDirectory() as place, chromium(Path(place, "browser"), *SOFTWARE) as tab:
        tab.show(*SIZE)
        Path(place, "page").mkdir()
        for _ in range(options.rounds):
            for name in names:
                print(measure(name, options, tab, Path(place, "page")), flush=True)


if __name__ == "__main__":
    main()
