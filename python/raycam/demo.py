"""The demo: a world with a scanned mesh, and shell commands.

The commands create images, an explained pixel and a video.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

from .errors import Error
from .io import atomic_files
from .video.files import has_av

__all__ = ["demo"]

MESH = ("cow.obj", "cow.mtl", "cow_texture.png")


def demo(folder: Path, run: Callable[[Sequence[str]], int]) -> None:
    """Writes the world `spot.toml` and its images and video to `folder`.

    The folder is created if necessary. An existing world file is kept, so that the demo shows changes to the
    file. `run` executes the words of a command line and returns the command's exit status.
    """
    (folder / "spot").mkdir(parents=True, exist_ok=True)
    assets = resources.files(__package__) / "assets"
    for name in ("CREDITS.md", *(f"spot/{name}" for name in MESH)):
        atomic_files.write(folder / name, assets.joinpath(name).read_bytes())
    world = folder / "spot.toml"
    if not world.exists():
        atomic_files.write(world, assets.joinpath("spot.toml").read_bytes())
    print(f"{world}: the world file, which you can change and render again\n")

    for command in commands(folder):
        print(f"$ {command}", flush=True)
        if run(shlex.split(command)[1:]) != 0:
            raise Error(f"the command failed: {command}", code="failed_command")
        print()


def commands(folder: Path) -> list[str]:
    """The commands of the demo."""

    def quoted(name: str) -> str:
        return shlex.quote(str(folder / name))

    world = quoted("spot.toml")
    film = "orbit.mp4" if has_av() else "orbit.gif"  # PyAV belongs to the extra raycam[video]
    return [
        f"raycam info {world}",
        f"raycam render {world} -o {quoted('flat.png')} --integrator flat --samples 16",
        f"raycam render {world} -o {quoted('lit.png')}",
        f"raycam render {world} -o {quoted('truth.exr')} --samples 4 --channels all",
        f"raycam explain {world} --pixel 470 250 --figure {quoted('explain.svg')}",
        f"raycam video {world} -o {quoted(film)} --size 480x300 --samples 8 --no-ambient-occlusion",
    ]
