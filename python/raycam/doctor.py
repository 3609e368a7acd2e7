"""Report on the machine and the installation, with a self-test of rendering."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import numpy as np

from . import _core
from .camera import Camera
from .errors import Error
from .render import render
from .world import World

__all__ = ["doctor", "processor"]


def doctor() -> str:
    """Returns versions, processor, instruction set, threads and the result of a self-test, as text.

    Raises `Error` if the self-test fails.
    """
    return "\n".join(_lines())


def _lines() -> Iterator[str]:
    yield f"raycam       {_core.__version__}, {Path(__file__).parent}"
    yield f"python       {platform.python_version()}, {sys.executable}"
    yield f"platform     {platform.platform()}"
    for package in ("numpy", "rich", "av"):
        try:
            yield f"{package:12} {metadata.version(package)}"
        except metadata.PackageNotFoundError:
            yield f"{package:12} missing: pip install {package}"
    yield f"processor    {processor()}"
    yield f"instructions {_core.instruction_set()}"
    threads = _core.available_threads()
    yield f"threads      {threads} of {os.cpu_count()} (as affinity and control groups allow)"
    yield f"self-test    {_self_test()}"


def processor() -> str:
    """The name of the processor, as far as the system reports it."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _self_test() -> str:
    """Compares a picture with the reference, pixel by pixel."""
    world = World()
    world.add_object(box={"size": 1}, color="#c83c28")
    world.add_object(torus={"radius": 1.1, "tube": 0.2, "segments": 12}, pitch=25, color="#3c64c8")
    camera = Camera.look_at([3, -2.1, 1.7], [0, 0, 0], size=(96, 72), fov=45)
    channels = ["color", "depth", "instance", "triangle"]
    frame = render(world, camera, integrator="flat", samples=1, channels=channels)
    oracle = render(world, camera, integrator="reference", channels=channels)
    differ = (frame["instance"] != oracle["instance"]) | (frame["triangle"] != oracle["triangle"])
    if differ.any():
        raise Error(
            f"the self-test failed: {differ.sum()} of {differ.size} pixels differ from the reference's"
        )
    hit = frame["instance"] >= 0
    error = np.abs(frame["depth"][hit] / oracle["depth"][hit] - 1.0).max()
    same = np.abs(frame["color"] - oracle["color"]).max()
    if error > 1e-6 or same > 1e-6:
        raise Error(f"the self-test failed: depth differs by {error:.1e} (relative), colour by {same:.1e}")
    return f"{differ.size} pixels as the reference has them, {int(hit.sum())} of them hit"
