"""Data sets: pictures with ground truth in common training formats.

raycam.dataset.write(world, "apples", "coco", cameras=cameras)
"""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import whole
from ..calibration import Cameras
from ..camera import Camera
from ..cluster.pools import make_pool
from ..errors import Notice, SettingsError, nearest
from ..io import atomic_files
from ..jobs.job import Job
from ..jobs.worker import FrameResult
from ..notices import distinct, warn, warn_all
from ..randomize import Recipe
from ..render import render
from ..render.arguments import UNPOSED, is_unposed_within, world_of
from ..rig import Rig
from ..world import World
from .formats import FORMATS
from .job_units import job_package, record_name
from .lost import lost_notices
from .per_world import each_index
from .plan import Format, Plan, Record, View, check_poses, resolve_options
from .training.card import card_files

__all__ = ["FORMATS", "DatasetResult", "views", "write"]

RENDERING = set(inspect.signature(render).parameters) - {
    *("world", "camera", "channels", "frame", "region", "progress"),
}
"""The arguments of `raycam.render` that a data set passes on."""

Progress = Callable[[int, int, int], object]


@dataclass(frozen=True)
class DatasetResult:
    """The result of `write`."""

    folder: Path
    """The folder of the data set."""
    frames: int
    """The number of views."""
    made: int
    """The number of units of work (views, or tar files of them) that this call made; the others existed before."""
    complete: bool = True
    """True if all views are finished; without the views of other shards, there are no index files yet."""
    notices: tuple[Notice, ...] = ()
    """Notices about workers, damaged files, views, and values that the format cannot hold, one for each cause."""


def views(
    world: World,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None = None,
    times: Sequence[float] | None = None,
) -> list[View]:
    """The views of a data set: cameras and their times.

    Without `cameras`, a world with a video has one view per frame; another world has a view for each of its cameras, or
    one for its default camera. `times` in seconds, one for each camera, are times of the world's video. A `Rig` among
    the cameras has one time and gives one view for each of its cameras. A single rig moves with the world's video, if
    any. The sensors of a rig that are not cameras are sampled once for each pose of the rig.
    """
    if isinstance(cameras, Rig):
        rig = cameras
        if times is None and world.video is not None:
            times = [frame / world.video.fps for frame in range(world.video.frames)]
            cameras = [world.rig_at(rig, moment) for moment in times]
        else:
            cameras = [rig]
    if cameras is None:
        if times is None and world.video is not None:
            video, base = world.video, world.default_camera()
            clock = [frame / video.fps for frame in range(video.frames)]
            return [View(world.camera_at(base, moment), moment) for moment in clock]
        cameras = world.cameras or [world.default_camera()]
    chosen_cameras = _items(cameras)
    moments: list[float | None] = [None] * len(chosen_cameras)
    if times is not None:
        moments = [float(time) for time in times]
    if len(moments) != len(chosen_cameras):
        raise SettingsError(f"{len(moments)} times for {len(chosen_cameras)} cameras; expected one for each")
    found = []
    labels = list(cameras) if isinstance(cameras, Mapping) else [None] * len(chosen_cameras)
    images = cameras.images if isinstance(cameras, Cameras) else {}
    for number, (item, moment, label) in enumerate(zip(chosen_cameras, moments, labels, strict=True)):
        if isinstance(item, Rig):
            # The other sensors of a rig are sampled once for each pose, with the rig's first view.
            others = {name: one for name, one in item.sensors.items() if not isinstance(one, Camera)}
            for place, (name, camera) in enumerate(item.items()):
                own = others if place == 0 else {}
                found.append(View(camera, moment, rig=(number, name), label=name, sensors=own))
        else:
            found.append(View(item, moment, label=label, image=images.get(label or "")))
    return found


