"""Measures the live view: latency, images per second, bytes, start and memory.

The server runs in a process of its own, the page in headless Chromium on the same machine. In the page, a
latency is the time from an event to the animation frame after its image; on the socket, it is the time from a
message to the image that shows its effect. `--rivals PYTHON` names an interpreter with viser, f3d and open3d
(`viewer_rivals.py`), which are measured for comparison.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import raycam
import report
from raycam.viewer.session import DEFAULT_SAMPLES
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Tab, chromium
from support.session_messages import orbited
from support.viewer_client import Client

SAMPLES = 16
VIEWS = [(640, 480), (1280, 720)]
RATE = 60  # moves per second
PATIENCE = 100  # seconds, the maximum for one part of the measurement
RIVALS = ("viser", "f3d", "open3d")
SOFTWARE = (
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
"""Options of a browser that draws WebGL without a graphics card."""
REST = f"document.getElementById('status').textContent.includes('{SAMPLES} samples')"
WATCH = """(() => {
  globalThis.moves = []; globalThis.shown = [];
  const [canvas, status] = ["picture", "status"].map((id) => document.getElementById(id));
  canvas.addEventListener("pointermove", (event) => moves.push(event.timeStamp), true);
  new MutationObserver(() => status.textContent.startsWith("moving") &&
    requestAnimationFrame(() => shown.push(performance.now()))).observe(status, { childList: true });
})()"""
MILLION = """[[object]]
name = "ball"
sphere = { radius = 1, level = 8 }
location = [0, 0, 1]
color = "#c0703c"

[[object]]
name = "floor"
plane = { size = [12, 12] }

[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]

[[light]]
type = "sky"
radiance = [0.3, 0.4, 0.6]

