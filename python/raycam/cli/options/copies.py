"""Options that derive cameras, and the maps of the derived cameras.

Derived cameras are cropped, undistorted, without lens, or rectified.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from ...calibration import Cameras
from ...errors import SettingsError
from .command import parse_region

if TYPE_CHECKING:
    from ...camera import Camera
    from ...rig import Rig

    Found = Mapping[str, Camera | Rig]

__all__ = ["add_copies", "derive_cameras", "has_copies"]


def add_copies(command: argparse.ArgumentParser) -> None:
    """Adds `--crop`, `--undistort`, `--pinhole`, `--rectify` and `--maps`."""
    command.add_argument(
        "--crop",
        metavar="X,Y,WIDTH,HEIGHT",
        type=parse_region,
        help="crop the images to this part; --size is applied first",
    )
    either = command.add_mutually_exclusive_group()
    either.add_argument(
        "--undistort",
        metavar="BALANCE",
        nargs="?",
        type=float,
        const=0.0,
        help="undistort the images, after --crop: return pinhole cameras whose images have no black border "
        "(0, default) or show all pixels (1)",
    )
    either.add_argument(
        "--pinhole",
        action="store_true",
        help="remove the distortion and keep K; --crop is applied first",
    )
    either.add_argument(
        "--rectify",
        action="store_true",
        help="rectify a pair of cameras (left camera first); --crop is applied before the rectification",
    )
    command.add_argument(
        "--maps",
        metavar="NPZ",
        help="with --undistort, --pinhole or --rectify: write the maps of cv2.remap, [h, w, 2] float32 per camera",
    )


def _makes_pinholes(options: argparse.Namespace) -> bool:
    return options.undistort is not None or options.pinhole or options.rectify


def has_copies(options: argparse.Namespace) -> bool:
    """Returns True if the options derive new cameras from the file's cameras."""
    return options.crop is not None or _makes_pinholes(options)


def derive_cameras(cameras: Found, options: argparse.Namespace) -> Found:
    """Returns the cropped, undistorted or rectified copies of cameras that the options request.

    Without such options, returns the cameras unchanged. For a file with a single rig, returns the rig of the copies.
    """
    from ...rig import Rig

    if options.maps is not None and not _makes_pinholes(options):
        raise SettingsError("--maps requires --undistort, --pinhole or --rectify", code="missing_value")
    if not has_copies(options):
        return cameras
    if options.crop is not None and len(options.crop) != 4:
        raise SettingsError(
            f"--crop: expected X,Y,WIDTH,HEIGHT, as in 0,0,320,240, got {len(options.crop)} numbers",
            code="invalid_value",
        )
    maps: dict[str, object] = {}
    if options.rectify:
        made: Found = _rectified(_flat(cameras), options, maps)
        _save_maps(options.maps, maps)
        return made

    def edited(name: str, camera: Camera) -> Camera:
        source = _cropped(camera, options)
        if not _makes_pinholes(options):
            return source
        pinhole = source.pinhole() if options.pinhole else source.undistorted(options.undistort)
        if options.maps is not None:
            maps[name] = pinhole.pixel_map(source)
        return pinhole

    found: dict[str, Camera | Rig] = {}
    for name, item in cameras.items():
        found[name] = (
            _each(item, lambda own, camera, name=name: edited(f"{name}/{own}", camera))  # type: ignore[misc]
            if isinstance(item, Rig)
            else edited(name, item)
        )
    _save_maps(options.maps, maps)
    rigs = cameras.rigs if isinstance(cameras, Cameras) else {}
    if len(rigs) == 1 and len(rig := next(iter(rigs.values()))) == len(found):
        return _each(rig, lambda name, mount: _at(found[name], mount))
    return found


def _cropped(camera: Camera, options: argparse.Namespace) -> Camera:
    return camera if options.crop is None else camera.cropped(*options.crop)


def _each(rig: Rig, edit: Callable[[str, Camera], Camera]) -> Rig:
    """Returns the rig with a new camera at each of its mounts."""
    from ...rig import Rig

    mounts = {name: edit(name, camera) for name, camera in rig.mounts.items()}
    return Rig(mounts, rig.R, rig.C, name=rig.name, up=rig.up)


def _flat(cameras: Found) -> dict[str, Camera]:
    """All cameras, including the cameras of rigs."""
    from ...rig import Rig

    found: dict[str, Camera] = {}
    for name, item in cameras.items():
        found |= dict(item.items()) if isinstance(item, Rig) else {name: item}
    return found


def _rectified(cameras: dict[str, Camera], options: argparse.Namespace, maps: dict[str, object]) -> Rig:
    """Returns the rectified pair of two cameras; with `--maps`, adds their pixel maps to `maps`."""
    from ...rig import Rig

    if len(cameras) != 2:
        listed = ", ".join(list(cameras)[:5]) + (", ..." if len(cameras) > 5 else "")
        raise SettingsError(
            f"--rectify requires two cameras, the left one first; found {len(cameras)}: {listed}",
            code="missing_value",
        )
    given = {name: _cropped(camera, options) for name, camera in cameras.items()}
    pair = Rig.of(given).rectified()
    for (name, camera), source in zip(pair.items(), given.values(), strict=True):
        if options.maps is not None:
            maps[name] = camera.pixel_map(source)
    return pair


def _save_maps(path: str | None, maps: dict[str, object]) -> None:
    if maps and path is not None:
        import numpy as np

        with open(path, "wb") as file:
            np.savez_compressed(file, **maps)  # type: ignore[arg-type]
        print(f"{path}: {len(maps)} {'map' if len(maps) == 1 else 'maps'} of cv2.remap")


def _at(camera: Camera | Rig, mount: Camera) -> Camera:
    """A camera at the pose of a mount."""
    from ...camera import Camera

    assert isinstance(camera, Camera)
    return camera.at_pose(mount.R, mount.location)