def write(
    world: World | Recipe | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    format: str = "coco",
    *,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None = None,
    times: Sequence[float] | None = None,
    count: int | None = None,
    resume: bool = True,
    workers: int | str | None = None,
    shard: tuple[int, int] | None = None,
    retry_failed: bool = False,
    progress: Progress | None = None,
    tell: Callable[[Notice], object] = warn,
    licence: str = "",
    **options: Any,
) -> DatasetResult:
    """Renders views of a world with ground truth and writes them to a folder in one of `FORMATS`.

    `cameras` and `times` are as in `views`; `options` are those of `raycam.render` (`integrator`, `samples`, `seed`,
    `exposure`, `threads`, ...) and those of the format, below. Ground truth belongs to the exact rays through the
    pixels' centres, independent of the samples. Objects with a category are labelled; in a world without categories,
    all objects are labelled "object". The formats and their options:

    With any format, the sensors of a rig that are not cameras (`Rig.sensors`) are sampled once for each pose of the rig
    and written to sensors/NAME/NUMBER.npz, where NUMBER is the number of the pose's first view. The file contains the
    sensor's arrays, "world_from_sensor" and "times".

    * "coco": `segmentation` ("rle" or "polygon"), `min_pixels` (1), the minimum visible pixels of an object,
      `keypoints` ({category: {"names": [...], "points": [[x, y, z], ...] in mesh coordinates, or barycentric weights
      with "triangles": [...], which follow meshes that deform, "skeleton": [...]}})
    * "bop": `split` ("train_pbr"), `scene` (0), `depth_scale` in mm (default: the finest of each picture)
    * "kitti": `baseline` in metres adds the right camera, disparity and image_3; a rig's first two cameras, a rectified
      pair, give the same; `flow` (False) adds optical flow to the next view
    * "colmap": `points` (10,000) sampled on visible surfaces; rigs are written as rigs and frames
    * "nerf", "tum", "scannet": `depth_scale` (1, 0.2 and 1), millimetres per unit of depth; the last two: `fps` (30)
      for the timestamps of views without a time
    * "webdataset": `shard_size` (32) samples per tar file, `channels`, `segmentation`
    * "yolo": `task` ("detect", "segment", "pose" or "obb"), `splits` ({"train": 0.8, "val": 0.2}) by `split_seed`
      (0), where views of one world or of one pose of a rig stay together; `min_pixels` (1), `keypoints`
      ({"points": ...}) and `flip_idx` of "pose"; the pieces of a thing are one polygon with bridges of no width
    * "panoptic": COCO's; `stuff`, the categories of which all objects are one segment
    * "semantic": label ids, instance ids, colours; `labels` ({category: id}), `void` (0), `palette` ({category: rgb})
    * "mot": a sequence, or one for each camera of a rig; `sequence` ("seq01"), `fps` (30); boxes of whole objects,
      from 1
    * "hdf5": BlenderProc's files; needs `h5py`; the depth of the background is 1e10
    * "mcap": a bag of ROS 2 with camera_info, PNG pictures, depth (32FC1, metres, NaN for none; `depth=False` leaves it
      out) and poses world_from_camera, under `topic` ("/camera"); `fps` (30) for views without a time. Needs
      `raycam[mcap]`
    * "replicator": the files of NVIDIA Replicator's BasicWriter: rgb, boxes in 2D and 3D, segmentation, distances,
      normals, camera_params; distances of the background are infinite, x_max and y_max are one past the last pixel

    Pictures are numbered, 000000.png; "coco", "colmap" and "nerf" give the pictures of `load_cameras` the names that
    the file has for them (`Cameras.images`), with the ending .png. COCO's `images` have the camera's name, K, lens and
    pose as well.

    Integer depth is 0 for the background and beyond the range of the format (KITTI 255.99 m, TUM 13.107 m, NeRF and
    ScanNet 65.535 m; `depth_scale` changes the last three), like the depth of sensors. Disparities of 0 and below do
    not exist in KITTI's files either. A notice has the share of such pixels.

    `world` may be a path: of a world or model, or with `count` of a recipe.

    A `raycam.Recipe` instead of a world gives `count` randomised worlds, each seen by its own cameras, or by
    `cameras`. "coco", "kitti", "webdataset", "yolo", "panoptic", "semantic", "hdf5" and "replicator" put all worlds
    into one data set. So does "bop", with a scene for each world, numbered from `scene`, and one model for each shape
    in all scenes. The other formats write a data set for each world, in a folder with its number. A view is a function
    of the recipe, its seed and the number of the world. Every worker reads the recipe's files from their original
    folder.

    The data set is a `raycam.jobs.Job`. Every file is written atomically, and the same call resumes an interrupted one
    with its finished views; `resume=False` starts again. `workers` and `shard` (i, n) are as in `make_pool` and
    `Job.run`. The index files are written when all views are finished. Memory does not grow with the number of views;
    "colmap" keeps one bit for each point and view in a temporary file. `progress(done, total, failed)` is called after
    each unit of work; `tell` is as in `make_pool`. `dataset_card.json` and `.md` have counts, seeds, versions and
    `licence`, that of the pictures.

    Raises `SettingsError` and `CameraError`, before anything is rendered, for options and cameras that the format does
    not support; `JobError` if the folder holds another data set, and at the end if views failed; `OSError`.
    """
    if not isinstance(world, World | Recipe):
        world = world_of(world) if count is None else Recipe(world)
    if format not in FORMATS:
        raise SettingsError(nearest("format", format, list(FORMATS)))
    kind = FORMATS[format]
    rendering = {name: options.pop(name) for name in RENDERING & options.keys()}
    threads = rendering.pop("threads", None)
    own = resolve_options(options, kind.options, format)
    plan = make_plan(world, cameras, times, count, dict(sorted(rendering.items())), own, threads)
    if kind.posed:
        check_poses(plan, format)
    kind.check(plan)
    target = Path(folder)
    late = [*late_times(plan), *unposed_cameras(plan), *kind.notices(plan)]
    what = job_package(format, plan)
    job = Job(target, what, resume=resume)
    damaged = job.status().notices
    if plan.recipe is None:
        plan.world = what.world  # the same world, so that its acceleration structures are built once
    made = 0
    said: list[Notice] = []

    def finished(unit: FrameResult) -> None:
        nonlocal made
        made += 1
        said[:] = distinct([*said, *unit.notices])

    with make_pool(workers, threads=threads, tell=tell) as pool:
        job.run(
            pool,
            shard=shard,
            retry_failed=retry_failed,
            progress=progress,
            finished=finished,
        )
        told = [*late, *damaged, *pool.notices]
    complete = _write_index(job, kind, plan, format, licence)
    if complete:
        told += lost_notices(_records(job, kind.units(plan)), format)
    warn_all(told)
    notices = (*told, *said)
    return DatasetResult(target, len(plan.shots), made, complete, notices)


