"""The command `raycam bench`."""

from __future__ import annotations

import argparse

from ._options import Command, size_of


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "scenes", metavar="SCENE", nargs="*", help="terrain, rock, town, hair (all four otherwise)"
    )
    command.add_argument(
        "--triangles", metavar="N", type=int, default=1_000_000, help="of each scene, about (1000000)"
    )
    command.add_argument(
        "--size", metavar="WxH", type=size_of, default=(640, 480), help="primary rays (640x480)"
    )
    command.add_argument(
        "--repeat", metavar="N", type=int, default=5, help="calls, of which the best counts (5)"
    )
    command.add_argument(
        "--threads", metavar="N", type=int, help="threads of the first column (default: all)"
    )
    command.add_argument("--seed", metavar="N", type=int, default=1, help="another variation of the scenes")
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
    "measure how many rays a second this machine traces, and Embree beside it if embreex is installed",
    [
        "raycam bench",
        "raycam bench hair --triangles 4000000 --threads 1",
        "raycam bench --json > rates.json",
    ],
)
