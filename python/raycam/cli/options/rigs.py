"""Options for rigs, from a world or a calibration file."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import SettingsError, nearest
from .cameras import WORLD_ENDINGS, load_calibration

if TYPE_CHECKING:
    from ...camera import Camera
    from ...render.frame import Frame
    from ...rig import Rig
    from ...world import World


def add_rig(command: argparse._ActionsContainer) -> None:
    """Adds `--rig`."""
    command.add_argument(
        "--rig",
        metavar="NAME|FILE",
        help="render all cameras of a rig: the name of a rig in the world, or a calibration file (kalibr, kitti, "
        "colmap, opencv stereo)",
    )


def find_rig(world: World, options: argparse.Namespace) -> Rig | None:
    """Returns the rig of `--rig`; None without the option.

    The rig is a rig of the world, or the first rig of a calibration or world file.
    """
    if options.rig is None:
        return None
    rigs = world.rigs
    if options.rig in rigs:
        return rigs[options.rig]
    if not Path(options.rig).exists():
        from ...world.missing_files import nearest_names

        known = f"; {nearest('rig', options.rig, list(rigs))}" if rigs else ", and the world has no rigs"
        raise SettingsError(
            f"--rig {options.rig}: file not found{known}{nearest_names(options.rig)}", code="file_not_found"
        )
    return next(iter(rigs_in(options.rig, options).values()))


def require_rig_only(world: World, options: argparse.Namespace) -> Rig | None:
    """Returns the rig of `--rig`, which must have a camera.

    Raises `SettingsError` if the rig has no camera, and if `--camera` or `--size` is given.
    """
    rig = find_rig(world, options)
    if rig is not None and not rig:
        raise SettingsError(
            f"--rig {options.rig}: rig {rig.name!r} has no camera; use raycam scan or raycam dataset for its lidars",
            code="missing_camera",
        )
    if rig is not None and (options.camera is not None or options.size is not None):
        raise SettingsError(
            "--rig cannot be combined with --camera or --size: all cameras of the rig are rendered as they are",
            code="conflicting_values",
        )
    return rig


def rigs_in(path: str, options: argparse.Namespace) -> Mapping[str, Rig]:
    """Loads the rigs of a calibration or a world file."""
    from ...world.load import load

    rigs = load(path).rigs if path.endswith(WORLD_ENDINGS) else load_calibration(path, options).rigs
    if not rigs:
        raise SettingsError(
            f"{path}: no rig found; expected several sensors on one body", code="missing_value"
        )
    return rigs


def cameras_in(path: str, options: argparse.Namespace) -> Mapping[str, Camera | Rig]:
    """Loads the cameras and rigs of a world file, or the cameras of a calibration.

    Cameras of a world that belong to a rig are not listed separately. Rigs that have no camera are omitted.
    """
    from ...world.load import load

    if not path.endswith(WORLD_ENDINGS):
        return load_calibration(path, options)
    world = load(path)
    rigs = world.rigs
    on_rigs = {f"{name}/{own}" for name, rig in rigs.items() for own in rig}
    found: dict[str, Camera | Rig] = {
        name: camera for name, camera in world.cameras.items() if name not in on_rigs
    }
    found |= {name: rig for name, rig in rigs.items() if rig}
    if not found:
        raise SettingsError(f"{path}: no cameras found", code="missing_value")
    return found


def per_camera_path(output: Path, name: str) -> Path:
    """The output path of a rig's camera: room.png becomes room_left.png."""
    return output.with_name(f"{output.stem}_{name.replace('/', '_')}{output.suffix}")


def save_all(frames: Mapping[str, Frame], output: Path, bits: int | None, half: bool | None) -> list[Path]:
    """Saves the frame of each camera to its `per_camera_path`; returns the paths."""
    paths = []
    for name, frame in frames.items():
        paths.append(per_camera_path(output, name))
        frame.save(paths[-1], bits=bits, half=half)
    return paths
