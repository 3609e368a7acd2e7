"""The numbers that each figure of the lecture should show in a state.

They are computed by NumPy and `raycam.reference`.
"""

from __future__ import annotations

import functools
import math
import re
import unicodedata
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import raycam
from raycam import reference

__all__ = ["MINUS", "NAMES", "TRUTHS", "Truth", "camera_of", "to_sun"]

Floats = npt.NDArray[np.float64]
Expected = list[float]
SIZE = (320, 240)
SUN_RED, BULB_RED = 2.4, 14.0
MINUS = "\N{MINUS SIGN}"
SKY = np.array([0.3, 0.36, 0.46])
NAMES = ["floor 0", "floor 1", *(f"box {i}" for i in range(12)), "green", "blue"]


class Truth:
    """A state of the page.

    `shown` contains the values that the figure shows, `fixed` the corners of the floor and the box.
    """

    def __init__(self, shown: dict[str, Any], fixed: Floats, state: dict[str, Any]) -> None:
        self.shown, self.state = shown, state
        self.numbers: dict[str, Any] = shown["numbers"]
        self.values: list[float] = shown["values"]
        self.camera = camera_of(self.numbers)
        self.P, self.R = np.asarray(self.camera.P), np.asarray(self.camera.R)
        self.pixel = self.numbers["pixel"]
        free = [triangle["corners"] for triangle in self.numbers["triangles"]]
        self.triangles = np.concatenate([fixed, np.array(free, float)])
        self.X = reference.points_on_lines(self.P, np.array([self.pixel], float))[0]
        self.C = np.array(self.numbers["C"], float)
        self.v = reference.third_row_of_r(self.P)
        self.line = reference.lines(self.X[None], self.C)[0]
        self.r = reference.pointed_forward(self.line[None], self.v)[0]
        found = reference.trace(self.triangles, self.C, self.r[None])
        self.index, self.t = int(found.index[0]), float(found.t[0])
        self.f = self.C + self.t * self.r if self.index >= 0 else np.full(3, np.nan)

    @property
    def depth(self) -> float:
        """The depth of the hit along the principal axis."""
        return self.t * float(self.r @ self.v)

    def normal(self) -> Floats:
        """The unit normal of the hit, on the camera's side."""
        n = reference.normals(self.triangles[self.index][None])[0]
        return np.asarray(-np.sign(n @ self.r) * n / np.linalg.norm(n))


def camera_of(numbers: dict[str, Any]) -> raycam.Camera:
    """The camera of the page's numbers."""
    K = [[numbers["fx"], numbers["skew"], numbers["cx"]], [0, numbers["fy"], numbers["cy"]], [0, 0, 1]]
    pose = (numbers["C"], numbers["roll"], numbers["pitch"], numbers["yaw"])
    return raycam.Camera.from_pose(*pose, size=SIZE, K=K)


def project(P: Floats, point: Floats) -> Floats:
    """The pixel of a point."""
    x = P @ [*point, 1]
    return np.asarray(x[:2] / x[2])


def random_of(seed: int) -> Iterator[float]:
    """The random numbers of mulberry32 (Tommy Ettinger, public domain), which the page uses."""
    state = seed
    while True:
        state = (state + 0x6D2B79F5) & 0xFFFFFFFF
        z = (state ^ (state >> 15)) * (1 | state) & 0xFFFFFFFF
        z = ((z + ((z ^ (z >> 7)) * (61 | z) & 0xFFFFFFFF)) & 0xFFFFFFFF) ^ z
        yield (z ^ (z >> 14)) / 2**32


def planes(e: Truth) -> tuple[Floats, npt.NDArray[np.int64]]:
    """For each triangle, t of its plane, and the number of edges crossed in the plane [n].

    The crossings are those of the lecture's inside test at f(t).
    """
    n = reference.normals(e.triangles)
    t = reference.plane_distances(n, e.triangles[:, 0], e.C, e.r[None])[0]
    f = e.C + t[:, None] * e.r
    return t, reference.crossings(e.triangles, n, f, np.zeros(len(t))).count


