"""Options that select and load a world."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...errors import SettingsError
from ...world.endings import MODEL_ENDINGS
from .messages import print_detail, print_notice, print_notices

if TYPE_CHECKING:
    from pathlib import Path

    from ...world import World

__all__ = [
    "add_folder",
    "add_geometry",
    "add_texture_memory",
    "add_world",
    "find_file",
    "load_world",
    "parse_animation",
]


def add_world(command: argparse.ArgumentParser) -> None:
    """Adds WORLD, the first argument, and options for joints, variant, folder and textures."""
    command.add_argument(
        "world", metavar="WORLD", help=f"world file (.toml), or a model ({' '.join(MODEL_ENDINGS[1:])})"
    )
    command.add_argument(
        "--joints",
        metavar="[ROBOT/]JOINT=VALUE",
        nargs="+",
        help="joint values of robots in radians and metres, as in shoulder=0.5",
    )
    add_geometry(command)
    command.add_argument("--variant", metavar="NAME", help="material variant of a glTF file")
    add_folder(command)
    add_texture_memory(command)


def add_folder(command: argparse.ArgumentParser) -> None:
    """Adds `--folder`."""
    command.add_argument(
        "--folder",
        metavar="FOLDER",
        help="folder that contains all files named in the world file (default: the world file's folder)",
    )


def add_texture_memory(command: argparse.ArgumentParser) -> None:
    """Adds `--texture-memory`."""
    command.add_argument(
        "--texture-memory",
        metavar="SIZE",
        help="maximum memory for textures, as in 512MiB; the rest is kept in a temporary file (default: no limit)",
    )


def add_geometry(command: argparse.ArgumentParser) -> None:
    """Adds `--geometry`."""
    command.add_argument(
        "--geometry",
        choices=["visual", "collision", "both"],
        help="shapes of a robot: visual (default), collision, or both, with half-transparent collision shapes",
    )


def load_world(options: argparse.Namespace) -> World:
    """Loads the world and prints its notices."""
    from ...world.load import load_with_assumed_axis
    from ...world.sources import assumed_up_axis

    path = find_file(options.world)
    up = getattr(options, "up", None)
    world = load_with_assumed_axis(
        path,
        variant=getattr(options, "variant", None),
        texture_memory=options.texture_memory,
        folder=getattr(options, "folder", None),
        up=up,
        geometry=getattr(options, "geometry", None),
    )
    set_joints(world, getattr(options, "joints", None) or [])
    if up is None and assumed_up_axis(path) is not None:
        print_notice("assuming that y is up, as in most OBJ files; use --up z if the model lies on its side")
    print_notices(world.notices)
    bounds = world.bounds
    print_detail(f"{world!r}, bounds {[] if bounds is None else bounds.round(6).tolist()}")
    return world


def set_joints(world: World, texts: Sequence[str]) -> None:
    """Sets the joint values of `--joints`.

    Raises `SettingsError` for texts of another form, and the `WorldError`s of `World.set_joints`.
    """
    found: dict[str, dict[str, float]] = {}
    for text in texts:
        place, _, value = text.partition("=")
        robot, _, joint = place.rpartition("/")
        if not robot:
            if len(world.robots) != 1:
                names = ", ".join(world.robots) or "none"
                raise SettingsError(
                    f"--joints {text}: expected ROBOT/JOINT=VALUE; robots: {names}", code="invalid_value"
                )
            robot = next(iter(world.robots))
        try:
            found.setdefault(robot, {})[joint] = float(value)
        except ValueError:
            raise SettingsError(
                f"--joints {text}: expected JOINT=VALUE with a number", code="wrong_type"
            ) from None
    for robot, joints in found.items():
        world.set_joints(robot, joints)


def find_file(text: str) -> str | Path:
    """Returns the path of a file, or of raycam's bundled file of this name.

    The bundled file is used if the file does not exist.
    """
    from ...data import bundled

    found = bundled(text)
    if found is None or os.fspath(found) == text:
        return text
    print_notice(f"{text}: file not found; using raycam's own file of this name")
    return found


def parse_animation(world: World, text: str | None) -> str | int | None:
    """Parses an animation's name, or its number if no animation has this name."""
    if text is None or not text.isdecimal() or text in (each.name for each in world.animations):
        return text
    return int(text)