[camera]
location = [3, -4, 2.4]
target = [0, 0, 0.8]
size = [640, 400]
fov = 40
"""

Row = list[str]


class Served:
    """Runs `raycam view` in a separate process."""

    def __init__(self, world: Path) -> None:
        self._opened = contextlib.ExitStack()
        self.begun = time.perf_counter()
        command = [
            sys.executable,
            "-m",
            "raycam",
            "view",
            str(world),
            "--no-browser",
            "--samples",
            str(SAMPLES),
        ]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout
        self.url = ""
        for line in self.process.stdout:
            if found := re.search(r"http://\S+/#t=\S+", line):
                self.url = found[0]
                break
        threading.Thread(target=self.process.stdout.read, daemon=True).start()

    def client(self, size: tuple[int, int]) -> Client:
        """Connects a client with a view of the given size."""
        place, token = self.url.removeprefix("http://").split("/#t=")
        protocols = [Subprotocol("raycam.view.1"), Subprotocol(f"token.{token}")]
        socket = connect(
            f"ws://{place}/socket",
            origin=Origin(f"http://{place}"),
            subprotocols=protocols,
            compression=None,
            max_size=None,
            proxy=None,
        )
        made = Client(self._opened.enter_context(socket))
        made.say("size", width=size[0], height=size[1], ratio=1)
        return made

    def memory(self) -> float:
        """Returns the resident memory in MiB."""
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.findall(r"VmRSS:\s+(\d+) kB", text)[0]) / 1024

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()  # the server is killed first, so that closing the socket does not wait for it
        self.process.wait(30)
        self._opened.close()


@contextlib.contextmanager
def limited(seconds: int) -> Iterator[None]:
    """Raises `TimeoutError` if the block takes longer than the limit."""

    def ring(number: int, frame: object) -> None:
        raise TimeoutError(f"the server did not end within {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def measured(label: str, part: Callable[[], list[Row]], seconds: int = PATIENCE) -> list[Row]:
    """Returns the rows of a measurement, or a row with the reason why it failed."""
    print(f"{label} ...", file=sys.stderr, flush=True)
    try:
        with limited(seconds):
            return part()
    except Exception as error:
        return [[f"{label}: not measured: {str(error).splitlines()[0][:120]}", *one("")]]


def figures(values: Sequence[float], unit: str = "ms", scale: float = 1000) -> Row:
    """Returns the end of a row: the median, the 95 % quantile and the best of some seconds."""
    scaled = sorted(scale * value for value in values)
    middle, most = statistics.median(scaled), scaled[min(len(scaled) - 1, round(0.95 * len(scaled)))]
    return [f"{middle:.3g} {unit}", f"{most:.3g} {unit}", f"{scaled[0]:.3g} {unit}"]


def one(text: str) -> Row:
    """Returns the end of a row for a single figure."""
    return [text, "", ""]


# Clients of the socket ------------------------------------------------------------------------------------


def still(client: Client, samples: int) -> None:
    client.hear("picture", moving=False, samples=samples)


def moving(client: Client, seconds: float) -> list[Row]:
    """Measures a camera that turns, with 60 moves per second.

    The rows contain the latency, images per second, bytes, and the time until the image is at rest.
    """
    version = client.pictures[-1][0]["version"]
    client.pictures.clear()
    said: dict[int, float] = {}
    heard: list[tuple[float, bool, int, int, int]] = []
    numbers: list[float] = []

    def listen() -> None:
        while True:
            message, buffers = client.next()
            if message["type"] == "values":
                numbers.append(time.perf_counter())
            if message["type"] == "picture":
                now = time.perf_counter()
                size = sum(map(len, buffers))
                heard.append((now, message["moving"], message["version"], message["samples"], size))
                if message["samples"] == SAMPLES:
                    return

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    begun = time.perf_counter()
    for step in range(round(RATE * seconds)):
        version += 1
        said[version] = time.perf_counter()
        client.socket.send(json.dumps(orbited(client.welcome["camera"], step)))
        time.sleep(max(0.0, begun + (step + 1) / RATE - time.perf_counter()))
    ended = time.perf_counter()
    client.say("probe", id=step, u=150, v=150)
    listener.join()
    shown = [each for each in heard if each[1]]
    stills = [each[0] - ended for each in heard if not each[1] and each[2] == version]
    return [
        ["time from a movement to its image", *figures([each[0] - said[each[2]] for each in shown])],
        [
            "images per second while moving",
            *one(f"{sum(each[0] <= ended for each in shown) / (ended - begun):.1f}"),
        ],
        ["bytes of an image in motion", *figures([each[4] for each in shown], "kB", 1e-3)],
        ["bytes of a still image", *figures([each[4] for each in heard if not each[1]], "kB", 1e-3)],
        ["time from rest to the first exact numbers", *one(f"{1000 * (numbers[0] - ended):.0f} ms")],
        ["time from rest to the first still image", *one(f"{1000 * stills[0]:.0f} ms")],
        [f"time from rest to {SAMPLES} samples", *one(f"{stills[-1]:.2f} s")],
    ]


def questions(client: Client) -> list[Row]:
    """Measures probes and explanations of an image at rest."""
    rows = []
    for kind, answer, count in (("probe", "values", 60), ("explain", "explained", 5)):
        times = []
        for id in range(count):
            before = time.perf_counter()
            client.say(kind, id=id, u=150 + 4 * (id % 60), v=150)
            client.hear(answer)
            times.append(time.perf_counter() - before)
            time.sleep(0.02)
        rows.append([kind, *figures(times)])
    return rows


def on_the_socket(path: Path, size: tuple[int, int], seconds: float) -> list[Row]:
    """Returns rows for a world and an image size, measured by a client without a browser."""
    with Served(path) as served:
        first = served.client((64, 48))
        still(first, SAMPLES)
        before = served.memory()
        client = served.client(size)
        still(client, SAMPLES)
        rows = moving(client, seconds)
        if size == VIEWS[0]:
            rows += questions(client)
        for channel in ("depth", "error", "color"):
            client.say("channel", name=channel)
            client.hear("picture", channel=channel, moving=False)
        return [*rows, ["memory of the session", *one(f"{served.memory() - before:.0f} MiB")]]


# Pages in a browser ---------------------------------------------------------------------------------------


def fit(tab: Tab, size: tuple[int, int]) -> None:
    """Sets the window size so that the canvas has the given size."""
    tab.show(1500, 900)
    box = tab.evaluate("(({width, height}) => [width, height])(picture.getBoundingClientRect())")
    tab.show(size[0] + round(1500 - box[0]), size[1] + round(900 - box[1]))
    time.sleep(0.5)


def tree_time(pid: int) -> float:
    """Returns the processor seconds of the browser's process and all its descendants."""
    parents: dict[int, list[int]] = {}
    times = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            parents.setdefault(int(fields[1]), []).append(int(folder.name))
            times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    waiting, total = [pid], 0.0
    while waiting:
        here = waiting.pop()
        total += times.get(here, 0.0)
        waiting += parents.get(here, [])
    return total


def dragged(tab: Tab, seconds: float, step: Callable[[int], tuple[float, float]]) -> float:
    """Drags with the left button for some seconds, with 60 events per second.

    Returns the elapsed seconds.
    """
    tab.mouse("mousePressed", *step(0), button="left", clickCount=1)
    begun = time.perf_counter()
    for number in range(1, round(RATE * seconds)):
        tab.mouse("mouseMoved", *step(number), button="left", buttons=1)
        time.sleep(max(0.0, begun + number / RATE - time.perf_counter()))
    took = time.perf_counter() - begun
    tab.mouse("mouseReleased", *step(number), button="left", clickCount=1)
    return took


