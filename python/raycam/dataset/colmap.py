"""A COLMAP model as text: cameras, images, and points3D sampled on visible surfaces.

Source: COLMAP's documentation, "Output Format" and "Camera Models".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from tempfile import TemporaryFile

import numpy as np
import numpy.typing as npt

from ..annotations.keypoints import keypoints
from ..arguments import Floats, product, whole
from ..camera import Camera
from ..errors import CameraError
from ..srgb import srgb_from_linear
from . import colmap_rigs
from .colmap_tracks import Tracks
from .plan import Format, Index, Made, Plan, Record, matrix_text
from .rgbd import quaternion

__all__ = ["FORMAT"]

OPTIONS = {"points": 10_000}
BATCH = 1024
"""Number of points projected at a time."""
FRONT = 1e-12
"""Minimum depth in metres, slightly more than COLMAP requires."""


def check(plan: Plan) -> None:
    """Raises `CameraError` for unsupported cameras, and `SettingsError` for invalid options."""
    for number, view in enumerate(plan.shots):
        try:
            model(view.camera)
        except CameraError as fault:
            raise CameraError(f"camera {number}: {fault}", code=fault.code) from None
    colmap_rigs.check(plan)
    whole("points", plan.options["points"], 1)


def model(camera: Camera) -> str:
    """Returns a camera's line in cameras.txt, without the id.

    The centre of the first pixel is (0.5, 0.5).
    """
    name, numbers = camera.colmap
    width, height = camera.size
    return f"{name} {width} {height} {matrix_text(numbers)}"


def image_name(plan: Plan, number: int) -> str:
    """Returns the source image's name, with _ instead of spaces.

    Spaces separate fields in COLMAP's text files.
    """
    return "_".join(plan.picture_name(number).split()) + ".png"


def make(plan: Plan, number: int) -> Made:
    """Creates an image, and its share of the model's points.

    The points are random pixels that show a surface, with their base colours.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "albedo", "position"])
    rows, columns = np.nonzero(in_front(shot.camera, frame["position"]))
    wanted, views = plan.options["points"], len(plan.shots)
    share = wanted * (number + 1) // views - wanted * number // views
    chosen = np.random.default_rng(number).permutation(len(rows))[:share]
    rows, columns = rows[chosen], columns[chosen]
    color = np.rint(
        srgb_from_linear(frame["albedo"][rows, columns].clip(0, 1).astype(np.float64)) * 255
    ).astype(int)
    record = {"points": frame["position"][rows, columns].tolist(), "colors": color.tolist()}
    return {f"images/{image_name(plan, number)}": frame.to_png()}, record


def in_front(camera: Camera, points: Floats) -> npt.NDArray[np.bool_]:
    """Returns True for points [..., 3] in front of the camera's plane, and False for NaN.

    COLMAP requires such points for any lens model.
    """
    found: npt.NDArray[np.bool_] = product(points - camera.C, camera.R[2]) > FRONT
    return found


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the model files.

    A point is observed in every view in which the point is visible and has not moved.
    """
    known: dict[tuple[str, str], int] = {}
    ids = []
    for view in plan.shots:  # cameras are distinguished by intrinsics, and by their mount on a rig
        sensor = model(view.camera), "" if view.rig is None else view.rig[1]
        ids.append(known.setdefault(sensor, len(known) + 1))
    head = "# Camera list: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    lines = "".join(f"{number} {line}\n" for (line, _), number in known.items())
    yield "sparse/0/cameras.txt", [(head + lines).encode()]
    yield from colmap_rigs.files(plan, ids)
    points = np.concatenate([np.array(record["points"]).reshape(-1, 3) for record in records()])
    colors = np.concatenate([np.array(record["colors"], np.uint8).reshape(-1, 3) for record in records()])
    with TemporaryFile() as file:
        tracks = Tracks(len(points), file)
        yield "sparse/0/images.txt", images(plan, ids, points, tracks)
        yield "sparse/0/points3D.txt", points3d(points, colors, tracks)


def images(plan: Plan, ids: Sequence[int], points: Floats, tracks: Tracks) -> Iterator[bytes]:
    """Iterates over the lines of images.txt, and adds the observations to `tracks`.

    `ids` are the camera ids.
    """
    yield b"# Image list: IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; POINTS2D[] as (X, Y, POINT3D_ID)\n"
    for number, view in enumerate(plan.shots):
        world, camera = plan.shot(number).world, view.camera
        visible = np.zeros(len(points), dtype=bool)
        pose = matrix_text(np.array([*quaternion(camera.R), *camera.t]))
        yield f"{number + 1} {pose} {ids[number]} {image_name(plan, number)}\n".encode()
        between = ""
        for first in range(0, len(points), BATCH):
            some = points[first : first + BATCH]
            found = keypoints(world, camera, some, threads=plan.threads)
            visible[first : first + BATCH] = found.on_surface & in_front(camera, some)
            seen = np.flatnonzero(visible[first : first + BATCH])
            pixels = (found.pixels[seen] - camera.corner).tolist()
            for (x, y), i in zip(pixels, seen, strict=True):
                yield f"{between}{x} {y} {first + i + 1}".encode()
                between = " "
        yield b"\n"
        tracks.add(visible)


def points3d(points: Floats, colors: npt.NDArray[np.uint8], tracks: Tracks) -> Iterator[bytes]:
    """Iterates over the lines of points3D.txt: points, and the images that show them."""
    yield b"# 3D point list: POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
    for number, (point, (r, g, b), track) in enumerate(zip(points, colors, tracks, strict=True), 1):
        text = " ".join(f"{picture + 1} {place}" for picture, place in zip(*track, strict=True))
        yield f"{number} {matrix_text(point)} {r} {g} {b} 0.0 {text}\n".encode()


FORMAT = Format(make, index, check, OPTIONS, posed=True)
