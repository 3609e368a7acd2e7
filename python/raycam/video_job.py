"""A video as a job: frames that survive, and a file that is encoded from them."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from pathlib import Path

from .dispatch import Pool
from .jobs import Job, Progress, Shard
from .video import Film
from .video_files import Add, open_video, picture_name, read_picture
from .workers import Made

__all__ = ["job_folder", "make_video"]


def job_folder(path: str | os.PathLike[str]) -> Path:
    """Where the frames of a video file wait until it is complete; a folder of pictures is its own."""
    target = Path(path)
    return target if not target.suffix else target.with_name(target.name + ".job")


def make_video(
    film: Film,
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
    """Makes a video file or a folder of pictures by a job in `job_folder(path)`; how many frames it shows.

    Frames go to the encoder in order as they are finished. An encoder that was interrupted begins anew, from the
    frames; those are removed when the file is complete, unless `keep_frames`. A `shard` that finishes while frames of
    others are missing makes no file, and gives None. `frames`, `lossless` and `audio` are as in `write_video`, the
    rest is as in `Job.run`.

    Raises what `write_video` and `Job.run` raise.
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
    if not target.suffix:
        with opened:  # only for what it refuses: the job writes the pictures
            pass
        Job(target, film.package(), resume=resume).run(
            pool, frames=numbers, shard=shard, retry_failed=retry_failed, progress=progress,
            finished=lambda made: _tell(film, made),
        )  # fmt: skip
        job = Job(target)  # what other shards have made by now
        return len(numbers) if all(map(job.has, numbers)) else None
    try:
        job = _encoded(film, target, opened, pool, numbers, shard, resume, retry_failed, progress)
    except _Incomplete:
        return None
    if not keep_frames:
        job.remove()
    return len(numbers)


def _encoded(
    film: Film,
    target: Path,
    opened: AbstractContextManager[Add],
    pool: Pool,
    numbers: range,
    shard: Shard | None,
    resume: bool,
    retry_failed: bool,
    progress: Progress | None,
) -> Job:
    """Makes the file and gives the job; raises `_Incomplete` where frames of other shards are missing."""
    with opened as add:
        job = Job(job_folder(target), film.package(), resume=resume)
        waiting = iter(numbers)
        following = next(waiting, None)

        def encode(made: Made | None = None) -> None:
            nonlocal following
            if made is not None:
                _tell(film, made)
            while following is not None and job.has(following):
                add(following, read_picture(job.read(following)[picture_name(following)]))
                following = next(waiting, None)

        encode()
        job.run(
            pool,
            frames=numbers,
            shard=shard,
            retry_failed=retry_failed,
            progress=progress,
            finished=encode,
        )
        encode()
        if following is not None:
            raise _Incomplete
    return job


def _tell(film: Film, made: Made) -> None:
    film.notices += [notice for notice in made.notices if notice not in film.notices]


class _Incomplete(Exception):
    """Other shards have frames to make."""