def in_the_page(tab: Tab, path: Path, size: tuple[int, int], seconds: float) -> list[Row]:
    """Returns rows for a world and an image size, measured in the browser."""
    tab.call("Page.navigate", url="about:blank")
    with Served(path) as served:
        tab.open(served.url)
        took = time.perf_counter() - served.begun
        rows = [["time from the command to the first image in an open browser", *one(f"{took:.2f} s")]]
        fit(tab, size)
        tab.wait(REST)
        tab.evaluate(WATCH)
        lags = []
        for number in range(10):
            tab.evaluate("moves.length = shown.length = 0")
            tab.mouse("mousePressed", 200, 200, button="left", clickCount=1)
            tab.mouse("mouseMoved", 200 + (-1) ** number * 12, 200, button="left", buttons=1)
            tab.wait("shown.length > 0")
            lags.append(tab.evaluate("shown[0] - moves[0]") / 1000)
            tab.mouse("mouseReleased", 200, 200, button="left", clickCount=1)
            time.sleep(0.4)
        rows.append(["time from a movement at rest to its image on the screen", *figures(lags)])
        tab.evaluate("shown.length = 0")
        before = tree_time(tab.pid)
        took = dragged(tab, seconds, lambda number: (100 + number % 400, 200 + 20 * np.sin(0.05 * number)))
        count = tab.evaluate("shown.length")
        rows.append(["images per second while dragging", *one(f"{count / took:.1f}")])
        cost = 1000 * (tree_time(tab.pid) - before) / max(count, 1)
        rows.append(["the browser's processor time per image", *one(f"{cost:.0f} ms")])
        return rows


# Pages without a server -----------------------------------------------------------------------------------


def samples_in_slices() -> list[Row]:
    """Measures the cost of rendering in slices compared with one call.

    Also measures the time to stop.
    """
    world = raycam.data.spot()
    camera = world.default_camera().resized((320, 200))
    most = DEFAULT_SAMPLES["direct"]

    def whole() -> None:
        raycam.render(world, camera, integrator="direct", samples=most, channels="color")

    def slices() -> None:
        progressive = raycam.Progressive(world, camera, integrator="direct", samples=most)
        while progressive.samples < most:
            progressive.add_for(0.03)

    times: dict[str, list[float]] = {"whole": [], "slices": []}
    for number in range(4):
        for name, call in (("whole", whole), ("slices", slices)):
            before = time.process_time()
            call()
            if number:
                times[name].append(time.process_time() - before)
    stops = []
    for _ in range(10):
        cancel = raycam.Cancel()
        progressive = raycam.Progressive(world, camera, integrator="path", samples=4096)

        def add(progressive: raycam.Progressive = progressive, cancel: raycam.Cancel = cancel) -> None:
            with contextlib.suppress(raycam.Cancelled):
                progressive.add(4096, cancel=cancel)

        thread = threading.Thread(target=add)
        thread.start()
        time.sleep(0.3)
        before = time.perf_counter()
        cancel.cancel()
        thread.join()
        stops.append(time.perf_counter() - before)
    ratio = min(times["slices"]) / min(times["whole"])
    return [
        [f"{most} samples in slices of 30 ms relative to one call, processor time", *one(f"{ratio:.3f}")],
        ["a stop", *figures(stops)],
    ]


def page_sizes(tab: Tab, folder: Path) -> list[Row]:
    """Measures a frame's page: its bytes, and the time until its first image."""
    rows = []
    world = raycam.data.spot()
    for size in ((640, 480), (1280, 720)):
        path = folder / f"{size[0]}.html"
        camera = world.view_from((-3, -6, 3), size=size)
        raycam.render(world, camera, samples=4, channels=["color", "depth", "instance", "triangle"]).save(
            path
        )
        times = []
        for _ in range(5):
            tab.call("Page.navigate", url="about:blank")
            before = time.perf_counter()
            tab.call("Page.navigate", url=path.as_uri())
            tab.wait("document.getElementById('status-picture')?.textContent")
            times.append(time.perf_counter() - before)
        label = f"4 channels of {size[0]} x {size[1]}"
        rows.append([f"{label}: bytes", *one(f"{path.stat().st_size / 1e6:.1f} MB")])
        rows.append([f"{label}: time from opening to the first image", *figures(times)])
    return rows


# Other viewers --------------------------------------------------------------------------------------------


