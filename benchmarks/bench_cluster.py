"""Injects faults into a Dask cluster of four processes.

Checks that the cluster's jobs lose no frame.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import report
from raycam.jobs import scheduler
from support.cluster_faults import SHARE, connected, poison, scheduler_lost, storm

Row = list[str]
WORKERS = 4


def storms(folder: Path, count: int, pause: float) -> list[Row]:
    """Kills workers, suspends and resumes one worker, and delivers every result twice."""
    rows = []
    for seed in range(count):
        (folder / f"storm{seed}").mkdir()
        pool = connected(f"local:{WORKERS}")
        try:
            # The other three workers take half a second per frame, so the job takes longer than the pause.
            seen = storm(
                folder / f"storm{seed}",
                pool,
                frames=round((pause + 30) * (WORKERS - 1) * 2),
                each=0.5,
                pause=pause,
                seed=seed,
            )
        finally:
            pool.close()
        back = "during the job" if seen.returned else "after the job"
        rows.append(
            [
                f"{seen.killed} of {WORKERS} workers killed at random, another paused for {seen.paused:.0f} s, "
                f"back {back}; every result delivered twice",
                f"{seen.frames} frames, {seen.asked} assigned, {seen.seconds:.0f} s",
                "0 bytes differ",
            ]
        )
        print(rows[-1], file=sys.stderr)
    return rows


def poisons(folder: Path) -> list[Row]:
    """Runs a job in which one frame kills every worker that renders it."""
    pool = connected(f"local:{WORKERS}")
    try:
        start = time.perf_counter()
        poison(folder, pool, frames=100, number=37)
        seconds = time.perf_counter() - start
    finally:
        pool.close()
    return [
        [
            "a frame that ends every worker that renders it",
            f"100 frames, {seconds:.0f} s",
            f"abandoned after {scheduler.MAX_ATTEMPTS} deaths, 99 finished; with --retry-failed, 0 bytes differ",
        ]
    ]


def schedulers(folder: Path, count: int) -> list[Row]:
    """Kills the scheduler during a job, and resumes the job with the same command."""
    frames, finished = 40, []
    for number in range(count):
        one = folder / f"scheduler{number}"
        one.mkdir()
        finished.append(scheduler_lost(one, frames=frames, after=5 + 10 * number)[0])
        print(finished, file=sys.stderr)
    return [
        [
            "the scheduler is killed, another one is started, and the command is repeated",
            f"{count} times, {frames} frames, {', '.join(map(str, finished))} of them finished by then",
            "no finished frame was lost or rendered again, 0 bytes differ",
        ]
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=["storms", "poison", "scheduler"])
    parser.add_argument("--storms", type=int, default=3)
    parser.add_argument("--pause", type=float, default=60.0)
    parser.add_argument("--schedulers", type=int, default=3)
    options = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts: dict[str, Callable[[], list[Row]]] = {
            "storms": lambda: storms(folder, options.storms, options.pause),
            "poison": lambda: poisons(folder),
            "scheduler": lambda: schedulers(folder, options.schedulers),
        }
        for part in options.parts:
            rows += parts[part]()
    notes = [
        f"Every job is compared, byte for byte, with a job of a single process. {SHARE:.0%} of {WORKERS} "
        "workers, rounded up,"
        " are killed.",
    ]
    report.write("cluster", "A cluster with many faults", notes, ["what", "how much", "result"], rows)


if __name__ == "__main__":
    main()
