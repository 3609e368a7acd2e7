"""Measures the gain of a second thread for rays, in raycam and Embree, in alternation.

    python benchmarks/two_threads.py [--seed 1] [--size 2896 2172] [--rounds 3]

Scenes and rays are those of `embree_race.py`, but a run has so many rays that it takes a second instead of
ten milliseconds. In a short run, the time in which one thread waits for the last batch of the other thread
would matter. Embree runs at medium quality; for each number of threads, its fastest mode counts.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path

import embree_race
import embree_race_scenes
import report

ROOT = Path(__file__).resolve().parent.parent
RAY_BENCH = ROOT / "target/release/examples/ray_bench"


def ours(scene: Path, files: list[str], threads: int) -> list[str]:
    """Returns the command that casts the rays with raycam."""
    return [str(RAY_BENCH), f"{scene}.tri", "--threads", str(threads), "--repeat", "5", *files]


def theirs(driver: Path, scene: Path, size: tuple[int, int], threads: int) -> list[str]:
    """Returns the command that casts the same rays with Embree."""
    return [str(driver), str(scene), "--threads", str(threads), "--size", "{}x{}".format(*size)]


def main() -> None:
    """Measures and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", type=int, nargs=2, default=[2896, 2172], help="image size in pixels")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    size = (options.size[0], options.size[1])
    cargo = ["cargo", "build", "-q", "--locked", "--release", "-p", "raycam-bvh", "--example", "ray_bench"]
    subprocess.run(cargo, cwd=ROOT, check=True)
    rows = []
    gains: list[list[float]] = [[], []]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        driver = embree_race.embree_driver(folder)
        embree_race_scenes.write(folder, options.seed)
        files = [str(folder / f"{kind}.rays") for kind in embree_race.CLASSES]
        for name in embree_race_scenes.TRIANGLES:
            scene = folder / name
            dump = ["--dump", str(folder)]
            found = [[embree_race.run([*theirs(driver, scene, size, n), *dump])] for n in (1, 2)]
            rounds = range(options.rounds)
            turns = [[embree_race.run(ours(scene, files, n)) for n in (1, 2)] for _ in rounds]
            played = [[turn[k] for turn in turns] for k in (0, 1)]
            for kind in embree_race.CLASSES:
                row = [name, kind]
                for which, runs in enumerate((played, found)):
                    one, two = (max(run[kind] for run in of_threads) for of_threads in runs)
                    gains[which].append(two / one)
                    row += [f"{one:.2f}", f"{two:.2f}", f"{two / one:.3f}"]
                rows.append(row)
                print(row, flush=True)
    means = [f"{embree_race.mean(gain):.3f}" for gain in gains]
    rows.append(["geometric mean", "", "", "", means[0], "", "", means[1]])
    head = ["scene", "class", "raycam, 1 thread", "2", "ratio", "Embree, 1 thread", "2", "ratio"]
    notes = [
        f"Million rays per second; generated scenes with seed {options.seed}; {size[0]} x {size[1]} primary "
        "rays, and the "
        f"shadow and bounce rays from their hits; best of {options.rounds} times 5 (Embree: 7)."
    ]
    report.write("two_threads", "Two threads compared with one thread", notes, head, rows)


if __name__ == "__main__":
    main()
