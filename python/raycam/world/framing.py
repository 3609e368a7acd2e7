"""Cameras that show the whole world from a named side or a direction."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, product
from ..camera import Camera
from ..errors import CameraError, SettingsError, nearest
from .contents import WorldContents

__all__ = [
    "DIRECTIONS",
    "FOV",
    "axes_of",
    "bounding_corners",
    "framing_camera",
    "moments_of",
    "without_ground",
]

AnyWorld = TypeVar("AnyWorld", bound=WorldContents)

DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "default": (1.0, 2.463, 1.085),
    "front": (0.0, 1.0, 0.0),
    "back": (0.0, -1.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
    "iso": (1.0, 1.0, 1.0),
}
"""Directions from the world's centre to the camera, by name: components to the right, to the front and up."""
FOV = 45.0
"""Vertical field of view of a framing camera, in degrees."""
FILLED_SHARE = 0.9
"""Fraction of the image's width or height that the world fills."""
MAX_TRIANGLES = 400_000
"""Maximum number of triangles of a world that is framed by its vertices. Larger worlds are framed by the corners of
their bounding box, which is less tight but requires no additional memory."""

MIN_GROUND_SIDE = 10.0
"""Minimum side of a level square that counts as ground, in diagonals of the other objects' bounds."""
MAX_SLOPE = 1e-6
"""Maximum height difference within a level square, relative to its side: the rounding error of files."""
MAX_SQUARES = 1000
"""Maximum number of squares that are tested as ground; with more squares, only those named as grounds are tested."""
GROUND_NAME = re.compile(r"(ground|studio floor)\d*")
"""Default names of the squares that `World.add_ground` and `add_studio` add."""
MOMENT_COUNT = 9
"""Number of evenly spaced times at which a motion is sampled for framing."""


def axes_of(up: str) -> Floats:
    """Returns unit vectors [3, 3] to the right, to the front and along `up`, in rows.

    The front is -y in a z-up world and +z in a y-up world, the side on which the default camera is.
    """
    return np.array(
        [[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]] if up == "z" else [[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]]
    )


def framing_camera(
    world: WorldContents,
    direction: str | npt.ArrayLike = "default",
    *,
    size: Sequence[int] = (640, 480),
    fov: float = FOV,
    zoom: float = 1.0,
    turning: bool = False,
    camera: Camera | None = None,
    moments: Sequence[WorldContents] = (),
) -> Camera:
    """Returns a camera from which the whole world just fits into the image.

    See `World.view_from`. If `turning`, the world fits at every angle around the vertical axis through its centre. If
    `moments` are given (the world at several times), the world fits at all of them.
    """
    if camera is not None:
        size = camera.size
    toward = _direction(direction, world.up)
    most = MAX_TRIANGLES // max(len(moments), 1)
    found = [bounding_corners(moment, most) for moment in moments or (world,)]
    clouds = [cloud for cloud in found if cloud is not None]
    if not clouds:
        raise CameraError("the world has no objects to show", code="nothing_visible")
    points = np.concatenate(clouds)
    if not 0 < zoom < np.inf:
        raise SettingsError(
            f"zoom is {zoom!r}: expected a number above 0, for example 1.5 for 50 % larger",
            code="out_of_range",
        )
    _, front, upward = axes_of(world.up)
    rise = float((toward * upward).sum())
    up_vector = -np.sign(rise) * front if abs(rise) > 0.999 else upward
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    if turning:
        points = _turned_around(points, middle, 2 if world.up == "z" else 1)
    facing = Camera.look_at(middle + toward, middle, up_vector, size=(int(size[0]), int(size[1])), fov=fov)
    if camera is not None:
        return _fitting_pose(camera, facing.R, points, middle, zoom)
    seen = product(points - middle, facing.R.T)
    reach = FILLED_SHARE * zoom * np.array([size[0] / facing.K[0, 0], size[1] / facing.K[1, 1]]) / 2
    # In camera axes, |x - eye_x| <= reach (z - eye_z) for all points, and the same for y.
    # The nearest eye that satisfies these inequalities is computed.
    left_of = (-seen[:, :2] - reach * seen[:, 2:]).max(axis=0)
    right_of = (seen[:, :2] - reach * seen[:, 2:]).max(axis=0)
    depth = float((-(left_of + right_of) / (2 * reach)).min())
    eye = np.append((right_of - left_of) / 2, depth)
    nearest_point = float(seen[:, 2].min())
    extent = float(np.abs(seen).max())
    if nearest_point - eye[2] <= 1e-9 * extent or extent == 0.0:
        eye[2] = nearest_point - (extent or 1.0)
    return facing.replace(C=middle + product(eye[None], facing.R)[0])


