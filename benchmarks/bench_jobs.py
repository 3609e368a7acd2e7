"""Tests jobs that are killed, and measures their cost in addition to rendering."""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import raycam
import report
from raycam.cluster import make_pool
from raycam.jobs import Job
from raycam.video import VideoPlan
from support.job_frames import Pool, check_intact, in_child, killing_at, package, results, world

Row = list[str]


def kills(folder: Path, count: int) -> list[Row]:
    """Kills a job at every step and at random times.

    Returns rows with the numbers of damaged files, lost frames and different bytes.
    """
    plan = package()
    Job(folder / "whole", plan).run(Pool())
    whole = results(folder / "whole")
    rows = []

    def recover(one: Path) -> tuple[int, int]:
        finished = check_intact(
            one, whole
        )  # raises an error if a final file is damaged or a frame is missing
        pool = Pool()
        Job(one, plan).run(pool)
        if len(pool.made) != 8 - finished or results(one) != whole:
            raise AssertionError(one)
        return finished, 0

    for part, name in ((False, "before"), (True, "during or after")):
        step = 0
        while True:
            step += 1
            one = folder / f"step{part}{step}"

            def work(step: int = step, one: Path = one, part: bool = part) -> None:
                killing_at(step, part)
                Job(one, plan).run(Pool())

            ended = in_child(work)
            recover(one)
            if ended == 0:
                break
        rows.append(
            [
                f"kills {name} each write, sync, rename, new folder",
                f"{step - 1}",
                "0 damaged, 0 lost, 0 differ",
            ]
        )

    start = time.perf_counter()
    in_child(lambda: Job(folder / "timed", plan).run(Pool()))
    length = time.perf_counter() - start
    chance = random.Random(1)
    between = 0
    for number in range(count):
        one = folder / f"random{number}"
        pid = os.fork()
        if pid == 0:
            Job(one, plan).run(Pool())
            os._exit(0)
        time.sleep(chance.uniform(0, length))
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        finished, _ = recover(one)
        between += 0 < finished < 8
    rows.append(
        [
            "kills at random times",
            f"{count} ({between} after the first frame and before the last)",
            "0 damaged, 0 lost, 0 differ",
        ]
    )
    return rows


def overhead(folder: Path, where: object, name: str, frames: int) -> Row:
    """Returns a row with the time per frame for frames that take almost no time to render."""
    one = VideoPlan(world(), integrator="flat", samples=1, fps=frames, seconds=1.0).package()
    job = Job(folder / name.replace(" ", "-"), one)
    with make_pool(where, threads=1) as pool:  # type: ignore[arg-type]
        job.run(pool, frames=range(8))  # starts the workers before the measurement
        start = time.perf_counter()
        job.run(pool)
        seconds = time.perf_counter() - start
    return [
        f"{name}: total time of a frame, 16 x 12 pixels",
        f"{frames - 8} frames",
        f"{1000 * seconds / (frames - 8):.2f} ms",
    ]


def bare(frames: int) -> Row:
    """Returns a row with the time per frame for rendering and encoding frames without a job."""
    one = VideoPlan(world(), integrator="flat", samples=1, fps=frames, seconds=1.0, threads=1)
    one.frame(0)
    start = time.perf_counter()
    for number in range(200):
        one.frame(number).to_png()
    return [
        "only rendering and PNG encoding of the same frames",
        "200 frames",
        f"{5 * (time.perf_counter() - start):.2f} ms",
    ]


def long_job(folder: Path, frames: int) -> list[Row]:
    """Returns memory and open files of this process during a long job."""
    one = VideoPlan(world(), integrator="flat", samples=1, fps=frames, seconds=1.0).package()
    seen: dict[int, tuple[int, int]] = {}
    marks = [frames // 20, frames // 10, frames // 4, frames // 2, frames * 3 // 4, frames]

    def look(done: int, total: int, failed: int) -> None:
        if done in marks:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            seen[done] = (pages * os.sysconf("SC_PAGE_SIZE"), len(os.listdir("/proc/self/fd")))

    start = time.perf_counter()
    with make_pool(None, threads=1) as pool:
        Job(folder / "long", one).run(pool, progress=look)
    seconds = time.perf_counter() - start
    early, late = seen[frames // 10][0], seen[frames][0]
    return [
        [
            f"{frames} frames: resident KiB at 5, 10, 25, 50, 75 and 100 %",
            f"{seconds:.0f} s",
            f"{', '.join(str(seen[mark][0] >> 10) for mark in marks)} ({100 * (late / early - 1):+.2f} % since 10 %)",
        ],
        [
            f"{frames} frames: number of open files at the same points",
            "",
            ", ".join(str(seen[mark][1]) for mark in marks),
        ],
    ]


def scaling(folder: Path, rounds: int, frames: int, samples: int) -> Row:
    """Compares two workers with one worker that has one thread, on two cores.

    The workers run in alternation; the row contains the best round of each.
    """
    scene = raycam.World()
    scene.add_object(torus={"radius": 1, "tube": 0.4}, name="ring", refine=2)
    scene.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5])
    scene.add_light({"type": "sky", "radiance": [1, 1, 1]})
    scene.add_camera(raycam.Camera.look_at([3, -2, 2], [0, 0, 0], size=(480, 360), fov=45))
    # The camera does not move, so that every round does the same work.
    scene.set_video(fps=frames * (rounds + 1), seconds=1.0)
    package = VideoPlan(scene, samples=samples).package()
    seconds: dict[int, list[float]] = {1: [], 2: []}
    with make_pool(1, threads=1) as one, make_pool(2) as two:
        for number in range(rounds + 1):
            for count, pool in ((1, one), (2, two)):
                pool.slots()
                start = time.perf_counter()
                part = range(number * frames, (number + 1) * frames)
                Job(folder / f"scale{count}", package).run(pool, frames=part)
                seconds[count].append(time.perf_counter() - start)
    best = {
        count: min(times[1:]) for count, times in seconds.items()
    }  # the first round includes starting the workers
    return [
        f"2 workers compared with 1, frames of {best[1] / frames:.2f} s",
        f"{rounds} rounds of {frames} frames in alternation, the best of each",
        f"{best[1] / best[2]:.2f}x",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=["kills", "overhead", "long", "scaling"])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--frames", type=int, default=10_000)
    options = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts: dict[str, Callable[[], list[Row]]] = {
            "kills": lambda: kills(folder, options.kills),
            "overhead": lambda: [
                bare(400),
                overhead(folder, None, "this process", 400),
                overhead(folder, 2, "2 processes", 400),
                overhead(folder, "local:2", "Dask local 2", 400),
            ],
            "long": lambda: long_job(folder, options.frames),
            "scaling": lambda: [scaling(folder, 3, 16, 16)],
        }
        for part in options.parts:
            rows += parts[part]()
            print(*rows[-3:], sep="\n", file=sys.stderr)
    notes = [
        "After every kill, another run resumes the job; the bytes are compared with those of an uninterrupted run."
    ]
    report.write("jobs", "Jobs", notes, ["what", "how much", "result"], rows)


if __name__ == "__main__":
    main()
