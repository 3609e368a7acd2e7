"""A video as a job: frames are kept in the job's folder, and the file is encoded from them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from ..jobs.job import Job, Progress, Shard
from ..jobs.scheduler import Pool
from ..jobs.worker import FrameResult
from . import VideoPlan
from .files import Add, open_video, picture_name, read_picture

__all__ = ["job_folder", "make_video"]


def job_folder(path: str | os.PathLike[str]) -> Path:
    """The folder that contains the frames of a video file until it is complete.

    A folder of images is its own job folder.
    """
    target = Path(path)
    return target if not target.suffix else target.with_name(target.name + ".job")


def make_video(
    film: VideoPlan,
    path: str | os.PathLike[str],
    pool: Pool,
    *,
    frames: tuple[int | None, int | None] | None = None,
    shard: Shard | None = None,
    resume: bool = True,
    retry_failed: bool = False,
    keep_frames: bool = False,
    lossless: bool = False,
    audio: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> int | None:
    """Creates a video file or a folder of images by a job; returns the number of frames.

    `film` is the plan of the video. The job is in `job_folder(path)`. Frames go to the encoder in order as they are
    finished. An interrupted encoding starts again from the stored frames, which are removed when the file is
    complete, unless `keep_frames`. A `shard` that finishes while frames of other shards are missing creates no file
    and returns None. `frames`, `lossless` and `audio` are as in `write_video`, other arguments as in `Job.run`.

    Raises the errors of `write_video` and `Job.run`.
    """
    numbers = film.numbers(frames)
    target = Path(path)
    opened = open_video(
        target,
        film.camera.size,
        film.fps,
        lossless=lossless,
        alpha=film.transparent,
        audio=None if audio is None else Path(audio),
    )
    run = partial(
        Job.run, pool=pool, frames=numbers, shard=shard, retry_failed=retry_failed, progress=progress
    )
    if not target.suffix:
        with opened:  # only checks that the file can be opened; the job writes the images
            pass
        job = Job(target, film.package(), resume=resume)
        film.notices += job.status().notices
        run(job, finished=partial(_report, film))
        with job.assembling():
            return len(numbers) if all(map(job.has, numbers)) else None
    with ExitStack() as alone:
        try:
            with opened as add:
                job = Job(job_folder(target), film.package(), resume=resume)
                film.notices += job.status().notices
                encode = _encoder(job, numbers, add)
                encode()

                def finished(made: FrameResult) -> None:
                    _report(film, made)
                    encode()

                run(job, finished=finished)
                there = alone.enter_context(job.assembling())
                if not there or not encode():
                    raise _OtherShards
        except _OtherShards:
            return None if there else len(numbers)
        if keep_frames:
            job.mark_assembled([f"../{target.name}"])
        else:
            job.remove()
    return len(numbers)


def _encoder(job: Job, numbers: Iterable[int], add: Add) -> Callable[[], bool]:
    """Returns a function that encodes finished frames up to the first missing frame.

    The function returns True if no frame is missing.
    """
    waiting = iter(numbers)
    following = next(waiting, None)

    def encode() -> bool:
        nonlocal following
        while following is not None and job.has(following):
            add(following, read_picture(job.read(following)[picture_name(following)]))
            following = next(waiting, None)
        return following is None

    return encode


def _report(film: VideoPlan, made: FrameResult) -> None:
    film.notices += [notice for notice in made.notices if notice not in film.notices]


class _OtherShards(Exception):
    """Raised if other shards will create the file, or have already created it."""
