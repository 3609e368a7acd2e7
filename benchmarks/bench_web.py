"""Measures raycam in a page: images per second while a camera moves, and loading time.

The frame rate is compared with one native thread, which uses the portable kernel and runs in a process of its
own. The script requires `make web` and Chromium.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import raycam
import report
from raycam import _core
from raycam.viewer.web import core
from raycam.viewer.web.live_page import lecture_page

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Tab, chromium

SIZE = (320, 240)
LIT = {"integrator": "direct", "samples": 1, "channels": ["color"]}


def worlds() -> dict[str, raycam.World]:
    """Returns a box in the sun, and spot with many triangles."""
    box, spot = raycam.World(), raycam.World()
    box.add_object(box={"size": 1}, color=[0.8, 0.1, 0.1])
    box.add_object(plane={"size": [6, 6]}, location=[0, 0, -0.5])
    spot.add_object(mesh=raycam.data.path("spot/cow.obj"), refine=3, roll=90)
    for world in (box, spot):
        world.add_light("sun", direction=[-1, 1, -2], irradiance=3)
        world.add_camera(world.view_from((4, -6, 3), size=SIZE), "view")
    return {"box": box, "spot": spot}


WARM = 1.0  # seconds of movement, after which the browser has optimised the code


def moving(tab: Tab, rounds: int, warm: float = 0.0) -> list[float]:
    """Returns milliseconds per image of a moving camera in the page.

    The measurement starts after `warm` seconds of movement.
    """
    found: list[float] = tab.evaluate(
        f"""(async () => {{ const times = []; let camera = world.camera('view', 1, 1);
        const [R, C] = [camera.R, camera.C];
        const begun = performance.now();
        while (times.length < {rounds}) {{
          C[0] += 0.001; camera = camera.atPose(R, C); const before = performance.now();
          world.render(camera, {json.dumps(json.dumps(LIT))}).free();
          if (before - begun >= {1000 * warm}) times.push(performance.now() - before);
          await new Promise((done) => setTimeout(done)); }}
        return times; }})()"""
    )
    return found


def native(path: Path, rounds: int) -> list[float]:
    """Returns milliseconds per image of one native thread with the portable kernel."""
    script = (
        "import json, sys, time, raycam\nfrom raycam import _core\n"
        "world = raycam.World._of(_core.world_from_bytes(open(sys.argv[1], 'rb').read(), None, ''))\n"
        "options, times = json.loads(sys.argv[2]), []\nfor _ in range(int(sys.argv[3])):\n"
        "    before = time.perf_counter()\n"
        "    raycam.render(world, 'view', threads=1, ambient_occlusion=False, **options)\n"
        "    times.append(1000 * (time.perf_counter() - before))\nprint(json.dumps(times))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path), json.dumps(LIT), str(rounds)],
        check=True,
        capture_output=True,
        env={**os.environ, "RAYCAM_ISA": "portable"},
    )
    found: list[float] = json.loads(done.stdout)
    return found


def start(tab: Tab) -> None:
    """Loads the core in an empty tab."""
    built = Path(core.__file__).parent / core.FOLDER
    tab.call("Page.navigate", url="about:blank")
    tab.evaluate(
        f"(0, eval)({json.dumps((built / core.GLUE).read_text() + ';globalThis.core = wasm_bindgen')}), null"
    )
    wasm = base64.b64encode(core.core_bytes()).decode()
    tab.evaluate(
        "globalThis.bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)),"
        f"core({{ module_or_path: bytesOf('{wasm}') }}).then(() => null)"
    )


def first_pictures(tab: Tab, path: Path, rounds: int) -> list[float]:
    """Returns the milliseconds from opening the lecture's page to its first image."""
    path.write_text(lecture_page(), encoding="utf-8")
    times = []
    for _ in range(rounds):
        tab.call("Page.navigate", url="about:blank")
        before = time.perf_counter()
        tab.call("Page.navigate", url=path.as_uri())
        while not tab.evaluate("document.documentElement.dataset.picture"):
            time.sleep(0.01)
        times.append(1000 * (time.perf_counter() - before))
    return times


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20, help="images per kind")
    options = parser.parse_args()
    rows: list[list[Any]] = []

    def add(name: str, times: list[float]) -> float:
        middle = statistics.median(times)
        rows.append([name, f"{min(times):.1f}", f"{middle:.1f}", f"{1000 / middle:.1f}"])
        return middle

    with tempfile.TemporaryDirectory() as folder, chromium(Path(folder, "browser")) as tab:
        add(
            "time until the lecture's page shows its first image",
            first_pictures(tab, Path(folder, "x.html"), 5),
        )
        start(tab)
        for name, world in worlds().items():
            path = Path(folder, name)
            path.write_bytes(_core.world_to_bytes(world._core))
            text = base64.b64encode(path.read_bytes()).decode()
            triangles = f"{len(world.triangles()):,}"
            loading = tab.evaluate(
                f"(() => {{ const bytes = bytesOf('{text}'), before = performance.now();"
                " globalThis.world = core.World.unpack(bytes); const unpacked = performance.now() - before;"
                f" world.render(world.camera('view', 1, 1), {json.dumps(json.dumps(LIT))}).free();"
                " return performance.now() - before; })()"
            )
            add(f"{name}, {triangles} triangles: time to load and to show the first image", [loading])
            label = f"{name}, {SIZE[0]} x {SIZE[1]}, lit, 1 sample, in the page"
            add(f"{label}, the first images", moving(tab, options.rounds))
            here = add(f"{label}, after {WARM:.0f} s", moving(tab, options.rounds, WARM))
            there = add(
                f"{name}, the same with one native thread and portable code", native(path, options.rounds)
            )
            rows.append([f"{name}, time of the page relative to native code", "", f"{here / there:.2f}", ""])
    notes = [
        f"Milliseconds, {options.rounds} images each. Load of the machine at the end: {os.getloadavg()[0]:.1f}.",
        "Targets: box 10 images per second; spot loaded in 2 s, and 5 images per second; first image 1.5 s; time of the"
        " page relative to native code 1.6.",
    ]
    report.write("web", "raycam in a page", notes, ["what", "best", "median", "a second"], rows)


if __name__ == "__main__":
    main()
