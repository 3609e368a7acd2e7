"""Options of commands that run jobs: workers, shards, priority and signals."""

from __future__ import annotations

import argparse
import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ...errors import SettingsError
from ...io.system_calls import lower_own_priority
from .messages import print_notice, print_notices

if TYPE_CHECKING:
    from ...jobs.scheduler import Pool

__all__ = ["add_job", "job_options", "job_pool", "lower_priority", "parse_shard"]


def add_job(command: argparse.ArgumentParser) -> None:
    """Adds the options of commands that run jobs, such as `--resume`, `--shard` and `--workers`."""
    group = command.add_argument_group(
        "jobs", "a stopped command keeps its finished frames; run it again to resume"
    )
    group.add_argument(
        "--resume",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="resume a partial run (default); --no-resume starts over",
    )
    group.add_argument("--retry-failed", action="store_true", help="retry frames that failed")
    group.add_argument(
        "--shard", metavar="I/N", help="render every Nth frame, starting with the Ith (I is 1 to N)"
    )
    where = group.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=int, help="render frames in N processes")
    where.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="render frames with Dask: tcp://HOST:PORT, tls://HOST:PORT, local:N",
    )
    group.add_argument("--low-priority", action="store_true", help="run at low priority")


def parse_shard(options: argparse.Namespace) -> tuple[int, int] | None:
    """Returns (I, N) of `--shard`, or None; raises `SettingsError` for other values."""
    if options.shard is None:
        return None
    first, _, last = options.shard.partition("/")
    try:
        i, n = int(first), int(last)
    except ValueError:
        i = n = 0
    if not 1 <= i <= n:
        raise SettingsError(
            f"--shard {options.shard}: expected I/N with I from 1 to N, as in 3/16", code="out_of_range"
        )
    return i, n


def lower_priority(options: argparse.Namespace) -> None:
    """Lowers the priority of the process if `--low-priority` is given."""
    if options.low_priority:
        lower_own_priority()


@contextmanager
def job_options(options: argparse.Namespace) -> Iterator[None]:
    """Context with the priority of the options, in which SIGTERM ends the job as Ctrl-C does."""
    lower_priority(options)
    before = signal.signal(signal.SIGTERM, _interrupt)
    if options.cluster is not None:
        logging.disable()  # raycam reports lost connections and workers itself, so Dask need not
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        logging.disable(logging.NOTSET)


@contextmanager
def job_pool(options: argparse.Namespace) -> Iterator[Pool]:
    """Context with the workers of the options, and `job_options`."""
    from ...cluster.pools import make_pool

    where = options.cluster if options.cluster is not None else options.workers
    with job_options(options), make_pool(where, threads=options.threads, tell=print_notice) as pool:
        at_first = list(pool.notices)
        print_notices(at_first)
        yield pool
        print_notices([notice for notice in pool.notices if notice not in at_first])


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt
