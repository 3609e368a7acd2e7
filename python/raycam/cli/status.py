"""`raycam status` and `raycam verify`."""

from __future__ import annotations

import argparse

from ..errors import JobError
from .options import Command


def _add_folder(command: argparse.ArgumentParser) -> None:
    command.add_argument("folder", metavar="DIR", help="a folder of pictures or a data set, or FILE.mp4.job")


def _add_status(command: argparse.ArgumentParser) -> None:
    _add_folder(command)
    command.set_defaults(run=_status)


def _status(options: argparse.Namespace) -> None:
    from ..jobs import Job

    job = Job(options.folder)
    state = job.status()
    about = job.description
    print(f"job       {about['job'][:12]}, {about['kind']}, raycam {about['raycam']}")
    print(f"world     {about['world'][:12]}")
    print(f"frames    {state.finished} of {state.frames} finished")
    runs = job.runs()
    print(f"running   {', '.join(runs) if runs else 'no'}")
    print(f"failed    {len(state.failed)}")
    for frame, error in list(state.failed.items())[:20]:
        print(f"  frame {frame}: {error} ({job.log(frame)})")
    if len(state.failed) > 20:
        print(f"  and {len(state.failed) - 20} more")


def _add_verify(command: argparse.ArgumentParser) -> None:
    _add_folder(command)
    command.set_defaults(run=_verify)


def _verify(options: argparse.Namespace) -> None:
    from ..jobs import Job

    job = Job(options.folder)
    wrong = job.verify()
    if wrong:
        first = next(iter(wrong.values()))
        raise JobError(
            f"{len(wrong)} damaged or gone, the first: {first}. What is damaged is called .damaged now, and the "
            "command that made the job makes all of them again"
        )
    state = job.status()
    print(f"{options.folder}: {state.finished} of {state.frames} frames finished, every byte as it was made")


STATUS = Command(_add_status, "show how far a job is", ["raycam status room.mp4.job"])
VERIFY = Command(_add_verify, "read every file of a job and compare it", ["raycam verify room.mp4.job"])
