"""Data sets: images with ground truth in common training formats.

raycam.dataset.write(world, "apples", "coco", cameras=cameras)
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import several, whole
from ..calibration import Cameras
from ..camera import Camera
from ..cluster.pools import make_pool
from ..errors import Notice, SettingsError, nearest
from ..io import atomic_files
from ..jobs.job import Job
from ..jobs.worker import FrameResult
from ..notices import distinct, warn, warn_all
from ..one_line import counted
from ..randomize import Recipe
from ..render import render
from ..render.arguments import UNPOSED, is_unposed_within, world_of
from ..rig import Rig
from ..world import World
from .formats import FORMATS
from .job_units import job_package, read_record, record_name
from .joint_keypoints import JOINTS, joint_keypoints
from .lidars import other_sensors, world_sensors
from .lost import lost_notices
from .per_world import each_index
from .plan import Format, Plan, Record, View, check_cameras, check_poses, resolve_options
from .training.card import card_files
from .trajectory import load_rigs, times_of
from .world_sequence import MAX_WORLDS, Worlds, WorldSequence

__all__ = ["FORMATS", "DatasetResult", "views", "write"]

RENDERING = set(inspect.signature(render).parameters) - {
    *("world", "camera", "channels", "frame", "region", "progress"),
}
"""Arguments of `raycam.render` that `write` also accepts."""

Progress = Callable[[int, int, int], object]


@dataclass(frozen=True)
class DatasetResult:
    """The result of `write`."""

    folder: Path
    """The folder of the data set."""
    frames: int
    """The number of views."""
    made: int
    """The number of units of work (views, or tar files of views) that this call created; all other units already
    existed.
    """
    complete: bool = True
    """True if all views are finished; index files are written only when the views of all shards are finished."""
    notices: tuple[Notice, ...] = ()
    """Notices about workers, damaged files, views, and values that the format cannot represent, one for each cause."""


def views(
    world: World,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None = None,
    times: Sequence[float] | None = None,
) -> list[View]:
    """Returns the views of a data set, which are cameras with times.

    Without `cameras`, a world with a video has one view per frame; any other world has one view for each of its
    cameras, or one for its default camera. `times`, one for each camera, are seconds of the world's video. A `Rig`
    among the cameras has one time, and adds one view for each of its cameras, or one view without a camera if it has
    only other sensors. A single rig moves with the world's video, if any. Sensors of a rig that are not cameras are
    sampled once for each pose of the rig. Lidars move during their frame, from each pose of the rig to the next pose,
    if the poses have times. Without `cameras`, the world's sensors (`World.sensors`) are sampled once for each time,
    with its first view.
    """
    own_sensors = False
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
            return [
                View(world.camera_at(base, moment), moment, sensors=world_sensors(world, clock, number))
                for number, moment in enumerate(clock)
            ]
        cameras, own_sensors = world.cameras or [world.default_camera()], True
    chosen_cameras = _items(cameras)
    moments: list[float | None] = [None] * len(chosen_cameras)
    if times is not None:
        moments = [float(time) for time in times]
    if len(moments) != len(chosen_cameras):
        raise SettingsError(
            f"{counted(len(moments), 'time')} for {counted(len(chosen_cameras), 'camera')}; expected one time for "
            "each camera",
            code="wrong_shape",
        )
    found = []
    labels = list(cameras) if isinstance(cameras, Mapping) else [None] * len(chosen_cameras)
    images = cameras.images if isinstance(cameras, Cameras) else {}
    for number, (item, moment, label) in enumerate(zip(chosen_cameras, moments, labels, strict=True)):
        if isinstance(item, Rig):
            # The other sensors of a rig are sampled once for each pose, with the rig's first view.
            others = other_sensors(chosen_cameras, number, moments)
            body = item.R, item.C
            if not item:
                found.append(View(None, moment, rig=(number, ""), body=body, sensors=others))
            for place, (name, camera) in enumerate(item.items()):
                own = others if place == 0 else {}
                found.append(View(camera, moment, rig=(number, name), body=body, label=name, sensors=own))
        else:
            own = world_sensors(world, moments, number) if own_sensors else {}
            found.append(View(item, moment, label=label, image=images.get(label or ""), sensors=own))
    return found


def write(
    world: World | Recipe | str | os.PathLike[str] | None = None,
    folder: str | os.PathLike[str] | None = None,
    format: str = "coco",
    *,
    worlds: Worlds | None = None,
    categories: Sequence[str] | Mapping[int, str] | None = None,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None = None,
    times: Sequence[float] | None = None,
    poses: str | os.PathLike[str] | None = None,
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
    """Renders views of a world with ground truth and writes them in one of the `FORMATS`.

    `cameras` and `times` are as in `views`. With a rig as `cameras`, `poses` may be a trajectory file ("tum", "euroc",
    "kitti-poses", ...) of its body, whose times are used unless `times` is given. `options` are those of
    `raycam.render` (`integrator`, `samples`, `seed`, `exposure`, `threads`, ...) and those of the format, below. Ground
    truth belongs to the exact rays through the pixels' centres, independent of the samples. Objects with a category are
    labelled; in a world without categories, all objects are labelled "object".

    With most formats, the sensors of a rig that are not cameras (`Rig.sensors`) are sampled once for each pose of the
    rig and written to sensors/NAME/NUMBER.npz, where NUMBER is the number of the pose's first view, with the sensor's
    arrays, "world_from_sensor" and "times". "semantickitti", "nuscenes" and "mcap" write lidar scans in the format's
    own form, and accept rigs without a camera; every other format requires one.

    The formats and their options, with default values in parentheses:

    * "coco": `segmentation` ("rle" or "polygon"), `min_pixels` (1), the minimum visible pixels of an object,
      `keypoints` ({category: {"names": [...], "points": [[x, y, z], ...] in mesh coordinates, or barycentric weights
      with "triangles": [...], which follow meshes that deform, "skeleton": [...]}}). The optional key "objects" has one
      entry per point: the name of the object in whose mesh coordinates the point is given, or a list of that name and
      of other objects that do not occlude the point; then all objects of the category form one annotation.
      `keypoints="joints"` uses the joints of robots that were added with `category="robot"`
    * "bop": `split` ("train_pbr"), `scene` (0), `depth_scale` in mm (default: for each image, the finest that can
      represent its depth), `model_ids` ({category or object name: obj_id}). Objects with equal meshes share one model,
      unless different ids are assigned to them. Without `model_ids`, the obj_id is the category if that is a whole
      number, or else an unused number in the order of the categories' names
    * "kitti": `baseline` in metres adds a right camera with its images (image_3) and disparity; a rig of two cameras,
      which must be a rectified pair, has the same effect; `flow` (False) adds optical flow to the next view
    * "semantickitti": scans of a rig's lidar, with labels of points, calibration, poses and times; the first camera's
      images. Without a camera, camera 0 is at the lidar, looks along the lidar's x axis, and has P = [I 0]. `lidar`
      (default: the only one), `sequence` ("00"), `labels` ({category: id}, default: the ids of the categories), `fps`
      (10) for views without a time. Points are relative to the rig's pose at the start of the frame
    * "nuscenes": the thirteen tables, images and scans of a rig with lidars, with boxes of objects, their visibility
      (empty without a camera) and numbers of points. `version` ("v1.0-mini"), `scene` ("scene-0001"), `key_every` (1):
      every Nth pose is a key frame, the others are sweeps; `fps` (20) for views without a time, `start_time` (0 s).
      nuScenes' tools require nuScenes' sensor names, such as CAM_FRONT and LIDAR_TOP
    * "colmap": `points` (10,000) sampled on visible surfaces; rigs are written as rigs and frames
    * "nerf", "tum", "scannet": `depth_scale` (1, 0.2 and 1), millimetres per unit of depth; "tum" and "scannet" also
      have `fps` (30) for the timestamps of views without a time
    * "webdataset": `shard_size` (32) samples per tar file, `channels`, `segmentation`
    * "yolo": `task` ("detect", "segment", "pose" or "obb"), `splits` ({"train": 0.8, "val": 0.2}) by `split_seed`
      (0), where views of one world or of one pose of a rig stay together; `min_pixels` (1), `keypoints`
      ({"points": ...} or "joints") and `flip_idx` of "pose"; the separate parts of an object are joined into one
      polygon by double edges without width
    * "panoptic": COCO's panoptic format; all objects of a category in `stuff` form one segment
    * "semantic": label ids, instance ids, colours; `labels` ({category: id}), `void` (0), `palette` ({category: rgb})
    * "mot": a sequence, or one for each camera of a rig; `sequence` ("seq01"), `fps` (30); boxes around whole objects,
      with pixel coordinates from 1
    * "hdf5": BlenderProc's files; requires `h5py`; the depth of the background is 1e10
    * "mcap": a ROS 2 bag with camera_info, PNG images, depth (32FC1, metres, NaN for the background; omitted with
      `depth=False`), instance ids (32SC1) and poses world_from_camera under `topic` ("/camera"), the frame tree world,
      base_link (a rig's body), camera in /tf and /tf_static, and the objects' names as JSON in /instances. The world's
      robots have their URDF in /robot_description, their joints in /joint_states, and their links as frames in /tf and
      /tf_static; with several robots, the names are /ROBOT/robot_description and ROBOT/LINK. Lidars of a rig are
      PointCloud2 on /NAME/points, with the fields of the manufacturer's driver, then instance and category.
      `imu` (0) is the rate in Hz of sensor_msgs/Imu messages of a rig's body on /imu, from its poses, without noise.
      `start_time` (1.0 s) is added to all times, because ROS reads a stamp of 0 as "latest"; `fps` (30) for views
      without a time. Requires `raycam[mcap]`
    * "replicator": the files of NVIDIA Replicator's BasicWriter: rgb, boxes in 2D and 3D, segmentation, distances,
      normals, camera_params; distances of the background are infinite, x_max and y_max are one past the last pixel
    * "photos": depth, normals and masks under the names of photographs; options and layouts as in `raycam.photo_truth`

    Images are numbered, 000000.png. For cameras of `load_cameras`, "coco", "colmap", "nerf", "yolo", "panoptic",
    "semantic", "mcap" and "photos" use the image names of the cameras' file (`Cameras.images`), with their own ending.
    COCO's `images` also contain the camera's name, K, lens and pose.

    As for real sensors, integer depth is 0 for the background and beyond the range of the format (KITTI 255.99 m, TUM
    13.107 m, NeRF and ScanNet 65.535 m; `depth_scale` changes the last three). KITTI's files cannot represent
    disparities of 0 or less either. A notice reports the fraction of such pixels.

    `world` may be the path of a world or model, or, with `count`, the path of a recipe.

    With a `raycam.Recipe` as `world`, `count` randomised worlds are rendered, each with its own cameras or with
    `cameras`. "coco", "kitti", "webdataset", "yolo", "panoptic", "semantic", "hdf5" and "replicator" write all worlds
    into one data set. "bop" also writes one data set, with a scene for each world, numbered from `scene`, and one model
    for each shape in all scenes. The other formats write a data set for each world, in a folder with its number. A view
    depends only on the recipe, its seed and the world's number. Every worker reads the recipe's files from their
    original folder.

    Instead of `world`, the caller may pass `worlds`, for example from a simulator: a list, another object with a length
    and indices such as a PyTorch data set, an iterator, or a function that returns world i. `count` is the number of
    worlds of an iterator or a function. They are written like a recipe's worlds: each with its own cameras, which must
    have the same names in all worlds, or all with `cameras`. `categories` lists the categories of all worlds; by
    default, they are those of the worlds of a list or tuple, or else of the first world. The worlds are created in this
    process and rendered on all threads; `shard` divides them among several processes. A resumed call does not request
    the worlds of finished views again. However, the index files of "bop" and of formats with one data set per world
    require all worlds again; these formats therefore require a list or a function.

    The data set is a `raycam.jobs.Job`. Every file is written atomically. After an interruption, the same call keeps
    the finished views and renders the others, with `retry_failed` also the views that failed; `resume=False` starts
    again. `workers` and `shard` (i, n) are as in `make_pool` and `Job.run`. The index files are written when all
    views are finished. Memory does not grow with the number of views; "colmap" stores one bit for each point and view
    in a temporary file. `progress(done, total, failed)` is called after each unit of work; `tell` is as in
    `make_pool`. `dataset_card.json` and `.md` contain counts, seeds, versions and `licence`, the licence of the
    images.

    Raises `SettingsError` and `CameraError`, before anything is rendered, for options and cameras that the format
    does not support; `JobError` if the folder contains another data set, and at the end if views failed; and
    `OSError` if a file cannot be read or written.
    """
    if folder is None:
        raise SettingsError("folder is missing; pass the data set's output folder", code="missing_value")
    if format not in FORMATS:
        raise SettingsError(nearest("format", format, list(FORMATS)), code="unknown_name")
    kind = FORMATS[format]
    if poses is not None:
        cameras, trajectory = load_rigs(cameras, poses)
        times = times_of(trajectory) if times is None else times
    source = _source(world, worlds, count, categories)
    _check_source(source, format, workers)
    rendering = {name: options.pop(name) for name in RENDERING & options.keys()}
    threads = rendering.pop("threads", None)
    own = resolve_options(options, kind.options, format)
    joints: list[Notice] = []
    if own.get("keypoints") == JOINTS:
        own["keypoints"], joints = joint_keypoints(source, format)
    plan = make_plan(source, cameras, times, count, dict(sorted(rendering.items())), own, threads)
    check_cameras(plan, kind, format)
    if kind.posed:
        check_poses(plan, format)
    kind.check(plan)
    target = Path(folder)
    late = [*joints, *late_times(plan), *unposed_cameras(plan), *kind.notices(plan)]
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
        yield read_record(job.folder / record_name(unit))


def _write_index(job: Job, kind: Format, plan: Plan, format: str, licence: str) -> bool:
    """Writes the index files if all units are finished, and returns True.

    Returns False if units of other shards are missing.
    """
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
            job.release_package()
    return complete


def _check_source(source: World | Recipe | WorldSequence, format: str, workers: int | str | None) -> None:
    """Raises `SettingsError` if a caller's worlds cannot be created where they are needed."""
    if not isinstance(source, WorldSequence):
        return
    if workers is not None:
        raise SettingsError(
            "workers cannot be used with worlds, which are created in this process; use shard=(i, n)",
            code="conflicting_values",
        )
    if source.is_iterator and (format == "bop" or not FORMATS[format].many_worlds):
        raise SettingsError(
            f"{format} requires each world twice, for images and index files; pass a list or a function instead of "
            "an iterator",
            code="conflicting_values",
        )


def _source(
    world: World | Recipe | str | os.PathLike[str] | None,
    worlds: Worlds | None,
    count: int | None,
    categories: Sequence[str] | Mapping[int, str] | None,
) -> World | Recipe | WorldSequence:
    """The world, or the source of many worlds."""
    if worlds is not None:
        if world is not None:
            raise SettingsError(
                "world and worlds cannot be combined; pass one of them", code="conflicting_values"
            )
        return WorldSequence(worlds, count, categories)
    if categories is not None:
        raise SettingsError(
            "categories requires worlds; a world or a recipe contains its own categories",
            code="conflicting_values",
        )
    if world is None:
        raise SettingsError("world is missing; pass a world, a recipe, or worlds=", code="missing_value")
    if isinstance(world, World | Recipe):
        return world
    return world_of(world) if count is None else Recipe(world)


def make_plan(
    world: World | Recipe | WorldSequence,
    cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig] | Rig | None,
    times: Sequence[float] | None,
    count: int | None,
    rendering: Mapping[str, Any],
    options: Mapping[str, Any],
    threads: int | None,
) -> Plan:
    """Plans the views of a world, or of many worlds."""
    if isinstance(world, World):
        if count is not None:
            raise SettingsError(
                "count requires a recipe or worlds; got a single world", code="conflicting_values"
            )
        return Plan(world, views(world, cameras, times), rendering, options, threads)
    if times is not None:
        raise SettingsError("times cannot be used with a recipe or worlds", code="conflicting_values")
    given_count = world.count if isinstance(world, WorldSequence) else 1 if count is None else count
    worlds = whole("count", given_count, 1, MAX_WORLDS)
    first = world.world(0)
    seen: dict[str | None, Camera] = {}
    if cameras is None:
        world.check_camera_counts()
        named = {name: camera.with_background(None) for name, camera in first.cameras.items()}
        seen = dict(named.items()) if named else {None: first.default_camera()}
        shots = [View(camera, None, i, name) for i in range(worlds) for name, camera in seen.items()]
    else:
        if isinstance(cameras, Rig) or any(isinstance(item, Rig) for item in _items(cameras)):
            raise SettingsError(
                "a rig cannot be used with a recipe or worlds; use the rig's cameras",
                code="conflicting_values",
            )
        given = [camera for camera in _items(cameras) if isinstance(camera, Camera)]
        sought = isinstance(world, Recipe) and any("see" in row for row in world.description["camera"])
        if (
            sought
            and given
            and all(np.array_equal(item.R, np.eye(3)) and not item.location.any() for item in given)
        ):
            raise SettingsError(
                "cameras: the given cameras are all at the origin and would replace the recipe's cameras, which have "
                'random poses (key "see"); omit cameras, and write calibration = "FILE" into [[camera]] instead of '
                "size, fov or K",
                code="conflicting_values",
            )
        shots = [View(camera, None, i) for i in range(worlds) for camera in given]
    return Plan(first, shots, rendering, options, threads, world)


