"""Measures the lecture's page: size in bytes, time to the first live figure, and frame rate.

The frame rate is the number of images per second while a figure is dragged. The script requires `make web`
and Chromium.

Each figure is dragged by pointer events in every animation frame: on its first canvas that can be dragged,
otherwise on its first slider.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
from pathlib import Path

import report
from raycam.viewer.web.live_page import lecture_page

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Tab, chromium

TARGET_BYTES, TARGET_S, TARGET_RATE = 6_000_000, 1.0, 30
NOTE_FIRST = """
globalThis.firstLive = globalThis.firstPicture = 0;
new MutationObserver(() => {
  if (!firstLive && document.querySelector('[data-figure][data-live=true]')) firstLive = performance.now();
  if (!firstPicture && document.documentElement.dataset.picture) firstPicture = performance.now();
}).observe(document, { subtree: true, attributes: true, attributeFilter: ['data-live', 'data-picture'] });
"""
DRAG = """
(async (host, seconds) => {
  const HELD = { buttons: 1, pointerId: 1, bubbles: true };
  const canvas = host.querySelector('canvas.draggable'), slider = host.querySelector('input[type=range]');
  if (!canvas && !slider) return null;
  const frame = () => new Promise((done) => requestAnimationFrame(done)), times = [];
  const say = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { ...HELD, clientX: x, clientY: y }));
  const box = canvas?.getBoundingClientRect(), middle = canvas && [box.left + box.width / 2, box.top + box.height / 2];
  if (canvas) { canvas.setPointerCapture = () => {}; say('pointerdown', ...middle); }
  await frame();
  const begun = performance.now();
  for (let k = 1, last = begun; performance.now() - begun < 1000 * seconds; k++) {
    if (canvas) say('pointermove', middle[0] + 40 * Math.sin(k / 12), middle[1] + 12 * Math.sin(k / 7));
    else {
      slider.value = String(Number(slider.min) + (0.5 + 0.4 * Math.sin(k / 15)) * (slider.max - slider.min));
      slider.dispatchEvent(new Event('input', { bubbles: true }));
    }
    await frame();
    times.push(performance.now() - last);
    last += times[times.length - 1];
  }
  if (canvas) say('pointerup', ...middle);
  return times;
})"""


def first(tab: Tab, path: Path, count: int) -> tuple[list[float], list[float]]:
    """Returns milliseconds from the start of loading to two events, for each of `count` loads.

    The events are the moment when the first figure is live, and the moment when it shows its image.
    """
    found = []
    for _ in range(count):
        tab.call("Page.navigate", url="about:blank")
        tab.call("Page.navigate", url=path.as_uri())
        tab.wait("globalThis.firstLive && globalThis.firstPicture")
        found.append(tab.evaluate("[firstLive, firstPicture]"))
    live, picture = zip(*found, strict=True)
    return list(live), list(picture)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="seconds for which each figure is dragged")
    parser.add_argument("--loads", type=int, default=5)
    options = parser.parse_args()
    load_before = os.getloadavg()[0]
    rows = []
    with tempfile.TemporaryDirectory() as folder, chromium(Path(folder, "browser")) as tab:
        path = Path(folder, "lecture.html")
        path.write_text(lecture_page(), encoding="utf-8")
        size = path.stat().st_size
        tab.show(1280, 900)
        tab.call("Page.addScriptToEvaluateOnNewDocument", source=NOTE_FIRST)
        live, picture = first(tab, path, options.loads)
        for name, times in (("first figure live", live), ("first figure with its picture", picture)):
            rows.append([name, f"{min(times):.0f} ms", f"{statistics.median(times):.0f} ms", ""])
        tab.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
        names = tab.evaluate(
            "[...document.querySelectorAll('[data-figure]')].map((each) => each.dataset.figure)"
        )
        slowest = ("", float("inf"))
        for name in names:
            host = f"document.querySelector('[data-figure={json.dumps(name)}]')"
            tab.evaluate(f"{host}.scrollIntoView({{ block: 'center' }})")
            tab.wait(f"{host}.dataset.live === 'true'")
            times = tab.evaluate(f"{DRAG}({host}, {options.seconds})")
            if times is None:
                rows.append([name, "", "", "buttons only"])
                continue
            rate = 1000 * len(times) / sum(times)
            slowest = min(slowest, (name, rate), key=lambda each: each[1])
            rows.append([name, f"{min(times):.1f} ms", f"{statistics.median(times):.1f} ms", f"{rate:.0f}"])
    notes = [
        f"Page: {size:,} bytes (target: at most {TARGET_BYTES:,}). Slowest figure: {slowest[0]}, "
        f"{slowest[1]:.0f} images a second (target: {TARGET_RATE}). First figure live: target {TARGET_S:.0f} s.",
        f"{options.loads} loads, {options.seconds:g} s of dragging for each figure. "
        f"Load of the machine: {load_before:.1f} before, {os.getloadavg()[0]:.1f} after, on {os.cpu_count()} cores.",
    ]
    report.write("lecture", "The lecture's page", notes, ["what", "best", "median", "images a second"], rows)


if __name__ == "__main__":
    main()
