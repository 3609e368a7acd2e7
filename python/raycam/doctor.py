"""Report on the machine and the installation, with a self-test of rendering."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess
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

__all__ = ["doctor", "processor", "processor_in", "wheel"]


def doctor() -> str:
    """Returns the results of a self-test, and a description of the system, as text.

    The text contains versions, processor, instruction set and threads. Raises `Error` if the self-test fails.
    """
    return "\n".join(_lines())


def _lines() -> Iterator[str]:
    yield f"raycam       {_core.__version__}, {Path(__file__).parent}"
    yield f"python       {platform.python_version()}, {sys.executable}"
    yield f"platform     {platform.platform()}"
    yield f"wheel        {wheel()}"
    for package, extra in PACKAGES.items():
        shown = package.removesuffix("-python-headless")
        try:
            yield f"{shown:12} {metadata.version(package)}"
        except metadata.PackageNotFoundError:
            need = (
                f"for {EXTRAS[extra]}: pip install 'raycam[{extra}]'" if extra else f"pip install {package}"
            )
            yield f"{shown:12} missing; {need}"
    yield f"processor    {processor()}"
    yield f"instructions {_core.instruction_set()} (the kernel in use)"
    threads = _core.available_threads()
    yield f"threads      {threads} of {os.cpu_count()} (limited by CPU affinity and control groups)"
    yield f"self-test    {_self_test()}"


PACKAGES = {
    **{"numpy": "", "websockets": ""},
    **{"av": "video", "pyoidn": "denoise", "usd-core": "usd", "cairosvg": "figure", "h5py": "hdf5"},
    **{"opencv-python-headless": "selfcheck", "distributed": "cluster", "embreex": "bench"},
}
"""Packages that raycam uses, with the extra that installs them."""
EXTRAS = {
    "video": "video files",
    "denoise": "--denoise",
    "usd": "USD files",
    "figure": "figures as PDF and PNG",
    "hdf5": "data sets in the format hdf5",
    "selfcheck": "raycam selfcheck",
    "cluster": "--cluster",
    "bench": "comparison with Embree in raycam bench",
}


def wheel() -> str:
    """Returns the tags of the installed wheel, or a note that raycam runs from source."""
    try:
        installed = metadata.distribution("raycam")
        about = installed.read_text("WHEEL") or ""
        source = json.loads(installed.read_text("direct_url.json") or "{}")
    except (metadata.PackageNotFoundError, ValueError):
        return "none; raycam runs from its source folder"
    tags = [line.partition(":")[2].strip() for line in about.splitlines() if line.startswith("Tag:")]
    editable = source.get("dir_info", {}).get("editable", False)
    return f"{', '.join(tags) or 'unknown tags'}{' (editable, built from source)' if editable else ''}"


def processor() -> str:
    """Returns the processor's name, if the system reports it."""
    if sys.platform == "darwin":
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            command = ["sysctl", "-n", "machdep.cpu.brand_string"]
            found = subprocess.run(command, capture_output=True, text=True, check=True, timeout=5)
            return found.stdout.strip()
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            return processor_in(Path("/proc/cpuinfo").read_text()) or platform.machine()
    return platform.processor() or platform.machine()


def processor_in(cpuinfo: str) -> str | None:
    """Returns the processor's name from the text of /proc/cpuinfo.

    For ARM processors without a name, the result contains the implementer and part. The result is None if the
    text contains neither.
    """
    values = dict(line.split(":", 1) for line in reversed(cpuinfo.splitlines()) if ":" in line)
    named = {key.strip(): value.strip() for key, value in values.items()}
    if "model name" in named:
        return named["model name"]
    if "CPU part" in named:
        implementer, part = named.get("CPU implementer", "?"), named["CPU part"]
        name = ARM_PARTS.get((implementer, part), f"implementer {implementer}, part {part}")
        return f"{platform.machine()}, {name}"
    return None


ARM_PARTS = {
    ("0x41", "0xd08"): "Cortex-A72",
    ("0x41", "0xd0b"): "Cortex-A76",
    ("0x41", "0xd0c"): "Neoverse N1",
    ("0x41", "0xd40"): "Neoverse V1",
    ("0x41", "0xd49"): "Neoverse N2",
    ("0x41", "0xd4f"): "Neoverse V2",
}
"""Names of ARM's processors by implementer and part (Main ID Register)."""


def _self_test() -> str:
    """Compares an image with the reference, pixel by pixel."""
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
            f"the self-test failed: {differ.sum()} of {differ.size} pixels differ from the reference image",
            code="failed_selftest",
        )
    hit = frame["instance"] >= 0
    error = np.abs(frame["depth"][hit] / oracle["depth"][hit] - 1.0).max()
    same = np.abs(frame["color"] - oracle["color"]).max()
    if error > 1e-6 or same > 1e-6:
        raise Error(
            f"the self-test failed: depth differs from the reference by {error:.1e} (relative), colour by {same:.1e}",
            code="failed_selftest",
        )
    return f"{differ.size} pixels equal the reference, {int(hit.sum())} of them with a hit"
