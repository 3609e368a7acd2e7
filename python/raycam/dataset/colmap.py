"""A COLMAP model in text: cameras, images, and points3D from what the cameras see of the surfaces.

Source: COLMAP's documentation, "Output Format" and "Camera Models".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from ..arrays import Floats
from ..camera import Camera
from ..errors import SettingsError
from ..labels import Keypoints, keypoints
from . import colmap_rigs
from .plan import Format, Index, Made, Plan, Record, matrix_text
from .rgbd import quaternion

__all__ = ["FORMAT"]

OPTIONS = {"points": 10_000}


def check(plan: Plan) -> None:
    """Whether COLMAP has these cameras."""
    for view in plan.shots:
        model(view.camera)
    colmap_rigs.check(plan)
    points = plan.options["points"]
    if not (isinstance(points, int) and points >= 1):
        raise SettingsError(f"points is {points!r}, expected how many surface points to sample, at least 1")


def model(camera: Camera) -> str:
    """A camera as a line of cameras.txt says it, without its id; the centre of the first pixel is (0.5, 0.5)."""
    name, numbers = camera.colmap
    width, height = camera.size
    return f"{name} {width} {height} {matrix_text(numbers)}"


def make(plan: Plan, number: int) -> Made:
    """A picture, and its share of the points: random pixels that show a surface, with its base colour."""
    shot = plan.shot(number)
    frame = shot.render(["color", "albedo", "position"])
    rows, columns = np.nonzero(np.isfinite(frame["position"][..., 0]))
    share = -(-plan.options["points"] // len(plan.shots))
    chosen = np.random.default_rng(number).permutation(len(rows))[:share]
    rows, columns = rows[chosen], columns[chosen]
    color = np.rint(srgb(frame["albedo"][rows, columns]) * 255).astype(int)
    record = {"points": frame["position"][rows, columns].tolist(), "colors": color.tolist()}
    return {f"images/{number:06d}.png": frame.to_png()}, record


def srgb(linear: npt.NDArray[np.float32]) -> Floats:
    """IEC 61966-2-1."""
    value = linear.clip(0, 1).astype(np.float64)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Every point is looked for in every view: it is observed where the camera sees it."""
    lines = [model(view.camera) for view in plan.shots]
    sensors = colmap_rigs.sensors(plan, lines)
    known = dict(zip(sensors, lines, strict=True))
    ids = {sensor: number + 1 for number, sensor in enumerate(known)}
    head = "# Camera list: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    yield (
        "sparse/0/cameras.txt",
        [(head + "".join(f"{ids[sensor]} {line}\n" for sensor, line in known.items())).encode()],
    )
    yield from colmap_rigs.files(plan, [ids[sensor] for sensor in sensors])
    points = np.array([point for record in records() for point in record["points"]]).reshape(-1, 3)
    colors = [color for record in records() for color in record["colors"]]
    seen: list[npt.NDArray[np.int32]] = []

    def images() -> Iterator[bytes]:
        yield b"# Image list: IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; POINTS2D[] as (X, Y, POINT3D_ID)\n"
        for number, sensor in enumerate(sensors):
            camera, found = plan.shots[number].camera, observed(plan, number, points)
            visible = np.flatnonzero(found.visible).astype(np.int32)
            seen.append(visible)
            pose = matrix_text(np.array([*quaternion(camera.R), *camera.t]))
            yield f"{number + 1} {pose} {ids[sensor]} {number:06d}.png\n".encode()
            corner = 0.5 if camera.pixel_center == "integer" else 0.0
            pixels = (found.pixels[visible] + corner).tolist()
            yield (
                " ".join(f"{x} {y} {i + 1}" for (x, y), i in zip(pixels, visible, strict=True)) + "\n"
            ).encode()

    yield "sparse/0/images.txt", images()

    def points3d() -> Iterator[bytes]:
        yield b"# 3D point list: POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
        counts = np.array([len(visible) for visible in seen])
        which = np.concatenate(seen) if seen else np.empty(0, np.int32)
        image = np.repeat(np.arange(len(seen), dtype=np.int32), counts)
        place = np.concatenate([np.arange(count, dtype=np.int32) for count in counts]) if seen else which
        order = np.argsort(which, kind="stable")
        ends = np.searchsorted(which[order], np.arange(len(points) + 1))
        for number, (point, color) in enumerate(zip(points, colors, strict=True)):
            track = order[ends[number] : ends[number + 1]]
            text = " ".join(f"{image[i] + 1} {place[i]}" for i in track)
            yield f"{number + 1} {matrix_text(point)} {' '.join(map(str, color))} 0.0 {text}\n".encode()

    yield "sparse/0/points3D.txt", points3d()


def observed(plan: Plan, number: int, points: Floats) -> Keypoints:
    """Which of the points a view shows, and where."""
    shot = plan.shot(number)
    return keypoints(shot.world, shot.camera, points, threads=plan.threads)


FORMAT = Format(make, index, check, OPTIONS, posed=True)