def _fitting_pose(camera: Camera, rotation: Floats, points: Floats, middle: Floats, zoom: float) -> Camera:
    """Returns `camera` as close to `middle` as possible with all points [n, 3] in the image.

    The camera keeps its own lens. Its centre is on the line through `middle` along the axis of `rotation`.
    `middle` is at the image centre, even if the principal point is far away from the image centre.
    """
    if camera.is_parallel:
        raise CameraError(
            "the camera has parallel rays, so no distance makes the world fit into its image",
            code="unsupported_camera",
        )
    half = FILLED_SHARE * zoom * np.array(camera.size) / 2
    center = np.array(camera.size) / 2 + camera.corner
    axis, rotation = rotation[2], _turned_to(camera, center, rotation)
    radius = float(np.sqrt(((points - middle) ** 2).sum(axis=1)).max()) or 1.0

    def excess(distance: float, cloud: Floats) -> Floats:
        """Returns the relative distance [n] of each point from the image centre.

        The distance is the larger of the distances along the two image axes. It is 1 at the margin,
        and +inf for a point without a projection.
        """
        posed = camera.at_pose(rotation, middle - distance * axis)
        with np.errstate(invalid="ignore"):
            pixels, seen = posed.project(cloud)
            share = (np.abs(pixels - center) / half).max(axis=1)
        return np.where(seen & np.isfinite(share), share, np.inf)

    def nearest(cloud: Floats) -> float:
        """The smallest distance outside the world's bounding sphere at which the points fit."""
        low = high = radius
        while not (excess(high, cloud) <= 1).all():
            low, high = high, 2 * high
            if high > MAX_DISTANCE * radius:
                raise CameraError(
                    f"no distance makes the world fit into the image of {camera!r}", code="unsupported_camera"
                )
        while high - low > 1e-4 * high:
            between = (low + high) / 2
            low, high = (low, between) if (excess(between, cloud) <= 1).all() else (between, high)
        return high

    # The distance is computed for a few extreme points. Points that are then still outside are added to these points.
    few = points[np.unique([int(product(points, way).argmax()) for way in EXTREME_DIRECTIONS])]
    while True:
        distance = nearest(few)
        beyond = excess(distance, points)
        out = np.flatnonzero(beyond > 1)
        if len(out) == 0:
            return camera.at_pose(rotation, middle - distance * axis)
        few = np.concatenate([few, points[out[np.argsort(-beyond[out], kind="stable")[:64]]]])


def _turned_to(camera: Camera, pixel: Floats, rotation: Floats) -> Floats:
    """`rotation`, turned by the smallest angle that aligns the pixel's ray with the axis."""
    ray = camera.at_pose(np.eye(3), np.zeros(3)).rays(pixel)[1]
    if not np.isfinite(ray).all():
        raise CameraError(
            f"the image centre, pixel {pixel.tolist()}, has no ray in {camera!r}",
            code="unsupported_camera",
        )
    x, y, z = ray / np.sqrt((ray * ray).sum())
    if z < -0.999:
        raise CameraError(
            f"the image centre, pixel {pixel.tolist()}, has a ray that points backwards in {camera!r}",
            code="unsupported_camera",
        )
    # Rodrigues' rotation of (0, 0, 1) to (x, y, z).
    a = 1 / (1 + z)
    turn = np.array([[1 - x * x * a, -x * y * a, x], [-x * y * a, 1 - y * y * a, y], [-x, -y, z]])
    return product(turn, rotation)


def moments_of(world: AnyWorld, animation: str | int | None = None) -> list[AnyWorld]:
    """Returns the world at evenly spaced times of its video and an animation.

    The list is empty for a world without motion. `animation` is a name or number (default: the first). Raises
    `WorldError` for an unknown animation.
    """
    animations = world.animations
    asked = [each for number, each in enumerate(animations) if animation in (each.name, number)]
    lengths = [each.duration for each in (asked or animations)[:1]]
    if world.video is not None:
        lengths.append(world.video.seconds)
    length = max(lengths, default=0.0)
    times = [length * number / (MOMENT_COUNT - 1) for number in range(MOMENT_COUNT)] if length > 0 else []
    return [world.at(time, animation) for time in times]


