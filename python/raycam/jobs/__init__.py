"""Resumable jobs, used for videos, data sets and large images.

A job is a folder. Each frame is a pure function of a `JobPackage` (world, settings, version) and the frame's number. So
a job may be killed at any instant, resumed, and split over processes and machines, and always gives the same bytes:

    package = JobPackage("video", frames=96, settings={...}, world=world)
    job = Job(folder, package)
    with make_pool("local:4") as pool:
        job.run(pool)                  # raises JobError at the end if frames failed
    for number, files in job.finished(): ...

A kind of job is a function `factory(world, settings, threads)`, given to `jobs.kinds.register`. The factory returns a
function `make(number, progress)`, which returns the files of a frame as `{name: bytes}`, and notices. Names are
relative to the folder, with `/` between folders. An index of all frames is created by the caller of `run`, from
`finished()`.

In the folder, `.raycam/` contains `job.json` (a readable description), `package` (the complete package),
`journal.jsonl` (the journal: finished frames with the hashes of their files; each shard has a journal of its own), and
`failed/` (logs of failed frames). All other files are results. A file with its final name is complete: results are
written to a temporary name, synced, renamed, and their folder is synced, before the journal records them.

This file imports no module of the package. A worker may import such a module in one thread while another thread
imports the package; if the package imported the module in turn, the two threads would deadlock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .job import Job, Status

__all__ = ["Job", "Status"]


def __getattr__(name: str) -> Any:
    """Imports the public names on first use."""
    if name in __all__:
        from . import job

        return getattr(job, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
