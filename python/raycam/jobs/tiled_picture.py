"""A large image as a job of tiles.

The assembled image is bit-identical to an image that is rendered at once.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..camera import Camera
from ..errors import JobError, Notice, SettingsError
from ..io.npz import npz_bytes
from ..render import DEFAULT_CHANNELS, Region, channel_names, render
from ..render.frame import Frame
from ..world import World
from .job import Job, Progress, Shard
from .job_package import JobPackage
from .kinds import FrameMaker, register
from .kinds import Progress as TileProgress
from .scheduler import Pool
from .worker import FrameResult

__all__ = ["assemble", "job_package", "render_tiled", "tile_maker"]

DEFAULT_TILE = 256


def job_package(
    world: World,
    camera: Camera | None = None,
    *,
    channels: Sequence[str] | str = DEFAULT_CHANNELS,
    region: Region | None = None,
    tile: int | None = None,
    **settings: Any,
) -> JobPackage:
    """Returns the job that renders the image of `raycam.render` in square tiles.

    The arguments are the same as for `raycam.render`. A tile has `tile` x `tile` pixels (default: 256).

    Run the job with `Job(folder, package).run(pool)`, then `assemble` the tiles.

    Raises `SettingsError` for `time_limit` and `denoise`, which require the whole image, and for a `region` outside the
    image.
    """
    for name in ("time_limit", "denoise"):
        if settings.get(name) or world.render_settings.get(name):
            raise SettingsError(
                f"{name} requires the whole image and cannot be used with tiles; use samples or noise_threshold",
                code="conflicting_values",
            )
    seen = world.default_camera() if camera is None else camera
    cameras = set(world.cameras)
    name = next(name for name in (f"picture-{i}" for i in range(len(cameras) + 1)) if name not in cameras)
    x, y, width, height = (0, 0, *seen.size) if region is None else region
    if not (
        x >= 0
        and y >= 0
        and width > 0
        and height > 0
        and x + width <= seen.size[0]
        and y + height <= seen.size[1]
    ):
        raise SettingsError(
            f"region {region} (x, y, width, height) is outside the image (size {seen.size})",
            code="out_of_range",
        )
    names = channel_names(channels)
    if settings.get("transparent_background") and "color" in names:
        added = ("alpha", "shadow") if world._core.has_catchers else ("alpha",)
        names = list(dict.fromkeys([*names, *added]))
    tile = tile or DEFAULT_TILE
    plan = {
        "camera": name,
        "view": seen.P.tolist(),  # for readers of job.json: the camera itself is in the world
        "region": [x, y, width, height],
        "tile": tile,
        "channels": names,
        "render": {key: value for key, value in settings.items() if key != "threads"},
    }
    count = -(-width // tile) * -(-height // tile)
    return JobPackage("picture", count, plan, world.with_cameras({name: seen}))


def tile_maker(world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
    """Returns the frame maker of the kind "image".

    The files are tile_0000.npz and so on, with the channels of each tile.
    """
    camera = world.camera(settings["camera"])
    left, top, width, height = settings["region"]
    tile = settings["tile"]
    across = -(-width // tile)
    plan = dict(settings["render"])
    if threads is not None:
        plan["threads"] = threads

    def make(number: int, progress: TileProgress | None) -> tuple[dict[str, bytes], list[Notice]]:
        x, y = tile * (number % across), tile * (number // across)
        region = (left + x, top + y, min(tile, width - x), min(tile, height - y))
        frame = render(world, camera, channels=settings["channels"], region=region, progress=progress, **plan)
        arrays: dict[str, Any] = dict(frame)
        arrays |= {"exposure": np.array(frame.exposure), "view": np.array(frame.view)}
        return {f"tile_{number:04}.npz": npz_bytes({"region": np.array(region), **arrays})}, frame.notices

    return make


register("picture", tile_maker)


def assemble(job: Job) -> Frame:
    """Assembles the image of a job; raises `JobError` if tiles are missing."""
    state = job.status()
    if state.finished < state.frames:
        raise JobError(
            f"{job.folder}: {state.finished} of {state.frames} tiles are finished; finish the job first",
            code="unfinished_job",
        )
    camera = job.package.world.camera(job.package.settings["camera"])
    parts = []
    for _, files in job.finished():
        with np.load(io.BytesIO(next(iter(files.values()))), allow_pickle=False) as arrays:
            x, y, width, height = arrays["region"].tolist()
            parts.append(
                Frame(
                    {name: arrays[name] for name in job.package.settings["channels"]},
                    camera=camera,
                    size=camera.size,
                    region=(x, y, width, height),
                    exposure=float(arrays["exposure"]),
                    view=str(arrays["view"]),
                    transparent=bool(job.package.settings["render"].get("transparent_background")),
                )
            )
    return Frame.merge(parts)


def render_tiled(
    package: JobPackage,
    folder: str | os.PathLike[str],
    pool: Pool,
    *,
    shard: Shard | None = None,
    resume: bool = True,
    retry_failed: bool = False,
    progress: Progress | None = None,
    save: Callable[[Frame], object] | None = None,
) -> Frame | None:
    """Renders the image of a package from `job_package`, with a job in `folder`.

    Returns None if tiles of other shards are not finished yet. With `save`, `save(image)` is called and the job
    removed; returns None if another shard has already saved the image. Other arguments are as in `Job.run`, whose
    errors are raised.
    """
    job = Job(folder, package, resume=resume)
    notices = dict.fromkeys(job.status().notices)

    def report(made: FrameResult) -> None:
        notices.update(dict.fromkeys(made.notices))

    job.run(pool, shard=shard, retry_failed=retry_failed, progress=progress, finished=report)
    with job.assembling() as there:
        if not there or job.status().finished < package.frames:
            return None
        picture = assemble(job)
        picture.notices = list(notices)
        if save is not None:
            save(picture)
            job.remove()
    return picture