UNITS = ((1e17, "nanoseconds"), (1e14, "microseconds"), (1e11, "milliseconds"), (1e8, "seconds"))
"""Smallest numbers that are interpreted as times since 1970 in these units."""


def late_times(plan: Plan) -> list[Notice]:
    """Returns a notice if times are before or after the world's video or animations.

    Nothing in the world moves at such times.
    """
    video = plan.world.video
    ends = [animation.duration for animation in plan.world.animations]
    ends.extend([video.frames / video.fps] if video is not None else [])
    times = [view.time for view in plan.shots if view.time is not None]
    # Times up to one frame after the end are allowed, because the last frame lasts that long.
    end = max(ends, default=0.0) + (1 / video.fps if video is not None else 0.0)
    out = [time for time in times if not 0 <= time <= end]
    if plan.recipe is not None or not ends or not out:
        return []
    first = out[0]
    unit = next((f" (probably {name} since 1970)" for least, name in UNITS if first >= least), "")
    many = f"all times ({len(out)})" if len(out) == len(times) else f"some times ({len(out)} of {len(times)})"
    message = (
        f"{many} are outside the world's motion (0 to {max(ends):g} s), for example {first!r}{unit}, so the world "
        "does not move at these times; use seconds from the motion's beginning (--time-offset first)"
    )
    return [Notice(message, "outside_times")]


