"""Compares ray and point queries with trimesh (with embreex) and Open3D.

    python benchmarks/bench_queries.py [--queries 100000] [--rounds 5] [--only rates|right] [--mesh scan.ply ...]

The tables contain rates and numbers of wrong results. Rates are queries per second of CPU time of all
threads: the best of the rounds, in which the libraries alternate. The meshes are a ball and a torus unless
files are given. Libraries that are not installed are omitted.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import raycam
import report

try:
    import open3d
except ImportError:
    open3d = None
try:
    import trimesh
except ImportError:
    trimesh = None
try:
    import igl
except ImportError:
    igl = None

Mesh = tuple[np.ndarray, np.ndarray]
Peers = dict[str, Callable[[], Any]]


def ball(level: int) -> Mesh:
    """Returns a unit ball of 20 * 4^level triangles."""
    world = raycam.World()
    world.add_object(sphere={"radius": 1, "level": level})
    return indexed(world)


def torus(rings: int, sides: int) -> Mesh:
    """Returns a torus of 2 * rings * sides triangles."""
    a, b = np.meshgrid(
        np.arange(rings) * 2 * np.pi / rings, np.arange(sides) * 2 * np.pi / sides, indexing="ij"
    )
    r = 1 + 0.4 * np.cos(b)
    vertices = np.stack([r * np.cos(a), r * np.sin(a), 0.4 * np.sin(b)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    p, q = i * sides + j, i * sides + (j + 1) % sides
    s, t = (i + 1) % rings * sides + j, (i + 1) % rings * sides + (j + 1) % sides
    return vertices, np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((p, s, t), (p, t, q))])


def indexed(world: raycam.World) -> Mesh:
    """Returns all triangles of a world as one mesh."""
    vertices, index = np.unique(world.triangles().reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def cube(low: float, high: float) -> Mesh:
    """Returns a box from (low, low, low) to (high, high, high)."""
    world = raycam.World()
    world.add_object(box={"size": high - low}, location=[(low + high) / 2] * 3)
    return indexed(world)


class Engines:
    """The same mesh in every installed library."""

    def __init__(self, mesh: Mesh) -> None:
        vertices, faces = mesh
        self.world = raycam.World()
        self.world.add_mesh(vertices, faces)
        self.scene = self.mesh = None
        if open3d is not None:
            self.scene = open3d.t.geometry.RaycastingScene()
            self.scene.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
        if trimesh is not None:
            self.mesh = trimesh.Trimesh(vertices, faces, process=False)

    def queries(self, origins: np.ndarray, directions: np.ndarray, near: np.ndarray) -> dict[str, Peers]:
        """Returns each library's function for each query.

        `origins` are random points in the mesh's box, `near` are points close to its surface.
        """
        rays = np.concatenate([origins, directions], axis=1).astype(np.float32)
        box32, near32 = origins.astype(np.float32), near.astype(np.float32)
        world, scene, mesh = self.world, self.scene, self.mesh
        found: dict[str, Peers] = {
            "first hit": {"raycam": lambda: world.cast_rays(origins, directions)},
            "any hit": {"raycam": lambda: world.occluded(origins, directions)},
            "count": {"raycam": lambda: world.count_intersections(origins, directions)},
            "list": {"raycam": lambda: world.intersections(origins, directions)},
            "inside, in the box": {"raycam": lambda: world.inside(origins)},
            "closest, in the box": {"raycam": lambda: world.closest_points(origins)},
            "closest, near": {"raycam": lambda: world.closest_points(near)},
            "signed distance, in the box": {"raycam": lambda: world.signed_distance(origins)},
        }
        if scene is not None:
            calls: list[Callable[[], Any]] = [
                lambda: scene.cast_rays(rays),
                lambda: scene.test_occlusions(rays),
                lambda: scene.count_intersections(rays),
                lambda: scene.list_intersections(rays),
                lambda: scene.compute_occupancy(box32),
                lambda: scene.compute_closest_points(box32),
                lambda: scene.compute_closest_points(near32),
                lambda: scene.compute_signed_distance(box32),
            ]
            for peers, call in zip(found.values(), calls, strict=True):
                peers["Open3D"] = call
        if mesh is not None:
            found["first hit"]["trimesh"] = lambda: mesh.ray.intersects_first(origins, directions)
            found["any hit"]["trimesh"] = lambda: mesh.ray.intersects_any(origins, directions)
            found["list"]["trimesh"] = lambda: mesh.ray.intersects_location(origins, directions)
            found["inside, in the box"]["trimesh"] = lambda: mesh.contains(origins)
        return found


def rates(meshes: dict[str, Mesh], count: int, rounds: int) -> None:
    """Prints and saves the table of rates."""
    random = np.random.default_rng(1)
    rows = []
    for name, mesh in meshes.items():
        low, high = mesh[0].min(axis=0), mesh[0].max(axis=0)
        origins = random.uniform(low, high, (count, 3))
        directions = random.normal(size=(count, 3))
        corners = mesh[0][mesh[1][random.integers(len(mesh[1]), size=count)]]
        near = corners.mean(axis=1) + random.normal(size=(count, 3)) * 0.01 * np.linalg.norm(high - low)
        for query, peers in Engines(mesh).queries(origins, directions, near).items():
            best = dict.fromkeys(peers, float("inf"))
            for turn in range(rounds + 1):
                for peer, call in peers.items():
                    start = time.process_time()
                    call()
                    if turn:
                        best[peer] = min(best[peer], time.process_time() - start)
            speed = {peer: count / seconds / 1e6 for peer, seconds in best.items()}
            cells = [
                f"{speed[peer]:.3f}" if peer in speed else "-" for peer in ("raycam", "Open3D", "trimesh")
            ]
            ratios = [
                f"{speed['raycam'] / speed[p]:.2f}" if p in speed else "-" for p in ("Open3D", "trimesh")
            ]
            rows.append([f"{name}: {query}", *cells, *ratios])
    report.write(
        "queries",
        "Queries compared with Open3D and trimesh",
        [f"Million queries per CPU second of all threads, {count} random queries, best of {rounds} rounds."],
        ["mesh: query", "raycam", "Open3D", "trimesh", "to Open3D", "to trimesh"],
        rows,
    )


def libigl_insides(mesh: Mesh, points: np.ndarray) -> list[np.ndarray | None]:
    """Returns two inside tests of libigl's signed distances, bool [n] each.

    The first uses pseudonormals, the second fast winding numbers; both are None if libigl is not installed.
    """
    if igl is None:
        return [None, None]
    kinds = igl.SignedDistanceType
    kind = (kinds.SIGNED_DISTANCE_TYPE_PSEUDONORMAL, kinds.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER)
    faces = mesh[1].astype(np.int64)
    return [igl.signed_distance(points, mesh[0], faces, sign_type=one)[0] < 0 for one in kind]


def wrong_insides(mesh: Mesh, points: np.ndarray, expected: np.ndarray) -> list[str]:
    """Returns, for each library, the number of points with a wrong inside test."""
    engines = Engines(mesh)
    answers: list[np.ndarray | None] = [engines.world.inside(points), None, None]
    if engines.scene is not None:
        answers[1] = engines.scene.compute_occupancy(points.astype(np.float32)).numpy() > 0.5
    if engines.mesh is not None:
        answers[2] = engines.mesh.contains(points)
    answers += libigl_insides(mesh, points)
    return ["-" if answer is None else str(int((answer != expected).sum())) for answer in answers]


def wrong_counts(mesh: Mesh, origins: np.ndarray, directions: np.ndarray, expected: int | None) -> list[str]:
    """Returns, for each library, the number of rays with a wrong count of crossings.

    If `expected` is None, every even count is correct.
    """
    engines = Engines(mesh)
    counts: list[np.ndarray | None] = [engines.world.count_intersections(origins, directions), None, None]
    if engines.scene is not None:
        rays = np.concatenate([origins, directions], axis=1).astype(np.float32)
        counts[1] = engines.scene.count_intersections(rays).numpy()
    if engines.mesh is not None:
        ray = engines.mesh.ray.intersects_id(origins, directions)[1]
        counts[2] = np.bincount(ray, minlength=len(origins))
    if igl is not None:
        faces = mesh[1].astype(np.int64)
        hits = [
            igl.ray_mesh_intersect(o, d, mesh[0], faces) for o, d in zip(origins, directions, strict=True)
        ]
        counts.append(np.array([len(one or []) for one in hits]))
    wrong = [None if c is None else (c % 2 != 0 if expected is None else c != expected) for c in counts]
    cells = ["-" if answer is None else str(int(answer.sum())) for answer in wrong]
    return cells + ["-"] * (5 - len(cells))


def right() -> None:
    """Prints and saves the table of wrong results."""
    random = np.random.default_rng(7)
    points = random.uniform(-0.2, 1.7, (4000, 3))
    (v1, f1), (v2, f2) = cube(0, 1), cube(0.5, 1.5)
    both = np.concatenate([v1, v2]), np.concatenate([f1, f2 + len(v1)])
    inside = ((points >= 0) & (points < 1)).all(axis=1) | ((points >= 0.5) & (points < 1.5)).all(axis=1)
    rows = [["two cubes that overlap in one mesh", "4,000", *wrong_insides(both, points, inside)]]
    lid = (v1[f1][:, :, 2] == 1).all(axis=1)
    lower = random.uniform(0, 1, (4000, 3)) * [1, 1, 0.49]
    rows.append(
        [
            "the lower half of a box without a lid",
            "4,000",
            *wrong_insides((v1, f1[~lid]), lower, np.full(4000, True)),
        ]
    )
    turned = f1.copy()
    turned[::3] = turned[::3, ::-1]
    expected = ((points >= 0) & (points < 1)).all(axis=1)
    rows.append(
        [
            "a cube in which a third of the triangles are reversed",
            "4,000",
            *wrong_insides((v1, turned), points, expected),
        ]
    )
    away = np.array([220e3, 0, 0])
    rows.append(
        ["cube 220 km from the origin", "4,000", *wrong_insides((v1 + away, f1), points + away, expected)]
    )
    vertices, faces = ball(5)
    eyes = np.tile([0.3, 0.2, 5.0], (len(vertices), 1))
    counts = wrong_counts((vertices, faces), eyes, vertices - eyes, None)
    rows.append(["rays through the vertices of a ball: odd counts", f"{len(vertices):,}", *counts])
    gap = np.concatenate([v1 * 5, v1 * 5 + [5 + 2e-6, 0, 0]]), np.concatenate([f1, f1 + len(v1)])
    starts = np.concatenate([np.full((1000, 1), -1.0), random.uniform(0.1, 4.9, (1000, 2))], axis=1)
    across = np.tile([1.0, 0, 0], (1000, 1))
    rows.append(
        [
            "rays through four walls, of which two are 2 um apart",
            "1,000",
            *wrong_counts(gap, starts, across, 4),
        ]
    )
    edges = ((v1[f1] + np.roll(v1[f1], 1, axis=1)) / 2).reshape(-1, 3)
    outside = edges + random.normal(size=edges.shape) * 3
    counts = wrong_counts((v1, f1), outside, (edges - outside), None)
    rows.append(["rays through the edges of a cube: odd counts", str(len(edges)), *counts])
    versions = [f"{m.__name__} {m.__version__}" for m in (open3d, trimesh) if m is not None]
    if igl is not None:
        versions.append(f"libigl {importlib.metadata.version('libigl')}")
    report.write(
        "queries-right",
        "Correctness of the results",
        [
            f"Number of wrong results; points on surfaces are excluded. raycam {raycam.__version__}, "
            f"{', '.join(versions)}."
        ],
        [
            "",
            "queries",
            "raycam",
            "Open3D",
            "trimesh",
            "libigl (pseudonormals, rays)",
            "libigl (fast winding)",
        ],
        rows,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--queries", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", choices=["rates", "right"])
    parser.add_argument("--mesh", nargs="*", default=[])
    options = parser.parse_args()
    if options.only != "rates":
        right()
    if options.only != "right":
        meshes = {name: indexed(raycam.load(name)) for name in options.mesh}
        rates(meshes or {"ball": ball(6), "torus": torus(400, 125)}, options.queries, options.rounds)


if __name__ == "__main__":
    main()
