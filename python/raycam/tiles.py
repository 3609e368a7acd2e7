"""A large picture as a job: its tiles are made anywhere and joined, bit for bit as if rendered in one."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .camera import Camera
from .errors import JobError
from .frame import Frame
from .jobs import Job
from .package import Package
from .render import DEFAULT_CHANNELS, Progress, channel_names, render
from .workers import Maker
from .world import World

__all__ = ["join", "maker", "package"]

TILE = 512


def package(
    world: World,
    camera: Camera | None = None,
    *,
    channels: Sequence[str] | str = DEFAULT_CHANNELS,
    tile: int = TILE,
    **settings: Any,
) -> Package:
    """The picture that `raycam.render` makes of the same arguments, as a job of tiles of `tile` x `tile` pixels.

    Run it by `Job(folder, package).run(pool)`, then `join` its tiles.
    """
    seen = world.default_camera() if camera is None else camera
    cameras = set(world.cameras)
    name = next(name for name in (f"picture-{i}" for i in range(len(cameras) + 1)) if name not in cameras)
    width, height = seen.size
    regions = [
        [x, y, min(tile, width - x), min(tile, height - y)]
        for y in range(0, height, tile)
        for x in range(0, width, tile)
    ]
    plan = {
        "camera": name,
        "view": seen.P.tolist(),  # for people: the camera itself is with the world
        "size": [width, height],
        "tile": tile,
        "channels": channel_names(channels),
        "render": {key: value for key, value in settings.items() if key != "threads"},
    }
    return Package("picture", len(regions), plan, world.with_cameras({name: seen}))


def maker(world: World, settings: Mapping[str, Any], threads: int | None) -> Maker:
    """What a worker does for a job of kind "picture": tile_0000.npz and so on, with the channels as they are."""
    camera = world.camera(settings["camera"])
    width, _ = settings["size"]
    tile = settings["tile"]
    across = -(-width // tile)
    plan = dict(settings["render"])
    if threads is not None:
        plan["threads"] = threads

    def make(number: int, progress: Progress | None) -> tuple[dict[str, bytes], list[str]]:
        x, y = tile * (number % across), tile * (number // across)
        region = (x, y, min(tile, camera.size[0] - x), min(tile, camera.size[1] - y))
        frame = render(world, camera, channels=settings["channels"], region=region, progress=progress, **plan)
        buffer = io.BytesIO()
        arrays: dict[str, Any] = dict(frame)
        np.savez(buffer, region=np.array(region), exposure=np.array(frame.exposure), **arrays)
        return {f"tile_{number:04}.npz": buffer.getvalue()}, frame.notices

    return make


def join(job: Job) -> Frame:
    """The picture of a job whose tiles are all finished; raises `JobError` where some are missing."""
    state = job.status()
    if state.finished < state.frames:
        raise JobError(
            f"{job.folder}: {state.finished} of {state.frames} tiles are finished; run it to its end first"
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
                )
            )
    return Frame.merge(parts)