def write_triangles(path: Path) -> None:
    """Writes the triangles of spot's world as binary PLY, which all viewers read."""
    corners = np.asarray(raycam.data.spot().triangles(), np.float32).reshape(-1, 3)
    faces = np.zeros(len(corners) // 3, dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, np.arange(len(corners)).reshape(-1, 3)
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(corners)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(head.encode() + corners.astype("<f4").tobytes() + faces.tobytes())


def rival(python: str, name: str, mesh: Path, seconds: float, tab: Tab) -> list[Row]:
    """Returns the figures of another viewer.

    Raises `RuntimeError` with the viewer's last line of output if the viewer fails.
    """
    worker = Path(__file__).with_name("viewer_rivals.py")
    begun = time.perf_counter()
    rows: list[Row] = []
    said = [""]
    with subprocess.Popen(
        [python, str(worker), name, str(mesh)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            assert process.stdout
            for line in process.stdout:
                said.append(line.strip())
                if line.startswith("open "):
                    tab.call("Page.navigate", url=line.split()[1])
                elif line.startswith("drag"):
                    rows += page_of_rival(tab, seconds)
                    break
                elif line.startswith("first"):
                    took = time.perf_counter() - begun
                    rows.append(["time from the start to the first image", *one(f"{took:.2f} s")])
                elif line.startswith("{"):
                    rows += [[key, *figures(values)] for key, values in json.loads(line).items()]
        finally:
            process.kill()
    if not rows:
        raise RuntimeError(
            f"the viewer ended with status {process.returncode}; the last line of its output: {said[-1]}"
        )
    return rows


def page_of_rival(tab: Tab, seconds: float) -> list[Row]:
    """Returns the animation frames per second while a viewer's page is dragged.

    Such a page redraws the world in each animation frame.
    """
    tab.evaluate(
        "globalThis.frames60 = 0; (function next() { frames60++; requestAnimationFrame(next); })(); null"
    )
    took = dragged(tab, seconds, lambda number: (200 + number % 300, 240 + 20 * np.sin(0.05 * number)))
    return [["images per second while dragging", *one(f"{tab.evaluate('frames60') / took:.1f}")]]


def everything(options: argparse.Namespace, folder: Path) -> list[Row]:
    """Returns the rows of all measurements."""
    rows: list[Row] = []

    def add(label: str, part: Callable[[], list[Row]]) -> None:
        rows.extend([f"{label}: {row[0]}", *row[1:]] for row in measured(label, part))

    million = folder / "million.toml"
    million.write_text(MILLION)
    worlds = {"spot": Path(raycam.data.path("spot.toml")), "million": million}
    if options.world:
        worlds = {options.world: worlds[options.world]}
    parts = [(name, path, size) for name, path in worlds.items() for size in VIEWS]
    for name, path, size in parts:
        label = f"{name}, {size[0]} x {size[1]}, socket"
        add(label, functools.partial(on_the_socket, path, size, options.seconds))
    with chromium(folder / "browser") as tab:
        for name, path, size in parts:
            label = f"{name}, {size[0]} x {size[1]}, page"
            add(label, functools.partial(in_the_page, tab, path, size, options.seconds))
        add("page of a frame", lambda: page_sizes(tab, folder))
    add("progressive", samples_in_slices)
    if options.rivals:
        mesh = folder / "spot.ply"
        write_triangles(mesh)
        with chromium(folder / "other", *SOFTWARE) as tab:
            for name in RIVALS:
                tab.show(*((160, 120) if name == "viser" else (640, 480)))
                add(name, functools.partial(rival, options.rivals, name, mesh, options.seconds, tab))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=4, help="seconds for which each camera moves")
    parser.add_argument("--world", choices=["spot", "million"], help="measure only this world")
    parser.add_argument(
        "--rivals", metavar="PYTHON", help="also measure other viewers, with this Python interpreter"
    )
    options = parser.parse_args()
    load, begun = os.getloadavg()[0], time.perf_counter()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        rows = everything(options, Path(folder))
    notes = [
        f"Load of the machine before: {load:.1f}; duration of all measurements: {time.perf_counter() - begun:.0f} s. "
        f"There are {RATE} moves per second. Images have the camera's aspect ratio, 16 : 10, within the view; "
        f"still images have {SAMPLES} samples.",
        "Targets on a quiet machine: from a move to its image 50 ms (95 %: 80 ms) at 640 x 480, 70 ms (110 ms) at "
        "1280 x 720; 25 and 15 images per second; 250 ms from rest to exact numbers; slices 1.05; a stop 10 "
        "ms; a probe "
        "5 ms (95 %: 15 ms); an explanation 0.6 s (spot), 2 s (million); 70 kB per image in motion; 1 s to the first "
        "image in an open browser; sessions of 100 and 300 MB; pages of 2 and 4 MB, 0.5 s to their first image.",
        "The other viewers rasterise in software (there is no graphics card), with one colour, no shadows and pinhole "
        "cameras. They show spot's triangles at 640 x 480; viser, whose browser draws WebGL in software, at 160 x 120.",
    ]
    report.write("viewer", "The live view", notes, ["what", "median", "95 %", "best"], rows)


if __name__ == "__main__":
    main()
