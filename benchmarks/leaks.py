"""Counts rays that pass through edges and vertices of closed meshes, in raycam and Embree.

    python benchmarks/leaks.py [--rays 1e9] [--sample 1e7] [--isa NAME]

Runs the example `leaks` of crates/bvh with all rays, and Embree with the first rays of each mesh (through
embreex, in the modes fast and robust). The exit status is not 0 if a ray passes through a mesh in raycam.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import report

ROOT = Path(__file__).resolve().parent.parent


def embree_leaks(folder: Path, number: int, robust: bool) -> np.ndarray:
    """Returns three counts of one Embree query, [3] int: rays, leaks, and leaks of inner rays.

    Inner rays start inside the mesh and have no maximum length.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    data = np.fromfile(folder / f"{number}.tri", "<u4")
    vertices = data[2 : 2 + 3 * data[0]].view("<f4").reshape(-1, 3).copy()
    triangles = data[2 + 3 * data[0] :].astype(np.int32).reshape(-1, 3)
    scene = EmbreeScene(robust=robust)
    mesh = TriangleMesh(scene, vertices, triangles)
    rays = np.fromfile(folder / f"{number}.rays", "<f4").reshape(-1, 7)
    count = np.zeros(3, int)
    for part in np.array_split(rays, max(1, len(rays) // 100_000)):
        origins, directions, t_max = (np.ascontiguousarray(a) for a in np.split(part, [3, 6], axis=1))
        # Embree requires a finite ray length; all meshes are within this length.
        ends = np.minimum(t_max[:, 0], np.float32(1e30))
        near = scene.run(origins, directions, ends) < 0
        dark = scene.run(origins, directions, ends, query="OCCLUDED") < 0
        count += [len(part), (near | dark).sum(), ((near | dark) & np.isinf(t_max[:, 0])).sum()]
    del mesh
    return count


def main() -> None:
    """Runs the example `leaks` and Embree, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=float, default=1e9)
    parser.add_argument("--sample", type=float, default=1e7, help="number of rays traced by Embree")
    parser.add_argument("--isa", help="raycam's instruction set (default: the widest)")
    options = parser.parse_args()
    cargo = ["cargo", "build", "-q", "--locked", "--release", "-p", "raycam-bvh", "--example", "leaks"]
    subprocess.run(cargo, cwd=ROOT, check=True)
    leaks = str(ROOT / "target/release/examples/leaks")
    isa = [] if options.isa is None else ["--isa", options.isa]
    done = subprocess.run([leaks, str(options.rays), *isa], stdout=subprocess.PIPE, text=True, check=False)
    ours = re.findall(r"^(.+?) +(\d+) rays +(\d+) leaks(?:  \((\w+)\))?$", done.stdout, re.M)
    with tempfile.TemporaryDirectory() as folder:
        dump = [leaks, str(options.sample), "--dump", folder]
        names = subprocess.run(dump, capture_output=True, text=True, check=True).stdout.splitlines()
        theirs = [
            [embree_leaks(Path(folder), n, robust) for robust in (False, True)] for n in range(len(names))
        ]
    theirs.append(list(np.sum(theirs, axis=0)))
    rows = []
    for (name, rays, through, _), (fast, robust) in zip(ours, theirs, strict=True):
        leaked = [f"{count:,} ({inside:,})" for _, count, inside in (fast, robust)]
        rows.append([name, f"{int(rays):,}", through, f"{fast[0]:,}", *leaked])
    notes = [
        "Rays are aimed at points on vertices (a quarter of the rays) and edges of closed meshes, or within 4 ulp of",
        "such points. Half of the rays start inside; the others start outside, at 0.01 to 1000 times the mesh's size,",
        "and end deep inside. For each ray, the nearest hit and any hit are found, in packets and as a single ray, and",
        f"for one ray in 16 also the float64 hit; every miss is a leak. raycam: {ours[-1][3]}; the qualities fast,",
        "default and high alternate. Embree: nearest and any hits of the first rays of every mesh, through embreex; if",
        "raycam places a mesh by a matrix, Embree uses the transformed mesh. In brackets: leaks of rays from inside.",
    ]
    head = ["mesh", "rays", "leaks", "rays for Embree", "Embree's leaks", "Embree robust"]
    report.write("leaks", "Rays that pass through closed meshes", [" ".join(notes)], head, rows)
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