def box(e: Truth) -> Expected:
    count = 12 - e.state["clicks"]["Back"]
    return [count, 12, *e.triangles[1 + count].ravel()] if count else []


def refine(e: Truth) -> Expected:
    return [14 * 4 ** e.values[0], 14, 4]


def color(e: Truth) -> Expected:
    code = np.array(e.values) / 255
    return list(np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4))


def project_point(e: Truth) -> Expected:
    X = e.triangles[14][2]
    return [*X, 1, *(e.P @ [*X, 1]), *project(e.P, X)]


def back_project(e: Truth) -> Expected:
    return [*e.pixel, 1, *e.X, *(e.X[:3] / e.X[3])]


def sign(e: Truth) -> Expected:
    along = float(e.v @ e.line)
    assert e.shown["lines"][1].endswith("in front of the camera" if along > 0 else "behind the camera")
    return [*e.v, *e.line, along, 0]


def normal(e: Truth) -> Expected:
    a, b, c = e.triangles[14]
    n = reference.normals(e.triangles[14][None])[0]
    return [*(b - a), *(c - a), *n, 0, 0, 2, np.linalg.norm(n) / 2]


def plane(e: Truth) -> Expected:
    if e.shown["lines"][0].startswith("No triangle"):
        assert not (planes(e)[0] >= 0).any()
        return []
    candidates = [e.index] if e.index >= 0 else range(16)
    best: Expected = []
    for index in candidates:
        n, a = reference.normals(e.triangles[index][None])[0], e.triangles[index][0]
        above, below = n @ (a - e.C), n @ e.r
        now = e.values[0] / 600 * 1.5 * abs(above / below)
        height = n @ (e.C + now * e.r - a)
        found = [above, below, above, below, above / below, now, height]
        text = e.shown["lines"][0].replace(MINUS, "-")
        if text.startswith(f"n · (a - C) = {found[0]:.4f} ") or not best:
            best = found
    return best


def closest(e: Truth) -> Expected:
    t, count = planes(e)
    expected: Expected = [16, 16]
    assert e.shown["lines"][0].endswith(NAMES[e.index] if e.index >= 0 else "the background")
    for line in e.shown["lines"][1:]:
        i = next(i for i, name in enumerate(NAMES) if f" {name}:" in line)
        inside = count[i] % 2 == 1
        assert line.endswith(("the closest hit" if i == e.index else "farther") if inside else "outside"), (
            line
        )
        expected += [t[i], count[i]]
    hits = sum(f" {NAMES[i]}:" in line for line in e.shown["lines"][1:] for i in range(16) if count[i] % 2)
    misses = len(e.shown["lines"]) - 1 - hits
    assert hits == min(int(((count % 2 == 1) & (t > 0)).sum()), 5 - misses)
    return expected


@functools.cache
def scattered(count: int) -> Floats:
    """The triangles of the tree's figure [count, 3, 3]."""
    i = np.arange(count)
    x, y, turn = (0.5 + 0.7548776662 * (i + 1)) % 1, (0.5 + 0.5698402910 * (i + 1)) % 1, (0.618034 * i) % 1
    angle = 2 * np.pi * (turn[:, None] + np.arange(3) / 3)
    z = np.broadcast_to([0.02, -0.02, -0.02], (count, 3))
    return np.stack(
        [0.15 + 1.5 * x[:, None] + 0.02 * np.cos(angle), y[:, None] + 0.02 * np.sin(angle), z], axis=2
    )


@functools.cache
def tree_of(count: int) -> Any:
    """Nested boxes: (low, high, items, children)."""
    triangles = scattered(count)

    def build(items: npt.NDArray[np.int64]) -> Any:
        points = triangles[items].reshape(-1, 3)
        low, high = points.min(0), points.max(0)
        if len(items) <= 3:
            return low, high, items, []
        axis = 0 if high[0] - low[0] > high[1] - low[1] else 1
        ordered = items[np.argsort(triangles[items, :, axis].sum(1), kind="stable")]
        half = len(items) // 2
        return low, high, items, [build(ordered[:half]), build(ordered[half:])]

    return build(np.arange(count))