def unposed_cameras(plan: Plan) -> list[Notice]:
    """Returns a notice if all cameras are at the origin and inside the world.

    Cameras from files without poses are all at the origin.
    """
    cameras = [view.camera for view in plan.shots if view.has_camera]
    if plan.recipe is not None or not cameras:
        return []
    if not all(is_unposed_within(plan.world, camera) for camera in cameras):
        return []
    message = f"{UNPOSED}; give it poses: camera.at_pose(R, C), or --cameras POSES --intrinsics FILE"
    return [Notice(message, "unposed_camera")]


def _items(cameras: Sequence[Camera | Rig] | Mapping[str, Camera | Rig]) -> list[Camera | Rig]:
    """Returns cameras and rigs as a list; raises `SettingsError` for anything else."""
    if isinstance(cameras, str | Path):
        raise SettingsError(
            f"cameras must be cameras or rigs, got {cameras!r}; use raycam.load_cameras({cameras!r})",
            code="wrong_type",
        )
    found = (
        list(cameras.values())
        if isinstance(cameras, Mapping)
        else several("cameras", cameras, "cameras or rigs")
    )
    for item in found:
        if not isinstance(item, Camera | Rig):
            raise SettingsError(
                f"cameras must be cameras or rigs, got {item!r}; use world.cameras[name] for a name",
                code="wrong_type",
            )
    return found


def write_file(path: Path, pieces: Any) -> None:
    """Writes a file in pieces, atomically; creates its folder if missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_files.atomic_path(path) as temporary, temporary.open("wb") as file:
        for piece in pieces:
            file.write(piece)
