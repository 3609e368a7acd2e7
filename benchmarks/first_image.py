"""Measures the steps from the page's request to the first visible image of the live view.

    python benchmarks/first_image.py [--rounds N] [--servers N] [--world FILE]

The server has started before the page is requested. The page has a window of 640 x 480 pixels in Chromium,
without a graphics card. Each step is a time in milliseconds since the browser began to load the page.
"painted" is the animation frame after the first image was drawn on the canvas. "render" is the time in which
the server rendered that image. The first load after a server's start is listed separately.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import raycam

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Tab, chromium

SIZE = (640, 480)
PREPARED_S = 3.0
"""Seconds between the server's start and the first request."""
MARK = """(() => {
  if (location.protocol !== "http:") return;
  sessionStorage.removeItem("raycam-session"); // a new session, as for a first visit
  const marks = globalThis.marks = {};
  const note = (name) => { marks[name] ??= performance.now(); };
  globalThis.WebSocket = class extends WebSocket {
    constructor(...given) {
      note("socket created");
      super(...given);
      this.addEventListener("open", () => note("socket open"));
      this.addEventListener("message", ({ data }) => {
        const header = new Uint8Array(data, 4, new DataView(data).getUint32(0, true));
        const message = JSON.parse(new TextDecoder().decode(header));
        note(message.type === "picture" ? "image received" : message.type);
        if (message.type === "picture") marks["render"] ??= message.ms;
      });
    }
  };
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    draw.apply(this, given);
    if (this.canvas.id !== "picture") return;
    note("drawn");
    requestAnimationFrame(() => note("painted"));
  };
})()"""
READ = """JSON.stringify({
  ...Object.fromEntries(performance.getEntriesByType("resource").map(({ name, responseEnd }) =>
    [new URL(name).pathname.slice(1), responseEnd])),
  document: performance.getEntriesByType("navigation")[0].responseEnd,
  ...marks,
})"""
STEPS = (
    "document",
    "client.js",
    "socket created",
    "socket open",
    "welcome",
    "image received",
    "drawn",
    "painted",
    "render",
)


def first_image(tab: Tab, url: str) -> dict[str, float]:
    """Loads the page and returns its steps in milliseconds."""
    tab.call("Page.navigate", url="about:blank")
    tab.call("Network.clearBrowserCache")
    tab.call("Page.navigate", url=url)
    tab.wait("marks.painted")
    found: dict[str, float] = json.loads(tab.evaluate(READ))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=10, help="page loads with each server")
    parser.add_argument("--servers", type=int, default=2, help="servers, one after the other")
    parser.add_argument("--world", default=str(raycam.data.path("spot.glb")))
    options = parser.parse_args()
    command = [sys.executable, "-m", "raycam", "view", options.world, "--no-browser", "--port", "0"]
    first, later = [], []
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder, chromium(Path(folder)) as tab:
        tab.show(*SIZE)
        tab.call("Page.addScriptToEvaluateOnNewDocument", source=MARK)
        for _ in range(options.servers):
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
            ) as server:
                try:
                    assert server.stdout
                    url = next(
                        found[0] for line in server.stdout if (found := re.search(r"http://\S+", line))
                    )
                    time.sleep(PREPARED_S)
                    rounds = [first_image(tab, url) for _ in range(options.rounds)]
                finally:
                    server.kill()
            first += rounds[:1]
            later += rounds[1:]
    print(f"load average {load:.1f} before, {os.getloadavg()[0]:.1f} after\n")
    print(
        "| step, ms | first load, best | median | later loads, best | median |\n| --- | --: | --: | --: | --: |"
    )
    for step in STEPS:
        parts = []
        for rounds in (first, later):
            times = [each[step] for each in rounds if step in each]
            parts += [f"{min(times):.0f}", f"{statistics.median(times):.0f}"] if times else ["", ""]
        print(f"| {step} | {' | '.join(parts)} |")


if __name__ == "__main__":
    main()