def tree(e: Truth) -> Expected:
    angle, count = np.radians(e.values[0]), int(e.values[1])
    triangles, C = scattered(count), np.array([-0.2, 0.5, 0])
    r = np.array([np.cos(angle), np.sin(angle), 0])
    n = reference.normals(triangles)
    every = reference.plane_distances(n, triangles[:, 0], C, r[None])[0]
    crossed = reference.crossings(triangles, n, C + every[:, None] * r, np.zeros(count)).count
    t = np.where((crossed % 2 == 1) & (every >= 0), every, np.inf)

    def entry(low: Floats, high: Floats) -> float:
        with np.errstate(divide="ignore"):
            ends = np.stack([low[:2] - C[:2], high[:2] - C[:2]]) / r[:2]
        enter, leave = max(0.0, ends.min(0).max()), ends.max(0).min()
        return float(enter) if enter <= leave and low[2] <= 0 <= high[2] else np.inf

    boxes = tested = 0
    best = np.inf
    stack = [tree_of(count)]
    while stack:
        low, high, items, children = stack.pop()
        if entry(low, high) >= best:
            continue
        boxes += 1
        if not children:
            tested += len(items)
            best = min(best, t[items].min())
        stack += sorted(children, key=lambda child: -entry(child[0], child[1]))
    return [count, boxes, tested, *([best] if np.isfinite(best) else [])]


def to_sun(numbers: dict[str, Any]) -> Floats:
    """The direction to the sun."""
    a, h = np.radians([numbers["sun"], numbers["height"]])
    return np.array([np.cos(h) * np.cos(a), np.cos(h) * np.sin(a), np.sin(h)])


def lights(e: Truth) -> Expected:
    if e.index < 0:
        return []
    if e.state["choices"][0] == 0:
        cosine = max(0.0, float(e.normal() @ to_sun(e.numbers)))
        return [cosine, SUN_RED, cosine, SUN_RED * cosine]
    off = np.array(e.numbers["bulb"]) - e.f
    d = float(np.linalg.norm(off))
    cosine = max(0.0, float(e.normal() @ off) / d)
    return [d, cosine, BULB_RED, cosine, d, BULB_RED * cosine / d**2]


def reflection(e: Truth) -> Expected:
    light, view, diffuse, shininess = e.values
    cosine = math.cos(math.radians(light))
    mirrored = max(0.0, math.cos(math.radians(view - light))) ** shininess
    specular = (1 - diffuse) * (shininess + 2) / (2 * math.pi) * mirrored * cosine
    exponent = re.search("cos([⁰¹²³⁴⁵⁶⁷⁸⁹]*) ", e.shown["lines"][1])
    assert exponent
    assert int(unicodedata.normalize("NFKC", exponent[1]) or 1) == shininess
    return [
        *(diffuse, light, diffuse / math.pi * cosine),
        *(1 - diffuse, shininess, 2, 2, abs(view - light), light, specular),
    ]


def shadow(e: Truth) -> Expected:
    if e.index < 0:
        return []
    way = np.array(e.numbers["bulb"]) - e.f
    n = reference.normals(e.triangles)
    s = reference.plane_distances(n, e.triangles[:, 0], e.f, way[None])[0]
    count = reference.crossings(e.triangles, n, e.f + s[:, None] * way, np.zeros(16)).count
    blocks = (count % 2 == 1) & (s > 1e-9) & (s < 1) & (np.arange(16) != e.index)
    text = e.shown["lines"][0]
    assert (f"{NAMES[int(blocks.argmax())]} lies" in text) if blocks.any() else text.endswith("lit.")
    return [*e.f]


