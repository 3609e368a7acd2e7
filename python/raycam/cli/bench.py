"""The command `raycam bench`."""

from __future__ import annotations

import argparse

from .options.command import Command, parse_size


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "scenes", metavar="SCENE", nargs="*", help="scenes: terrain, rock, town, hair (default: all)"
    )
    command.add_argument(
        "--triangles",
        metavar="N",
        type=int,
        default=1_000_000,
        help="approximate number of triangles per scene (default: 1000000)",
    )
    command.add_argument(
        "--size",
        metavar="WxH",
        type=parse_size,
        default=(640, 480),
        help="image size of the primary rays (default: 640x480)",
    )
    command.add_argument(
        "--repeat",
        metavar="N",
        type=int,
        default=5,
        help="number of repetitions, of which the fastest is reported (default: 5)",
    )
    command.add_argument(
        "--threads",
        metavar="N",
        type=int,
        help="number of raycam's threads (default: all); rates with one thread are always reported too",
    )
    command.add_argument("--seed", metavar="N", type=int, default=1, help="seed of the scenes (default: 1)")
    command.add_argument("--json", action="store_true", help="print JSON instead of a table")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    import json

    from ..bench import bench
    from ..progress import bar

    with bar("tracing") as progress:
        report = bench(
            options.scenes or None,
            triangles=options.triangles,
            size=options.size,
            repeat=options.repeat,
            threads=options.threads,
            seed=options.seed,
            progress=progress,
        )
    print(json.dumps(report.as_dict(), indent=2) if options.json else report)


COMMAND = Command(
    _add,
    "measure how many rays per second this machine traces, compared with Embree if embreex is installed",
    [
        "raycam bench",
        "raycam bench hair --triangles 4000000 --threads 1",
        "raycam bench --json > rates.json",
    ],
)
