"""The commands `raycam status` and `raycam verify`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import JobError
from ..one_line import counted
from .options.command import Command

if TYPE_CHECKING:
    from ..jobs.job import Job


def _add_folder(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "folder",
        metavar="DIR",
        help="output folder (images or a data set), or an unfinished output file, such as a video",
    )


def _job(name: str) -> Job:
    """The job in a folder, or the job of an unfinished file."""
    from ..jobs.job import Job
    from ..video.job import job_folder

    folder = Path(name)
    if not folder.is_dir() and job_folder(folder).is_dir():
        folder = job_folder(folder)
    elif folder.is_file():
        raise JobError(
            f"{folder}: the file is complete and has no job; --keep-frames keeps the frames in {name}.job",
            code="missing_value",
        )
    return Job(folder)


def _add_status(command: argparse.ArgumentParser) -> None:
    _add_folder(command)
    command.set_defaults(run=_status)


def _status(options: argparse.Namespace) -> None:
    job = _job(options.folder)
    state = job.status()
    about = job.description
    print(f"job       {about['job'][:12]}, {about['kind']}, raycam {about['raycam']}")
    print(f"world     {about['world'][:12]}")
    print(f"frames    {state.finished} of {state.frames} finished")
    runs = job.running_processes()
    print(f"running   {', '.join(runs) if runs else 'no'}")
    print(f"failed    {len(state.failed)}")
    for frame, error in list(state.failed.items())[:20]:
        print(f"  frame {frame}: {error} ({job.log(frame)})")
    if len(state.failed) > 20:
        print(f"  and {len(state.failed) - 20} more")
    if state.damaged:
        print(f"damaged   {len(state.damaged)}")
        print(*(f"  {line}" for line in state.damaged), sep="\n")


def _add_verify(command: argparse.ArgumentParser) -> None:
    _add_folder(command)
    command.set_defaults(run=_verify)


def _verify(options: argparse.Namespace) -> None:
    job = _job(options.folder)
    wrong = job.verify()
    if wrong:
        print(*wrong.values(), sep="\n")
        raise JobError(
            f"{options.folder}: {counted(len(wrong), 'file')} damaged or missing; damaged files were renamed to "
            ".damaged, and running the job's command again restores all of them",
            code="damaged_job",
        )
    state = job.status()
    print(f"{options.folder}: {state.finished} of {state.frames} frames finished, all files intact")


STATUS = Command(_add_status, "show the progress of a job", ["raycam status room.mp4"])
VERIFY = Command(_add_verify, "verify the checksum of every file of a job", ["raycam verify room.mp4"])