def path(e: Truth) -> Expected:
    random = random_of(3 + e.state["total"])
    linear = np.asarray(e.state["linear"], float)
    C, r, throughput, expected = e.C, e.r, np.ones(3), []
    for bounce in range(8):
        found = reference.trace(e.triangles, C, r[None])
        i = int(found.index[0])
        if i < 0:
            return [*expected, *SKY, *(throughput * SKY)]
        f = C + found.t[0] * r
        n = reference.normals(e.triangles[i][None])[0]
        n = -np.sign(n @ r or -1) * n / np.linalg.norm(n)
        throughput = throughput * linear[i]
        expected += [bounce + 1, *throughput]
        radius, angle = math.sqrt(next(random)), 2 * math.pi * next(random)
        s = np.cross(n, [0, 0, 1] if abs(n[2]) < 0.9 else [1, 0, 0])
        s /= np.linalg.norm(s)
        up = math.sqrt(max(0.0, 1 - radius**2))
        C, r = f + 1e-6 * n, radius * (math.cos(angle) * s + math.sin(angle) * np.cross(n, s)) + up * n
    return [*expected, 8]


def mean(e: Truth) -> Expected:
    count = int(e.values[0])
    random = random_of(1 + e.state["total"])
    found = sum(2 * math.pi * next(random) for _ in range(count)) / count
    return [count, found, found - math.pi, math.pi / math.sqrt(3 * count)]


def distortion(e: Truth) -> Expected:
    return [0.5, 0.5, 1, 0.25, 0.5 * (1 + e.values[0] * 0.25)]


def focus(e: Truth) -> Expected:
    aperture, at = e.values
    depth = e.depth if e.index >= 0 else 6.0
    # By similar triangles, the cone from the lens to the focus has this radius at the depth; the pinhole projects it.
    radius = e.numbers["fx"] * (aperture * abs(depth - at) / at) / depth
    return [depth, 1, depth, 1, at, radius]


def shutter(e: Truth) -> Expected:
    speed, readout = e.values
    (u, row) = e.pixel
    when = readout * row / 239
    expected = [row, row, 239, readout, when]
    if e.index < 0:
        return expected
    moved = speed * when / 1000
    camera = camera_of({**e.numbers, "C": list(e.C + moved * e.R[0])})
    column = project(np.asarray(camera.P), e.f)[0]
    return [*expected, moved, e.depth, u, e.numbers["fx"], moved, e.depth, column]


def video(e: Truth) -> Expected:
    yaw = 5 * e.values[0]
    forward = np.array([math.cos(math.radians(yaw)), math.sin(math.radians(yaw))])
    return [yaw, *(np.array([0.3, -0.2]) - 5 * forward), 2.3, e.values[0] / 24, 24]


def epipolar(e: Truth) -> Expected:
    if e.index < 0:
        return []
    (b,) = e.values
    camera = camera_of({**e.numbers, "C": list(e.C + b * e.R[0])})
    d = e.pixel[0] - project(np.asarray(camera.P), e.f)[0]
    return [d, e.numbers["fx"], b, d, e.depth, e.depth]


def triangulate(e: Truth) -> Expected:
    if e.index < 0:
        return []
    columns, rows, b = e.values
    P = np.asarray(camera_of({**e.numbers, "C": list(e.C + b * e.R[0])}).P)
    measured = project(P, e.f) + np.array([columns, rows])
    C = e.C + b * e.R[0]
    line = reference.lines(reference.points_on_lines(P, measured[None]), C)
    r = reference.pointed_forward(line, e.v)[0]
    # The distance between C + t r and C' + t' r' is smallest at the least squares solution.
    t, *_ = np.linalg.lstsq(np.column_stack([e.r, -r]), C - e.C, rcond=None)
    p, q = e.C + t[0] * e.r, C + t[1] * r
    M = (p + q) / 2
    return [*t, np.linalg.norm(p - q), *M, *e.f, np.linalg.norm(M - e.f)]


def floor(e: Truth) -> Expected:
    angle = math.radians(e.values[0])
    far = e.P @ [math.cos(angle), math.sin(angle), 0, 0]
    on_floor = e.C - e.C[2] / e.r[2] * e.r
    return [0, *far, *(far[:2] / far[2]), *e.pixel, *on_floor[:2]]


