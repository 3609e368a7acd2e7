"""The common parts of every benchmark's report: machine, date, command, and storage."""

from __future__ import annotations

import datetime
import os
import platform
import shlex
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path

RESULTS = Path(__file__).parent / "results"


def machine() -> str:
    """Returns the number of cores, and the instruction sets that affect speed."""
    flags: set[str] = set()
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("flags"):
                flags = set(line.split(":")[1].split())
    isa = [name for name in ("avx2", "fma", "avx512f", "amx_tile") if name in flags]
    return f"{len(os.sched_getaffinity(0))} cores, {platform.machine()}{''.join(f', {name}' for name in isa)}"


def spread(seconds: Sequence[float]) -> tuple[float, float]:
    """Returns the best and the median."""
    return min(seconds), statistics.median(seconds)


def write(
    name: str, title: str, notes: Sequence[str], head: Sequence[str], rows: Sequence[Sequence[str]]
) -> Path:
    """Prints the table and saves it with the date in `results/`."""
    today = datetime.date.today().isoformat()
    command = " ".join(["python", f"benchmarks/{Path(sys.argv[0]).name}", *map(shlex.quote, sys.argv[1:])])
    lines = [
        f"# {title}",
        "",
        f"{today}, on {machine()}, Python {platform.python_version()}.",
        "",
        f"    {command}",
        "",
    ]
    lines += [f"{note}\n" for note in notes]
    lines += ["| " + " | ".join(row) + " |" for row in [head, ["---"] + ["--:"] * (len(head) - 1), *rows]]
    text = "\n".join(lines) + "\n"
    print(text)
    path = RESULTS / f"{today}-{name}.md"
    path.write_text(text, encoding="utf-8")
    print(f"written to {path}", file=sys.stderr)
    return path
