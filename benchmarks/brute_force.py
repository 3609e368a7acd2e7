"""Compares rays through a hundred meshes with brute force in float64.

    python benchmarks/brute_force.py [--rays 1e7, for each mesh]

Runs the example `brute` of crates/bvh. An answer is wrong if it differs by more than the tolerance for ties.
The exit status is not 0 if any answer is wrong.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

import report

ROOT = Path(__file__).resolve().parent.parent
NOTES = [
    "There are twenty meshes of each kind, with 1 to 90 triangles, scaled by 1e-3 to 1e4, at the origin or at a",
    "distance of 20 times their size. Rays are aimed at triangles, edges and corners, along axes, from surfaces and",
    "from far away, and are long or short. For each ray, the nearest hit and any hit are found. For one ray in eight,",
    "the float64 hit, any float64 hit, the number of crossings (counted: if no crossing is within the band) and the",
    "point closest to the ray's origin are found too. Instruction sets and the three qualities alternate. Brute force",
    "intersects every triangle in float64, in Plücker coordinates. On both sides of an edge, the tie band is 1e-6 of",
    "the distance from the ray's origin to the triangle; on both sides of the triangle's plane, it is this value times",
    "the triangle's ratio of length to width (float64 results: 1e-13). A result is wrong if the ray misses its",
    "triangle by more than the band, if its t differs by more, or if a nearer hit is outside the band. Ties are hits",
    "within the band of an edge, of another triangle, or of an end of the ray.",
]


def main() -> None:
    """Runs the example and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=float, default=1e7)
    options = parser.parse_args()
    cargo = ["cargo", "build", "-q", "--locked", "--release", "-p", "raycam-bvh", "--example", "brute"]
    subprocess.run(cargo, cwd=ROOT, check=True)
    brute = [str(ROOT / "target/release/examples/brute"), str(options.rays)]
    done = subprocess.run(brute, stdout=subprocess.PIPE, text=True, check=False)
    row = r"^(\w+) +(\d+) rays +(\d+) hits +(\d+) ties +(\d+) counted +(\d+) points +(\d+) wrong$"
    found = re.findall(row, done.stdout, re.M)
    rows = [[name, *(f"{int(n):,}" for n in numbers)] for name, *numbers in found]
    head = ["kind", "rays", "hits", "ties", "counted", "points", "wrong"]
    report.write(
        "brute-force",
        "Hits, crossings and closest points compared with brute force",
        [" ".join(NOTES)],
        head,
        rows,
    )
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