def _records(job: Job, end: int, first: int = 0) -> Iterator[Record]:
    """Iterates over the records of units."""
    for unit in range(first, end):
        yield json.loads((job.folder / record_name(unit)).read_bytes())


def _write_index(job: Job, kind: Format, plan: Plan, format: str, licence: str) -> bool:
    """Writes the index files if all units are finished; returns False if units of other shards are missing."""
    total = kind.units(plan)

    def records(first: int = 0, end: int | None = None) -> Iterator[Record]:
        return _records(job, total if end is None else end, first)

    with job.assembling():
        complete = all(job.has(unit) for unit in range(total))
        if complete:
            apart = plan.recipe is not None and not kind.many_worlds
            files = each_index(kind, plan, records) if apart else kind.index(plan, records)
            names = []
            for name, pieces in chain(files, card_files(format, plan, records, licence)):
                write_file(job.folder / name, pieces)
                names.append(name)
            job.mark_assembled(names)
    return complete


def make_plan(
    world: World | Recipe,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None,
    times: Sequence[float] | None,
    count: int | None,
    rendering: Mapping[str, Any],
    options: Mapping[str, Any],
    threads: int | None,
) -> Plan:
    """Plans the views of a world, or of the worlds of a recipe."""
    if isinstance(world, World):
        if count is not None:
            raise SettingsError("count is of the worlds of a recipe, and this is one world")
        return Plan(world, views(world, cameras, times), rendering, options, threads)
    if times is not None:
        raise SettingsError("times are of a world that moves, and not of a recipe")
    worlds = whole("count", 1 if count is None else count, 1, 10_000_000)
    first = world.world(0)
    seen: dict[str | None, Camera] = {}
    if cameras is None:
        world.check_camera_counts()
        named = {name: camera.with_background(None) for name, camera in first.cameras.items()}
        seen = dict(named.items()) if named else {None: first.default_camera()}
        shots = [View(camera, None, i, name) for i in range(worlds) for name, camera in seen.items()]
    else:
        if isinstance(cameras, Rig) or any(isinstance(item, Rig) for item in _items(cameras)):
            raise SettingsError("a rig is of one world, and a recipe makes many: give it the rig's cameras")
        given = [camera for camera in _items(cameras) if isinstance(camera, Camera)]
        sought = any("see" in row for row in world.description["camera"])
        if (
            sought
            and given
            and all(np.array_equal(item.R, np.eye(3)) and not item.location.any() for item in given)
        ):
            raise SettingsError(
                "the given cameras are at the origin, as a calibration without a pose leaves them, and replace those "
                'of the recipe, which are told what to see: leave cameras out, and write calibration = "FILE" instead '
                "of size, fov or K into [[camera]]"
            )
        shots = [View(camera, None, i) for i in range(worlds) for camera in given]
    return Plan(first, shots, rendering, options, threads, world)


