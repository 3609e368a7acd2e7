"""The surfaces in a photograph: arrays for the exact rays through its pixel centres."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Bools, Floats
from ...camera import Camera
from ...world import World
from ..plan import Shot

__all__ = ["CHANNELS", "mixed_pixels", "photograph_surfaces"]

Arrays = dict[str, npt.NDArray[Any]]

CHANNELS = ("depth", "distance", "normal", "mask", "instance", "position", "valid", "confidence")
"""Channels of the format "photos"."""

MIXED_STEP = 0.02
"""Distance from a pixel's tangent plane, relative to its depth, beyond which a neighbour belongs to another surface."""


def photograph_surfaces(shot: Shot, channels: Collection[str], facing: str) -> Arrays:
    """Returns the requested `channels` of a view as arrays [h, w] or [h, w, 3].

    Distances are +inf for pixels without a surface. With `facing="both"`, each ray's first surface is used;
    with "front", the first surface that faces the camera. `normal` is in camera axes (x right, y down, z
    forward) and points towards the camera.
    """
    needed = {"depth"}
    needed |= {"normal", "position", "distance", "instance"} if "confidence" in channels else set()
    needed |= {name for name in channels if name in ("distance", "normal", "instance", "position")}
    found = (
        _rendered(shot, needed) if facing == "both" else _front(shot.world, shot.camera, shot.plan.threads)
    )
    hit = np.isfinite(found["depth"])
    made: Arrays = {name: found[name] for name in needed}
    made["mask"] = hit
    if "valid" in channels:
        made["valid"] = shot.camera.valid()
    if "confidence" in channels:
        cosine = np.abs((found["normal"] * _ways(shot.camera)).sum(axis=-1))
        sure = hit & ~mixed_pixels(found["position"], found["normal"], found["depth"], shot.camera)
        made["confidence"] = np.where(sure, np.clip(cosine, 0.0, 1.0), 0.0).astype(np.float32)
    return made


def mixed_pixels(
    position: Floats, normal: npt.NDArray[Any], depth: npt.NDArray[Any], camera: Camera
) -> Bools:
    """Returns a mask [h, w] of pixels at the edges of surfaces.

    A pixel with a surface is in the mask in two cases: a neighbour has no surface, or the neighbour's surface is off
    the pixel's tangent plane. The limit is 2 % of the depth. `position` [h, w, 3] is in the world, `normal` [h, w, 3]
    in camera axes, and `depth` is [h, w].
    """
    place = (position - camera.location) @ camera.R.T
    mixed = np.zeros(depth.shape, dtype=bool)
    hit = np.isfinite(depth)
    for axis in (0, 1):
        low = tuple(slice(0, -1) if i == axis else slice(None) for i in (0, 1))
        high = tuple(slice(1, None) if i == axis else slice(None) for i in (0, 1))
        for here, there in ((low, high), (high, low)):
            with np.errstate(invalid="ignore"):
                off = np.abs(((place[there] - place[here]) * normal[here]).sum(axis=-1))
                mixed[here] |= ~(off <= MIXED_STEP * np.abs(depth[here]))
            mixed[here] |= ~hit[there]
    found: Bools = mixed & hit
    return found


def _rendered(shot: Shot, needed: Collection[str]) -> Arrays:
    names = ["normal_camera" if name == "normal" else name for name in sorted(needed)]
    frame = shot.render(names)
    return {name.removesuffix("_camera"): frame[name] for name in names}


def _front(world: World, camera: Camera, threads: int | None) -> Arrays:
    """The first surfaces that face the camera."""
    origins, ways = camera.rays()
    fields = ("t", "instance", "normal", "position")
    found = world.cast_rays(origins, ways, fields=fields, facing="front", threads=threads)
    hit = np.isfinite(found["t"])
    with np.errstate(invalid="ignore"):
        forward = ((found["position"] - camera.location) * camera.forward).sum(axis=-1)
    return {
        "depth": np.where(hit, forward, np.inf).astype(np.float32),
        "distance": found["t"].astype(np.float32),
        "normal": (found["normal"] @ camera.R.T).astype(np.float32),
        "instance": found["instance"],
        "position": found["position"],
    }


def _ways(camera: Camera) -> Floats:
    """The unit directions [h, w, 3] of the rays in camera axes; 0 for pixels without a ray."""
    return np.nan_to_num(camera.rays()[1] @ camera.R.T)
