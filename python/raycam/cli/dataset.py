"""The command `raycam dataset`."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import SettingsError
from .options.cameras import WORLD_ENDINGS, add_calibration, add_size, load_calibration
from .options.command import Command
from .options.jobs import add_job, job_options, parse_shard
from .options.lidars import mount_lidars
from .options.messages import print_notices
from .options.rendering import add_render_options, given_render_options
from .options.rigs import add_rig, find_rig
from .options.worlds import add_world, load_world

if TYPE_CHECKING:
    from ..camera import Camera
    from ..randomize import Recipe
    from ..rig import Rig
    from ..world import World


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    world = next(action for action in command._actions if action.dest == "world")
    world.nargs = "?"  # --show requires no world
    command.add_argument("-o", "--output", metavar="DIR", help="folder to write to")
    command.add_argument(
        "--show",
        metavar="DIR",
        help="write DIR/contact_sheet.html, which shows the labels of an existing data set on its images "
        "(bop, coco, kitti, mot, panoptic, replicator, semantic, yolo)",
    )
    command.add_argument(
        "--format",
        metavar="NAME",
        default="coco",
        help="format: coco (default), bop, kitti, semantickitti, nuscenes, colmap, nerf, tum, scannet, webdataset, "
        "yolo, panoptic, semantic, mot, hdf5, mcap, replicator, photos",
    )
    command.add_argument(
        "--cameras",
        metavar="FILE",
        help="calibration, trajectory or world file that contains the cameras (default: every frame of the world's "
        "video, or the world's cameras)",
    )
    add_rig(command)
    command.add_argument(
        "--lidar",
        metavar="NAME=DEVICE@X,Y,Z",
        action="append",
        default=[],
        help="mount a lidar on the body of --rig, or on a rig of its own: its name, a device or calibration file, and "
        "its position in metres (x forward, y left, z up), as in LIDAR_TOP=vlp16@0,0,1.8; may be repeated",
    )
    command.add_argument(
        "--poses",
        metavar="FILE",
        help="trajectory file (tum, kitti-poses, ...) of the body that carries --rig or --lidar (default: the motion "
        "in the world's video, or a fixed pose)",
    )
    add_size(command, "image size in pixels; cameras in --cameras FILE that have another size are resized")
    add_calibration(command)
    command.add_argument(
        "--time-offset",
        metavar="SECONDS",
        help="time in seconds to subtract from the times of --cameras and --poses, or first for the earliest time "
        "(default: 0)",
    )
    command.add_argument(
        "--sample",
        metavar="N",
        type=int,
        help="use WORLD as a recipe (see raycam.Recipe) for N randomised worlds",
    )
    command.add_argument(
        "--option",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="option of the format, as in segmentation=polygon, baseline=0.54 or flow=true; may be repeated",
    )
    command.add_argument(
        "--licence", metavar="NAME", default="", help="licence of the images, written to the data set card"
    )
    add_render_options(command)
    add_job(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    if options.show is not None:
        from ..dataset.training.contact_sheet import contact_sheet

        print(contact_sheet(options.show))
        return
    if options.world is None or options.output is None:
        raise SettingsError("expected WORLD and -o DIR, or --show DIR", code="missing_value")
    from ..dataset import write
    from ..progress import frames_bar
    from ..randomize import Recipe

    chosen = dict(_option(text) for text in options.option)
    shard = parse_shard(options)
    on_rig = options.rig is not None or bool(options.lidar)
    if options.poses is not None and not on_rig:
        raise SettingsError("--poses requires --rig or --lidar", code="missing_value")
    world = load_world(options) if options.sample is None else Recipe(options.world)
    cameras, times = _rigs(world, options) if on_rig else _cameras(options)
    times = _from_offset(times, options.time_offset)
    with job_options(options), frames_bar("rendering views") as progress:
        written = write(
            world,
            options.output,
            options.format,
            cameras=cameras,
            times=None if options.sample is not None else times,
            count=options.sample,
            resume=options.resume,
            workers=options.cluster if options.cluster is not None else options.workers,
            shard=shard,
            retry_failed=options.retry_failed,
            progress=progress,
            licence=options.licence,
            **given_render_options(options),
            **chosen,
        )
    print_notices(written.notices)
    if written.complete:
        print(f"{options.output}: {written.frames} views, {options.format}")
    else:
        print(
            f"shard {options.shard} is finished; the index of {options.output} is written after the last shard"
        )


def _cameras(options: argparse.Namespace) -> tuple[Mapping[str, Camera] | None, list[float] | None]:
    """The cameras of the given file, and their times; None without a file."""
    if options.cameras is None:
        return None, None
    from ..dataset.trajectory import times_of
    from ..world.load import load

    times = None
    if str(options.cameras).endswith(WORLD_ENDINGS):
        cameras: Mapping[str, Camera] = load(options.cameras).cameras
    else:
        found = load_calibration(options.cameras, options)
        cameras, times = found, times_of(found)
    if not cameras:
        raise SettingsError(f"{options.cameras}: no cameras found", code="missing_value")
    return cameras, times


def _from_offset(times: list[float] | None, offset: str | None) -> list[float] | None:
    """The times minus an offset, which is a number of seconds or "first" for the earliest time."""
    if offset is None:
        return times
    if times is None:
        raise SettingsError("--time-offset requires --cameras or --poses with times", code="missing_value")
    try:
        start = min(times) if offset == "first" else float(offset)
    except ValueError:
        raise SettingsError(
            f"--time-offset {offset}: expected a number of seconds, or the word first", code="invalid_value"
        ) from None
    return [time - start for time in times]


def _rigs(
    world: World | Recipe, options: argparse.Namespace
) -> tuple[Rig | Mapping[str, Rig], list[float] | None]:
    """The rig at each of its poses, and the times of the poses."""
    from ..dataset.trajectory import load_rigs, times_of
    from ..world import World

    if options.cameras is not None or not isinstance(world, World):
        raise SettingsError(
            "--rig and --lidar cannot be combined with --cameras or --sample", code="conflicting_values"
        )
    rig = mount_lidars(find_rig(world, options), options.lidar)
    if options.poses is None:
        return rig, None
    rigs, poses = load_rigs(rig, options.poses)
    print_notices(poses.notices)
    return rigs, times_of(poses)


def _option(text: str) -> tuple[str, Any]:
    """Parses KEY=VALUE; the value is JSON or a word."""
    key, equals, value = text.partition("=")
    if not equals:
        raise SettingsError(f"--option {text}: expected KEY=VALUE", code="invalid_value")
    try:
        return key, json.loads(value)
    except ValueError:
        return key, value


COMMAND = Command(
    _add,
    "write a data set: images with ground truth",
    [
        "raycam dataset room.toml -o room --format coco --option segmentation=polygon",
        "raycam dataset room.toml -o room --format kitti --cameras poses.txt --intrinsics camera.yaml",
        "raycam dataset table.recipe.toml --sample 10000 -o table --workers 8    randomised worlds",
        "raycam dataset car.toml -o drive --rig stereo --poses body.tum --format kitti",
        "raycam dataset car.toml -o drive --rig car --lidar LIDAR_TOP=vlp16@0,0,1.8 --format nuscenes",
        "raycam dataset car.toml -o drive --lidar top=os1-64@0,0,1.8 --poses body.tum --format semantickitti",
        "raycam dataset room.toml -o room --format yolo --option task=segment",
        "raycam dataset room.toml -o room --shard 3/16              one of sixteen machines",
        "raycam dataset room.toml -o room --format bop --samples 64 --integrator path",
    ],
)
