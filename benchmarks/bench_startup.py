"""Compares the time from process start to process end for one image with other renderers.

The renderers run in alternation.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import report

BOX = """
[camera]
size = [640, 480]
focal = 800
location = [4, -6, 3]
pitch = 20
yaw = 125

[[object]]
box = { size = [1, 1, 1] }
color = [0.8, 0.1, 0.1]

[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]
"""
CORNELL = """
import mitsuba as mi
mi.set_variant("scalar_rgb")
mi.render(mi.load_dict(mi.cornell_box()), spp=1)
"""
RIVALS = {
    "import trimesh": "import trimesh",
    "import pyrender": "import numpy; numpy.infty = numpy.inf; import pyrender",
    "import open3d": "import open3d",
    "import mitsuba": "import mitsuba",
    "mitsuba scalar_rgb, Cornell box 256 x 256, 1 sample": CORNELL,
}


def process_seconds(command: list[str]) -> float | None:
    """Returns the wall time of a process from start to end; None if it fails."""
    start = time.perf_counter()
    done = subprocess.run(command, check=False, capture_output=True)
    return time.perf_counter() - start if done.returncode == 0 else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--rounds", type=int, default=9, help="number of runs per program; the programs take turns"
    )
    parser.add_argument("--peers", help="Python interpreter with the other programs")
    options = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder, "box.toml")
        world.write_text(BOX, encoding="utf-8")
        picture = str(Path(folder, "box.png"))
        raycam = str(Path(sys.executable).with_name("raycam"))
        render = [raycam, "render", str(world), "-o", picture]
        ours = {
            "import numpy": [sys.executable, "-c", "import numpy"],
            "import raycam": [sys.executable, "-c", "import raycam"],
            "raycam render box.toml, 640 x 480, lit, 1 sample": [*render, "--samples", "1"],
            "raycam render box.toml, 640 x 480, lit, 16 samples": [*render, "--samples", "16"],
        }
        theirs = {}
        if options.peers:
            theirs["import numpy, in the environment of the other renderers"] = [
                options.peers,
                "-c",
                "import numpy",
            ]
            theirs |= {name: [options.peers, "-c", code] for name, code in RIVALS.items()}
        commands = ours | theirs
        seconds: dict[str, list[float | None]] = {name: [] for name in commands}
        for command in commands.values():
            process_seconds(command)  # fills the page cache and compiles .pyc files
        for _ in range(options.rounds):
            for name, command in commands.items():
                seconds[name].append(process_seconds(command))

    rows = []
    for names in (ours, theirs):
        numpy_median = None
        for name in names:
            times = [value for value in seconds[name] if value is not None]
            if not times:
                rows.append([name, "fails", "", ""])
                continue
            best, median = report.spread(times)
            numpy_median = median if numpy_median is None else numpy_median
            rows.append([name, f"{best:.3f}", f"{median:.3f}", f"{median - numpy_median:+.3f}"])
    notes = [
        f"Elapsed seconds of whole processes, {options.rounds} rounds in alternation. The last column is the "
        "median minus"
        " the median of `import numpy` in the same environment."
    ]
    report.write(
        "startup", "Time until the first image", notes, ["process", "best", "median", "beyond numpy"], rows
    )


if __name__ == "__main__":
    main()
