"""Random camera poses that show an object at given distances, sizes and visibilities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..annotations.labels import Label, box3d, label
from ..arguments import Floats, lengths, product
from ..camera import Camera
from ..errors import WorldError, nearest
from ..world import World
from .draws import RandomStream, RejectedSample, check_known_keys, range_of, rounded

__all__ = ["SEE_KEYS", "place_camera"]

SEE_KEYS = ("object", "distance", "elevation", "azimuth", "roll", "coverage", "visible", "off_center")
"""The keys of `see` in a [[camera]] of a recipe."""
MAX_TRIES = 500
PREVIEW_SIZE = 96
"""Longer side, in pixels, of the preview that rejects most unsuitable views."""


def place_camera(
    world: World, camera: Camera, wanted: Mapping[str, Any], draw: RandomStream, what: str
) -> Camera:
    """Samples a pose of `camera` that fulfils `wanted`; returns the camera at this pose.

    The pose depends only on the world, `wanted` and `draw`. `wanted` has the following keys. `object` is a name or a
    category, one of whose objects is chosen (default: any object with a category, or any object). `distance`
    [low, high] is in metres to the centre of the object's box (default: 2 to 6 times the radius of the box).
    `elevation` (5 to 85) and `azimuth` (0 to 360) are the direction from the object to the camera in degrees, `roll`
    (0) rotates the image. `off_center` (0.2) is the largest offset of the object's centre from the image centre, as a
    fraction of half the image's sides. `coverage` [low, high] is the fraction of the image that shows the object
    (default: 0.001 to 1). `visible` (0.5) is the minimum fraction of the object that is neither occluded nor outside
    the image.

    Raises `WorldError` if no such view is found.
    """
    check_known_keys(f"see of {what}", wanted, SEE_KEYS)
    number = _chosen(world, wanted.get("object"), draw.substream("object"), what)
    box = box3d(world, number)
    radius = float(lengths(box.size)) / 2
    distance = range_of(f"{what}: distance", wanted.get("distance"), (2 * radius, 6 * radius))
    elevation = range_of(f"{what}: elevation", wanted.get("elevation"), (5.0, 85.0))
    azimuth = range_of(f"{what}: azimuth", wanted.get("azimuth"), (0.0, 360.0))
    roll = range_of(f"{what}: roll", wanted.get("roll"), (0.0, 0.0))
    coverage = range_of(f"{what}: coverage", wanted.get("coverage"), (0.001, 1.0))
    least = range_of(f"{what}: visible", wanted.get("visible"), (0.5, 0.5))[0]
    aside = range_of(f"{what}: off_center", wanted.get("off_center"), (0.2, 0.2))[1]
    if not 0.0 <= least <= 1.0 or not 0.0 <= coverage[0] <= coverage[1] <= 1.0:
        raise WorldError(
            f"{what}: coverage and visible must be fractions from 0 to 1, got {coverage} and {least}",
            code="out_of_range",
        )
    if distance[0] <= 0.0:
        raise WorldError(f"{what}: distance must be more than 0, not {distance[0]}", code="out_of_range")
    scale = PREVIEW_SIZE / max(camera.size)
    small_size = (max(1, round(camera.size[0] * scale)), max(1, round(camera.size[1] * scale)))
    best: tuple[float, float, float, float] | None = None
    for number_of_try in range(MAX_TRIES):
        at = draw.substream(number_of_try)
        pose = _pose(world.up, camera, box.center, at, distance, elevation, azimuth, roll, aside)
        if pose is None:
            continue
        placed = camera.at_pose(*pose)
        # A small preview rejects most unsuitable views; the remaining views are tested at full size.
        share, visible = _seen(world, placed.resized(small_size) if scale < 0.5 else placed, number)
        away = float(lengths(pose[1] - box.center))
        best = min(filter(None, (best, (_lacking(share, visible, coverage, least), share, visible, away))))
        if scale < 0.5:
            if not _is_good(share, visible, coverage, least, slack=0.3):
                continue
            share, visible = _seen(world, placed, number)
        if _is_good(share, visible, coverage, least):
            return placed
    raise RejectedSample(
        f"{what}: no view found in {MAX_TRIES} tries in which {world.objects[number].name!r} covers {coverage[0]:g} to "
        f"{coverage[1]:g} of the image and {least:g} of it is visible, from {distance[0]:g} to {distance[1]:g} m"
        f"{_closest(best, box.size)}; use wider ranges, another focal length or fewer objects"
    )


def _closest(best: tuple[float, float, float, float] | None, size: Floats) -> str:
    """Returns text for an error message: the attempt that came closest to the requirements."""
    across = " x ".join(f"{side:.3g}" for side in size)
    if best is None:
        return f" (size {across} m; the lens has no ray in its direction)"
    _, share, visible, away = best
    return f" (size {across} m; best try: coverage {share:.3g}, visible {visible:.3g}, distance {away:.3g} m)"


def _chosen(world: World, wanted: object, draw: RandomStream, what: str) -> int:
    objects = world.objects
    if wanted is None:
        found = [item.id for item in objects if item.category is not None] or [item.id for item in objects]
        if not found:
            raise RejectedSample(f"{what}: the world contains no objects")
    else:
        found = [item.id for item in objects if wanted in (item.name, item.category)]
        names = [item.name for item in objects] + [
            item.category for item in objects if item.category is not None
        ]
        if not found:
            raise RejectedSample(f"{what}: {nearest('object or category', str(wanted), names)}")
    return found[draw.integer(0, len(found) - 1)]


def _pose(
    up: str,
    camera: Camera,
    target: Floats,
    draw: RandomStream,
    distance: tuple[float, float],
    elevation: tuple[float, float],
    azimuth: tuple[float, float],
    roll: tuple[float, float],
    aside: float,
) -> tuple[Floats, Floats] | None:
    """Rotation and centre that show `target` at a random pixel; None if the pixel has no ray."""
    around, rise = (
        math.radians(draw.uniform(*ends, number=i)) for i, ends in enumerate((azimuth, elevation))
    )
    way = [math.cos(rise) * math.cos(around), math.cos(rise) * math.sin(around), math.sin(rise)]
    if up == "y":
        way = [way[1], way[2], way[0]]
    way = [rounded(value) for value in way]
    center = np.array(
        [
            rounded(float(t) + w * d)
            for t, w, d in zip(target, way, [draw.uniform(*distance, number=2)] * 3, strict=True)
        ]
    )
    shift = [draw.uniform(-aside, aside, number) for number in (3, 4)]
    half = np.array(camera.size) / 2
    pixel = half * (1.0 + np.array(shift)) + camera.corner
    lying = camera.at_pose(np.eye(3), np.zeros(3)).rays(pixel)[1]
    if not np.isfinite(lying).all():
        return None
    upwards = np.array([0.0, 0.0, 1.0] if up == "z" else [0.0, 1.0, 0.0])
    turn = math.radians(draw.uniform(*roll, number=5))
    # The camera's ray through the pixel must point along -way: the rotation maps one frame to the other.
    world_axes, camera_axes = (
        _axes(target - center, -upwards),
        _axes(lying, np.array([math.sin(turn), math.cos(turn), 0.0])),
    )
    rotation = np.round(product(camera_axes, world_axes.T), 14)
    # The nearest rotation by the Newton-Schulz iteration; each step squares the error.
    for _ in range(3):
        rotation = 1.5 * rotation - 0.5 * product(product(rotation, rotation.T), rotation)
    return rotation, center


def _axes(forward: Floats, down: Floats) -> Floats:
    """Returns a rotation [3, 3] whose third column is along `forward`.

    The second column is as close to `down` as possible.
    """
    z = forward / lengths(forward)
    y = down - product(down, z) * z
    if lengths(y) < 1e-6:
        y = np.array([0.0, 1.0, 0.0]) - z[1] * z if abs(z[1]) < 0.9 else np.array([1.0, 0.0, 0.0]) - z[0] * z
    y = y / lengths(y)
    return np.column_stack([np.cross(y, z), y, z])


def _seen(world: World, camera: Camera, number: int) -> tuple[float, float]:
    """The fraction of the image that shows the object, and the visible fraction of the object."""
    found: list[Label] = label(world, camera, objects=[number])
    if not found or not found[0].visible_pixels:
        return 0.0, 0.0
    return found[0].visible_pixels / (camera.size[0] * camera.size[1]), found[0].visible_fraction


def _is_good(
    share: float, visible: float, coverage: tuple[float, float], least: float, slack: float = 0.0
) -> bool:
    """True if the object's share of the view is within the requested range."""
    low, high = coverage[0] * (1.0 - slack), coverage[1] * (1.0 + slack)
    return share > 0.0 and low <= share <= high and visible >= least * (1.0 - slack)


def _lacking(share: float, visible: float, coverage: tuple[float, float], least: float) -> float:
    """The amount by which a view misses the requirements; 0 for good views."""
    low, high = coverage
    off = low / share - 1 if 0.0 < share < low else share / high - 1 if share > high > 0.0 else 0.0
    return (1e9 if share == 0.0 else off) + (max(0.0, least - visible) / least if least else 0.0)
