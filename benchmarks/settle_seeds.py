"""Drops piles of parts into a bin, one per seed, and measures how far their meshes overlap.

    python benchmarks/settle_seeds.py --seeds 1000 --parts 20

Run the script in the project's root. The penetration of the meshes is measured with trimesh and FCL. The
script prints a line of JSON per seed, with the processor time of `settle`, and a summary at the end.
`--first` continues an earlier run, and `--quiet` prints the summary only. The exit status is 1 if a seed
fails, or if meshes penetrate each other by more than 0.2 mm.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
import warnings
from pathlib import Path

import raycam

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.bin_of_parts import bin_of_parts
from support.penetration import fcl_penetration

MAX_PENETRATION_MM = 0.2


def settle_pile(parts: int, seed: int) -> dict[str, object]:
    """Settles one pile of parts, and returns its measurements.

    These are the seed, the number of draws, the processor time, and the penetration according to raycam and
    to FCL.
    """
    world, names = bin_of_parts(parts)
    start = time.process_time()
    try:
        report = raycam.settle(world, names, into="bin", seed=seed)
    except raycam.WorldError as error:
        return {"seed": seed, "error": str(error), "s": round(time.process_time() - start, 2)}
    seconds = time.process_time() - start
    return {
        "seed": seed,
        "draws": report.attempts,
        "s": round(seconds, 2),
        "own_mm": round(1e3 * report.penetration, 4),
        "fcl_mm": round(1e3 * fcl_penetration(world), 4),
    }


def main() -> None:
    """Settles the piles and prints the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1000, help="number of seeds")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--parts", type=int, default=20, help="parts per pile")
    parser.add_argument("--quiet", action="store_true", help="print the summary only")
    options = parser.parse_args()
    warnings.simplefilter("error", raycam.Notice)
    rows = []
    for seed in range(options.first, options.first + options.seeds):
        rows.append(settle_pile(options.parts, seed))
        if not options.quiet:
            print(json.dumps(rows[-1]), flush=True)
    settled = [row for row in rows if "error" not in row]
    deep = [row for row in settled if row["fcl_mm"] > MAX_PENETRATION_MM]
    times = [row["s"] for row in settled]
    print(
        f"{len(rows)} piles of {options.parts} parts: {len(rows) - len(settled)} not settled, {len(deep)} penetrate by"
        f" more than {MAX_PENETRATION_MM} mm; deepest {max(row['fcl_mm'] for row in settled):.3f} mm; processor time"
        f" median {statistics.median(times):.2f} s, maximum {max(times):.2f} s; draws: mean"
        f" {statistics.mean(row['draws'] for row in settled):.2f}, maximum {max(row['draws'] for row in settled)}"
    )
    sys.exit(1 if deep or len(settled) < len(rows) else 0)


if __name__ == "__main__":
    main()
