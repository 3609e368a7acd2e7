"""Compares rays with times, through moving meshes, with brute force in NumPy.

    python benchmarks/rays_with_times.py [--rays 1e6]

The brute force shares no code with raycam: it places every object at each ray's own time and intersects every triangle
in float64. The exit status is not 0 if any result is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import raycam
import report
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SECONDS = 1.0
BLOCK = 5000
"""The number of rays that are intersected at a time."""
TOLERANCE = 1e-9
"""Largest difference between two distances, in metres."""
BAND = 1e-9
"""Width of the band around edges, in barycentric coordinates, in which a hit or a miss is a tie."""
NOTES = [
    "Twelve moving objects, of 12 or 320 triangles, are in front of a fixed wall. Each ray has its own time",
    "within one second; the times of the first half of the rays ascend. `linear`: keyframes with positions,",
    "interpolated linearly. `turning`: a rotation of up to 150 degrees about the vertical axis. `trajectory`:",
    "four keyframes with positions and yaw, interpolated linearly. For each ray and object, the brute force",
    "places the object at the ray's time, in float64, and intersects every triangle (volumes of tetrahedra). A",
    "result is wrong if the distance differs by more than 1e-9 m, if the object or triangle differs although no",
    "other triangle is within 1e-9 m, or if `occluded` differs. Ties are rays that pass within 1e-9 (barycentric",
    "coordinates) of an edge of the triangle, or hit two triangles within 1e-9 m.",
]


@dataclass
class Moving:
    """An object of the brute force: its triangles, and its pose at any time."""

    triangles: Floats
    """Vertices [n, 3, 3] in the object's axes."""
    keys: Floats
    """Times [k], positions [k, 3] and yaw in degrees [k], as one array [k, 5]."""

    def pose(self, times: Floats) -> tuple[Floats, Floats]:
        """Returns positions [n, 3] and yaw in radians [n], interpolated linearly."""
        columns = [np.interp(times, self.keys[:, 0], self.keys[:, i]) for i in range(1, 5)]
        return np.stack(columns[:3], axis=1), np.radians(columns[3])


def icosphere() -> tuple[Floats, NDArray[np.int64]]:
    """Returns vertices and faces of a sphere of 320 triangles with uneven radii."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g)]
    points += [(g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    faces += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    corners = np.array(points, float)[np.array(faces)]
    for _ in range(2):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate(
            [np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    vertices, index = np.unique(corners.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    vertices *= 0.7 + 0.2 * np.sin(5 * vertices[:, :1]) + 0.1 * np.cos(7 * vertices[:, 1:2])
    return vertices.astype(np.float32).astype(float), index.reshape(-1, 3)


CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
CUBE_FACES = np.array(
    [
        *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
        *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
    ]
)


def motion(kind: str, random: np.random.Generator) -> Floats:
    """Returns random keyframes of an object: time, position, yaw."""
    count = {"linear": 2, "turning": 2, "trajectory": 4}[kind]
    times = np.linspace(0, SECONDS, count)
    places = random.uniform([-1, -4, -2], [4, 4, 2], (count, 3))
    yaw = np.zeros(count)
    if kind == "turning":
        places[:] = places[0]
        yaw = np.cumsum(random.uniform(-150, 150, count))
    if kind == "trajectory":
        yaw = np.cumsum(random.uniform(-80, 80, count))
    return np.column_stack([times, places, yaw])


def scene(kind: str, seed: int) -> tuple[raycam.World, list[Moving]]:
    """Returns the world at time 0, and the same objects for the brute force."""
    random, world = np.random.default_rng(seed), raycam.World()
    meshes = [(CUBE, CUBE_FACES), icosphere()]
    wall = CUBE * [0.5, 16, 12] + [7, 0, 0]
    world.add_object(vertices=wall, triangles=CUBE_FACES, name="wall")
    still = np.zeros((1, 5))
    objects, keys = [Moving(wall.astype(np.float32).astype(float)[CUBE_FACES], still)], []
    for number in range(12):
        vertices, faces = meshes[number % 2]
        world.add_object(vertices=vertices, triangles=faces, name=f"object {number}")
        rows = motion(kind, random)
        for row in rows.tolist():
            key: dict[str, Any] = {"time": row[0], "object": f"object {number}", "location": row[1:4]}
            keys.append(key if kind == "linear" else {**key, "yaw": row[4]})
        objects.append(Moving(vertices[faces], rows))
    world.set_video(fps=10, seconds=SECONDS, interpolation="linear", keyframe=keys)
    return world.at(0.0), objects


@dataclass
class Hits:
    """The results of the brute force for each ray."""

    t: Floats
    """The distance to the nearest hit; infinite for a miss."""
    second: Floats
    """The distance to the second-nearest hit."""
    instance: NDArray[np.int64]
    triangle: NDArray[np.int64]
    edge: Floats
    """Smallest distance to an edge of a triangle on the ray's line, in barycentric coordinates."""


