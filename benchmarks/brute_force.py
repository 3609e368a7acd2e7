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
    "Twenty meshes of a kind, of 1 to 90 triangles, scaled 1e-3 to 1e4, around the origin or 20 sizes beside it;",
    "rays at triangles, edges and corners, along axes, from surfaces and from afar, long and short, each asked",
    "for its nearest hit and for any hit, one in eight for its float64 hit, any float64 hit, the number of its",
    "crossings (counted: where none is within the band) and the point closest to its origin. The instruction sets",
    "and the three qualities take turns. Brute force has every triangle in float64, in Plücker coordinates. The",
    "tie band is 1e-6 of the distance from the ray's origin to the triangle on either side of an edge, and as",
    "many times that on either side of its plane as it is longer than wide (float64 answers: 1e-13). An answer is",
    "wrong if its triangle is not met within the band, if its t is off by more, or if anything met outside of the",
    "band is nearer. Ties are hits that lie within the band of an edge, of another triangle or of an end of the",
    "ray.",
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
        "brute-force", "Hits, crossings and closest points against brute force", [" ".join(NOTES)], head, rows
    )
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