UNITS = ((1e17, "nanoseconds"), (1e14, "microseconds"), (1e11, "milliseconds"), (1e8, "seconds"))
"""The least numbers that are times since 1970 in these units."""


def late_times(plan: Plan) -> list[Notice]:
    """The notice that times lie before or after the world's video or animations, where nothing moves any more."""
    video = plan.world.video
    ends = [animation.duration for animation in plan.world.animations]
    ends.extend([video.frames / video.fps] if video is not None else [])
    times = [view.time for view in plan.shots if view.time is not None]
    # A frame later it may well be: the last one lasts so long.
    end = max(ends, default=0.0) + (1 / video.fps if video is not None else 0.0)
    out = [time for time in times if not 0 <= time <= end]
    if plan.recipe is not None or not ends or not out:
        return []
    first = out[0]
    unit = next((f", {name} since 1970 by their size" for least, name in UNITS if first >= least), "")
    many = f"all {len(out)} times" if len(out) == len(times) else f"{len(out)} of {len(times)} times"
    message = (
        f"{many} are outside of what moves in the world (0 to {max(ends):g} s): the first is {first!r}{unit}. The "
        "world stands still there: give seconds from its beginning (--time-offset first)"
    )
    return [Notice(message, "outside_times")]


def unposed_cameras(plan: Plan) -> list[Notice]:
    """The notice that all cameras are at the origin, amid the world, as files without poses leave them."""
    if plan.recipe is not None or not all(is_unposed_within(plan.world, shot.camera) for shot in plan.shots):
        return []
    message = f"{UNPOSED}; give it poses: camera.at_pose(R, C), or --cameras POSES --intrinsics FILE"
    return [Notice(message, "unposed_camera")]


def _items(cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig]) -> list[Camera | Rig]:
    return list(cameras.values()) if isinstance(cameras, Mapping) else list(cameras)


def write_file(path: Path, pieces: Any) -> None:
    """Writes a file in pieces, atomically; creates its folder if missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_files.atomic_path(path) as temporary, temporary.open("wb") as file:
        for piece in pieces:
            file.write(piece)