def brute(objects: list[Moving], origins: Floats, directions: Floats, times: Floats) -> Hits:
    """Returns the nearest hit of each ray with every triangle at the ray's time."""
    count = len(times)
    best = Hits(
        np.full(count, np.inf),
        np.full(count, np.inf),
        np.full(count, -1),
        np.full(count, -1),
        np.full(count, np.inf),
    )
    for number, item in enumerate(objects):
        places, yaw = item.pose(times)
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        # The ray in the object's axes at the ray's time.
        moved = origins - places
        o = np.concatenate(
            [c * moved[:, :1] + s * moved[:, 1:2], c * moved[:, 1:2] - s * moved[:, :1], moved[:, 2:]], 1
        )
        d = np.concatenate(
            [
                c * directions[:, :1] + s * directions[:, 1:2],
                c * directions[:, 1:2] - s * directions[:, :1],
                directions[:, 2:],
            ],
            1,
        )
        a, e, f = (
            item.triangles[:, 0],
            item.triangles[:, 1] - item.triangles[:, 0],
            item.triangles[:, 2] - item.triangles[:, 0],
        )
        normal, moment = np.cross(e, f), np.cross(o, d)
        size = -d @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (moment @ f.T - d @ np.cross(f, a).T) / size
            v = (d @ np.cross(e, a).T - moment @ e.T) / size
            t = (o @ normal.T - (a * normal).sum(-1)) / size
            margin = np.minimum(np.minimum(u, v), 1 - u - v)
        valid = np.isfinite(margin) & (t > 0)
        best.edge = np.minimum(best.edge, np.where(valid, np.abs(margin), np.inf).min(1))
        t = np.where(valid & (margin >= 0), t, np.inf)
        order = np.argpartition(t, 1, axis=1)[:, :2]
        two = np.take_along_axis(t, order, 1)
        first = order[np.arange(count), two.argmin(1)]
        near, far = two.min(1), two.max(1)
        closer = near < best.t
        best.second = np.where(closer, np.minimum(best.t, far), np.minimum(best.second, near))
        best.instance[closer], best.triangle[closer] = number, first[closer]
        best.t = np.minimum(best.t, near)
    return best


def rays(count: int, random: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Returns origins, directions and times; the times of the first half ascend, as those of a sensor."""
    origins = random.uniform(-0.5, 0.5, (count, 3)) - [6, 0, 0]
    directions = random.normal([1, 0, 0], [0.1, 0.45, 0.3], (count, 3))
    times = random.uniform(0, SECONDS, count)
    half = count // 2
    times[:half].sort()
    return origins, directions, times


def compare(kind: str, count: int) -> tuple[list[str], int]:
    """Returns a row of the table, and the number of wrong results."""
    world, objects = scene(kind, 5)
    origins, directions, times = rays(count, np.random.default_rng(11))
    start = time.process_time()
    hits = world.cast_rays(origins, directions, times=times)
    spent = time.process_time() - start
    t_max = np.random.default_rng(12).uniform(4, 14, count)
    hidden = world.occluded(origins, directions, t_max=t_max, times=times)
    wrong = ties = moving = 0
    largest = 0.0
    for first in range(0, count, BLOCK):
        part = slice(first, first + BLOCK)
        found = brute(objects, origins[part], directions[part], times[part])
        with np.errstate(invalid="ignore"):
            error = np.abs(
                np.where(np.isinf(hits["t"][part]) & np.isinf(found.t), 0.0, hits["t"][part] - found.t)
            )
            tie = (found.edge < BAND) | (found.second - found.t < TOLERANCE)
        same = (hits["instance"][part] == found.instance) & (hits["triangle"][part] == found.triangle)
        blocked = found.t <= t_max[part]
        near_limit = np.abs(found.t - t_max[part]) < TOLERANCE
        bad = ~tie & ((error > TOLERANCE) | ~same | ((hidden[part] != blocked) & ~near_limit))
        wrong, ties = wrong + int(bad.sum()), ties + int(tie.sum())
        moving += int((found.instance > 0).sum())
        largest = max(largest, float(error[~tie].max(initial=0.0)))
    row = [kind, f"{count:,}", f"{moving:,}", f"{ties:,}", f"{largest:.1e}", f"{spent:.2f}", f"{wrong:,}"]
    return row, wrong


def main() -> None:
    """Compares each kind of motion and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=float, default=1e6)
    options = parser.parse_args()
    rows, wrong = [], 0
    for kind in ("linear", "turning", "trajectory"):
        row, bad = compare(kind, round(options.rays / 3))
        rows.append(row)
        wrong += bad
    head = [
        "motion",
        "rays",
        "hits on moving objects",
        "ties",
        "largest difference (m)",
        "cast_rays, processor time (s)",
        "wrong",
    ]
    report.write(
        "rays-with-times", "Rays with times compared with brute force", [" ".join(NOTES)], head, rows
    )
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
