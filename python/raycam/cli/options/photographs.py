"""Options that select the cameras of photographs."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...errors import SettingsError
from .cameras import WORLD_ENDINGS, add_calibration, add_size, load_calibration

if TYPE_CHECKING:
    from ...camera import Camera

__all__ = ["add_photograph_cameras", "photograph_cameras"]


def add_photograph_cameras(
    command: argparse.ArgumentParser, undistort: bool = True, required: bool = True
) -> None:
    """Adds `--cameras`, `--size`, the options of `add_calibration`, and optionally `--undistort`."""
    command.add_argument(
        "--cameras",
        metavar="FILE",
        required=required,
        help="cameras of the photographs: COLMAP model, transforms.json, Metashape XML, world file, ...",
    )
    add_size(command, "size of the photographs in pixels, if they were resized")
    add_calibration(command)
    command.set_defaults(undistort=None)
    if undistort:
        command.add_argument(
            "--undistort",
            metavar="BALANCE",
            nargs="?",
            type=float,
            const=0.0,
            help="undistort the cameras to match undistorted photographs without black borders (0, default) or "
            "with all pixels (1)",
        )


def photograph_cameras(options: argparse.Namespace) -> Mapping[str, Camera]:
    """Returns the cameras by the names of their photographs.

    Raises `SettingsError` for a file without cameras.
    """
    from ...photos import named_photographs
    from ...world.load import load

    if str(options.cameras).endswith(WORLD_ENDINGS) and os.path.isfile(options.cameras):
        named = named_photographs(load(options.cameras).cameras)
    else:
        found = load_calibration(options.cameras, options)
        if not found:
            raise SettingsError(f"{options.cameras}: no cameras found", code="missing_value")
        named = named_photographs(found)
    if options.undistort is None:
        return named
    return {name: camera.undistorted(options.undistort) for name, camera in named.items()}