def calibration(e: Truth) -> Expected:
    points = np.unique(e.triangles[2:].reshape(-1, 3).round(9), axis=0)
    ordered: list[Floats] = []
    for point in e.triangles[2:].reshape(-1, 3):
        if not any(np.linalg.norm(point - other) < 1e-9 for other in ordered):
            ordered.append(point)
    assert len(points) == len(ordered)
    random = random_of(5)
    pixels = [
        project(e.P, point) + e.values[0] * np.array([2 * next(random) - 1, 2 * next(random) - 1])
        for point in ordered
    ]
    rows, right = [], []
    for (x, y, z), (u, v) in zip(ordered, pixels, strict=True):
        rows += [
            [x, y, z, 1, 0, 0, 0, 0, -u * x, -u * y, -u * z],
            [0, 0, 0, 0, x, y, z, 1, -v * x, -v * y, -v * z],
        ]
        right += [u, v]
    # The page minimizes in units of 300 pixels; all rows have the same unit, so the minimum is the same.
    found, *_ = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)
    P = np.append(found, 1).reshape(3, 4)
    errors = [np.sum((pixel - project(P, point)) ** 2) for point, pixel in zip(ordered, pixels, strict=True)]
    return [len(ordered), 11, math.sqrt(np.mean(errors)), *(e.P / e.P[2, 3]).ravel(), *P.ravel()]


def exact(e: Truth) -> Expected:
    turn, count = math.radians(e.values[0]), 400

    def spot(a: float, radius: float) -> Floats:
        return np.array([radius * math.cos(a + turn), radius * math.sin(a + turn), 0.3 * math.cos(a)])

    p, q, left, right = spot(0, 1), spot(math.pi, 1), spot(1.6, 0.9), spot(-1.4, 0.8)
    C = np.array([0.1, 0.2, 3])
    r = p + ((np.arange(count) + 0.5) / count)[:, None] * (q - p) - C

    def hit(a: Floats, b: Floats, c: Floats) -> npt.NDArray[np.bool_]:
        """The test of Möller and Trumbore in float32."""
        A, B, D, origin, ray = (np.asarray(each, np.float32) for each in (a, b, c, C, r))
        e1, e2, s = B - A, D - A, origin - A
        h = cross32(ray, e2)
        determinant = dot32(e1, h)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = dot32(s, h) / determinant
            w = dot32(ray, cross32(s, e1)) / determinant
        return np.asarray((u >= 0) & (w >= 0) & (u + w <= np.float32(1)))

    return [int((~(hit(p, q, left) | hit(q, p, right))).sum()), count, 0]


def cross32(x: Any, y: Any) -> Any:
    """The cross product, rounded after each operation."""
    axes = [(1, 2), (2, 0), (0, 1)]
    return np.stack([x[..., i] * y[..., j] - x[..., j] * y[..., i] for i, j in axes], axis=-1)


def dot32(x: Any, y: Any) -> Any:
    """The dot product, rounded after each operation."""
    return (x[..., 0] * y[..., 0] + x[..., 1] * y[..., 1]) + x[..., 2] * y[..., 2]


TRUTHS: dict[str, Callable[[Truth], Expected]] = {
    "origin": lambda e: [],
    "box": box,
    "refine": refine,
    "color": color,
    "project": project_point,
    "matrix": lambda e: [
        *e.P.ravel(),
        *np.asarray(e.camera.K).ravel(),
        *e.R.ravel(),
        *np.column_stack([np.eye(3), -e.C]).ravel(),
    ],
    "angles": lambda e: [*e.R.ravel()],
    "back-project": back_project,
    "sign": sign,
    "normal": normal,
    "plane": plane,
    "closest": closest,
    "tree": tree,
    "lights": lights,
    "reflection": reflection,
    "shadow": shadow,
    "path": path,
    "mean": mean,
    "distortion": distortion,
    "focus": focus,
    "shutter": shutter,
    "video": video,
    "epipolar": epipolar,
    "triangulate": triangulate,
    "floor": floor,
    "calibration": calibration,
    "exact": exact,
}