def without_ground(world: AnyWorld) -> AnyWorld:
    """Returns a copy without the ground below the objects.

    The world itself is returned if it has no ground, or nothing but ground.

    A ground is a level square of two triangles. It has the default name of the square that `World.add_ground` or
    `add_studio` adds (such as "ground" or "studio floor"), or its side is at least `MIN_GROUND_SIDE` diagonals of the
    other objects' bounds. Files of all formats preserve both properties.
    """
    axis = 2 if world.up == "z" else 1
    squares = [item for item in world.objects if item.visible and item.triangles == 2]
    if len(squares) > MAX_SQUARES:
        squares = [item for item in squares if GROUND_NAME.fullmatch(item.name)]
    sides = {item.id: np.ptp(world.triangles(item.id).reshape(-1, 3), axis=0) for item in squares}
    level = [item for item in squares if sides[item.id][axis] <= MAX_SLOPE * sides[item.id].max()]
    if not level:
        return world
    bounds = _hide(world, [item.id for item in level]).bounds
    least = np.inf
    if bounds is not None:
        least = MIN_GROUND_SIDE * float(np.sqrt(((bounds[1] - bounds[0]) ** 2).sum()))
    ground = [
        item.id
        for item in level
        if GROUND_NAME.fullmatch(item.name) or np.delete(sides[item.id], axis).min() >= least
    ]
    if not ground or (bounds is None and len(ground) == len(level)):
        return world
    return _hide(world, ground)


def _hide(world: AnyWorld, objects: Sequence[int]) -> AnyWorld:
    """Returns a copy of the world in which objects are hidden."""
    copy = world.copy()
    for number in objects:
        _core.world_set_object(copy._core, number, {"visible": False})
    return copy


def bounding_corners(world: WorldContents, most: int = MAX_TRIANGLES) -> Floats | None:
    """Returns points [n, 3] whose hull contains the world without its ground.

    Returns None for an empty world. The points are the corners of all triangles, or of the bounding box if there are
    more than `most` triangles.
    """
    world = without_ground(world)
    bounds = world.bounds
    if bounds is None:
        return None
    if world.counts["triangles"] <= most:
        corners = world.triangles().reshape(-1, 3)
        corners = corners[np.isfinite(corners).all(axis=1)]
        if len(corners):
            return corners
    grid = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    found: Floats = np.where(grid == 1, bounds[1], bounds[0])
    return found


def _direction(direction: str | npt.ArrayLike, up: str) -> Floats:
    """The unit vector from the centre to the camera."""
    if isinstance(direction, str):
        if direction not in DIRECTIONS:
            raise SettingsError(nearest("view direction", direction, list(DIRECTIONS)), code="unknown_name")
        vector = product(np.array([DIRECTIONS[direction]]), axes_of(up))[0]
    else:
        vector = floats("direction", direction, (3,), error=SettingsError)
    length = float(np.sqrt((vector * vector).sum()))
    if not 0 < length < np.inf:
        raise SettingsError(
            f"direction is {direction!r}: expected a direction that is not zero", code="invalid_value"
        )
    unit: Floats = vector / length
    return unit


def _turned_around(points: Floats, middle: Floats, axis: int) -> Floats:
    """Returns points that bound all rotations of `points` about the vertical axis.

    The axis goes through the centre. The result consists of rings at every height.
    """
    level = [number for number in range(3) if number != axis]
    radius = np.sqrt(((points[:, level] - middle[level]) ** 2).sum(axis=1))
    low, high = points[:, axis].min(), points[:, axis].max()
    step = (high - low) / RING_COUNT or 1.0
    ring = np.minimum(((points[:, axis] - low) / step).astype(int), RING_COUNT - 1)
    widest = np.zeros(RING_COUNT)
    np.maximum.at(widest, ring, radius)
    angles = [2 * math.pi * number / RING_CORNER_COUNT for number in range(RING_CORNER_COUNT)]
    corner = np.array([[math.cos(angle), math.sin(angle)] for angle in angles]) / math.cos(
        math.pi / RING_CORNER_COUNT
    )
    found = []
    for number in range(RING_COUNT):
        for height in (low + number * step, low + (number + 1) * step):
            around = np.empty((RING_CORNER_COUNT, 3))
            around[:, level] = middle[level] + widest[number] * corner
            around[:, axis] = height
            found.append(around)
    return np.concatenate(found)


MAX_DISTANCE = 1e6
"""Maximum distance of a framing camera, in radii of the world."""
EXTREME_DIRECTIONS = np.array(
    [[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)], float
)
"""Directions [26, 3] to the corners, edges and faces of a box, in which extreme points are searched."""
RING_COUNT, RING_CORNER_COUNT = 32, 32
"""The number of rings that bound a turning world, and the number of corners of each ring."""
