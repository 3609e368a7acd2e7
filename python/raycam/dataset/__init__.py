"""Data sets: pictures with their ground truth in the formats that people train on.

raycam.dataset.write(world, "apples", "coco", cameras=cameras)
"""

from __future__ import annotations

import hashlib
import inspect
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import files
from ..camera import Camera
from ..errors import SettingsError, nearest
from ..render import render
from ..world import World
from . import bop, coco, colmap, kitti, nerf, rgbd, web
from .plan import Plan, Record, View, chosen

__all__ = ["FORMATS", "Written", "views", "write"]

FORMATS = {
    "coco": coco.FORMAT,
    "bop": bop.FORMAT,
    "kitti": kitti.FORMAT,
    "colmap": colmap.FORMAT,
    "nerf": nerf.FORMAT,
    "tum": rgbd.TUM,
    "scannet": rgbd.SCANNET,
    "webdataset": web.FORMAT,
}
"""Every format by its name. Adding one is adding its file and its row."""

STATE = ".raycam-dataset"
"""The folder in a data set that remembers what is finished."""

RENDERING = set(inspect.signature(render).parameters) - {
    *("world", "camera", "channels", "frame", "region", "progress"),
}
"""The arguments of `raycam.render` that a data set passes on."""

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class Written:
    """A data set that was written."""

    folder: Path
    """Where it is."""
    frames: int
    """How many views it has."""
    made: int
    """How many units of work (views, or shards of them) this call made; the others were there."""


def views(
    world: World,
    cameras: Sequence[Camera] | Mapping[str, Camera] | None = None,
    times: Sequence[float] | None = None,
) -> list[View]:
    """The cameras of a data set and their times.

    Without `cameras`, a world with a video has one for each frame of it, and another all of its own cameras, or its
    default one. `times` in seconds, one for each camera, move the world as its video says.
    """
    if cameras is None:
        if times is None and world.video is not None:
            video, base = world.video, world.default_camera()
            moments = [frame / video.fps for frame in range(video.frames)]
            return [View(world.camera_at(base, moment), moment) for moment in moments]
        cameras = world.cameras or [world.default_camera()]
    chosen_cameras = list(cameras.values()) if isinstance(cameras, Mapping) else list(cameras)
    if times is None:
        return [View(camera, None) for camera in chosen_cameras]
    if len(times) != len(chosen_cameras):
        raise SettingsError(f"{len(times)} times for {len(chosen_cameras)} cameras; expected one for each")
    return [View(camera, float(time)) for camera, time in zip(chosen_cameras, times, strict=True)]


def write(
    world: World,
    folder: str | os.PathLike[str],
    format: str = "coco",
    *,
    cameras: Sequence[Camera] | Mapping[str, Camera] | None = None,
    times: Sequence[float] | None = None,
    resume: bool = True,
    progress: Progress | None = None,
    **options: Any,
) -> Written:
    """Writes what cameras see of a world, with ground truth, to a folder in one of `FORMATS`.

    `cameras` and `times` are as in `views`; `options` are those of `raycam.render` (`integrator`, `samples`, `seed`,
    `exposure`, `threads`, ...) and those of the format, below. Ground truth is that of the exact rays through the
    pixels' centres, whatever the samples. Objects with a category are labelled; in a world without categories all
    are, as "object". The formats and their options:

    * "coco": `segmentation` ("rle" or "polygon"), `min_pixels` (1) that must be seen of an object, `keypoints`
      ({category: {"names": [...], "points": [[x, y, z], ...] in the mesh's coordinates, "skeleton": [...]}})
    * "bop": `split` ("train_pbr"), `scene` (0), `depth_scale` in mm (default: the finest of each picture)
    * "kitti": `baseline` in metres adds the right camera, disparity and image_3; `flow` (False) to the next view
    * "colmap": `points` (10,000) sampled on what is seen
    * "nerf": none; "tum" and "scannet": `fps` (30) of the timestamps of views without a time
    * "webdataset": `shard` (100) samples in a tar file, `channels`, `segmentation`

    Integer depth is 0 where there is none, and where it is beyond what the format can say (KITTI 256 m, TUM 13 m, NeRF
    and ScanNet 65 m), as sensors have it.

    Every file is complete or not there. Views that are finished stay when the same call is made again after it was
    stopped, unless `resume` is False. Memory does not grow with the number of views, but for "colmap", whose tracks of
    points are kept until they are written. `progress(done, total)` is called after each unit of work.

    Raises `SettingsError` and `CameraError` for what the format does not have, before anything is rendered, and where
    the folder holds another data set; `OSError` where it cannot be written to.
    """
    if format not in FORMATS:
        raise SettingsError(nearest("format", format, list(FORMATS)))
    kind = FORMATS[format]
    rendering = {name: options.pop(name) for name in RENDERING & options.keys()}
    threads = rendering.pop("threads", None)
    own = chosen(options, kind.options, format)
    plan = Plan(world, views(world, cameras, times), dict(sorted(rendering.items())), own, threads)
    kind.check(plan)
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    state = target / STATE
    begin(state, identity(format, plan), resume)
    total, made = kind.units(plan), 0
    for unit in range(total):
        record = state / f"{unit:06d}.json"
        if not record.exists():
            parts, known = kind.make(plan, unit)
            for name, data in parts.items():
                put(target / name, [data])
            put(record, [json.dumps(known).encode()])
            made += 1
        if progress is not None:
            progress(unit + 1, total)

    def records() -> Iterator[Record]:
        for unit in range(total):
            yield json.loads((state / f"{unit:06d}.json").read_bytes())

    for name, pieces in kind.index(plan, records):
        put(target / name, pieces)
    return Written(target, len(plan.shots), made)


def put(path: Path, pieces: Any) -> None:
    """Writes a file in pieces, by the one way files are written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with files.atomic_path(path) as temporary, temporary.open("wb") as file:
        for piece in pieces:
            file.write(piece)


def identity(format: str, plan: Plan) -> str:
    """What tells one data set from another: format, options, cameras, and the world's objects and lights."""
    numbers = [[view.camera._identity(), view.time] for view in plan.shots]
    things = [[item.name, item.category, item.matrix.tolist(), item.triangles] for item in plan.objects]
    said = [
        format,
        plan.options,
        plan.rendering,
        numbers,
        things,
        plan.world.lights,
        plan.world.render_settings,
    ]
    return hashlib.sha256(repr(said).encode()).hexdigest()


def begin(state: Path, identity: str, resume: bool) -> None:
    """Makes the folder ready, or finds it as the same call left it."""
    told = state / "dataset"
    if state.exists() and not resume:
        for record in [told, *state.glob("*.json")]:
            record.unlink(missing_ok=True)
    if told.exists() and told.read_text() != identity:
        raise SettingsError(
            f"{state.parent}: this folder holds another data set; take a new one, or resume=False to write over it"
        )
    put(told, [identity.encode()])
