"""The command `raycam cameras`."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration import WRITTEN_FORMATS, Cameras, save_cameras
from ._options import Command, add_known, calibration_file, numbers, print_notices
from .options.rigs import cameras_in

if TYPE_CHECKING:
    from ..camera import Camera
    from ..rig import Rig

ENDINGS = {
    "opencv": ".yaml",
    "ros": ".yaml",
    "kalibr": ".yaml",
    "orb-slam": ".yaml",
    "camodocal": ".yaml",
    "kitti": ".txt",
    "kitti-poses": ".txt",
    "tum": ".txt",
    "tum-intrinsics": ".txt",
    "poses": ".txt",
    "euroc": ".csv",
}
FOLDERS = ("colmap", "colmap-binary", "blender-splits")


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "file",
        metavar="FILE[:NAME]",
        help="a calibration, trajectory, world file or folder; one camera of it",
    )
    command.add_argument(
        "--to",
        metavar="FORMAT",
        help=f"the format to write: {', '.join(WRITTEN_FORMATS)} (default: show what there is)",
    )
    command.add_argument(
        "-o", "--output", metavar="OUT", help="(default: the name of FILE and the format, here)"
    )
    add_known(command)
    command.add_argument(
        "--crop",
        metavar="X,Y,WIDTH,HEIGHT",
        type=numbers,
        help="the cameras of a part of their pictures, after --size",
    )
    command.add_argument(
        "--undistort",
        metavar="BALANCE",
        nargs="?",
        type=float,
        const=0.0,
        help="the pinholes of the undistorted pictures, after --crop: 0 (default) shows no border, 1 all pixels",
    )
    command.add_argument(
        "--maps",
        metavar="NPZ",
        help="with --undistort: write the tables of cv2.remap, [h, w, 2] float32 by camera",
    )
    command.add_argument(
        "--time-offset",
        metavar="SECONDS",
        help="subtract this from the times; first: the time of the first camera",
    )
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..camera import Camera
    from ..errors import CameraError, SettingsError, nearest
    from ..info import info_cameras
    from ..rig import Rig

    if options.to is not None and options.to not in WRITTEN_FORMATS:
        raise SettingsError(f"--to: {nearest('format', options.to, list(WRITTEN_FORMATS))}")
    file, name = calibration_file(options.file) or (options.file, "")
    cameras = cameras_in(file, options)
    images, times = {}, {}
    if isinstance(cameras, Cameras):
        images, times = cameras.images, _times(cameras.times, options.time_offset)
    elif options.time_offset is not None:
        raise SettingsError("--time-offset is of the times of a trajectory, and a world has none")
    if name:
        if name not in cameras:
            raise CameraError(nearest("camera", name, list(cameras)))
        cameras = {name: cameras[name]}
    cameras = _edited(cameras, options)
    if options.to is None:
        if options.output is not None:
            raise SettingsError("-o goes with --to, the format to write")
        single = {name: item for name, item in cameras.items() if isinstance(item, Camera)}
        print(info_cameras(single, {name: item for name, item in cameras.items() if isinstance(item, Rig)}))
        return
    ending = "" if options.to in FOLDERS else ENDINGS.get(options.to, ".json")
    output = Path(
        options.output or f"{Path(file).stem}{'_' if name else ''}{Path(name).name}_{options.to}{ending}"
    )
    if not (name or options.time_offset or _is_edited(options)):
        images, times = {}, {}  # the records have them
    print_notices(save_cameras(output, cameras, options.to, images=images, times=times))
    loaded = isinstance(cameras, Cameras)
    count = len(cameras) if loaded else sum(len(x) if isinstance(x, Rig) else 1 for x in cameras.values())
    print(f"{output}: {count} camera{'' if count == 1 else 's'}, {options.to}")


def _times(times: Mapping[str, float], offset: str | None) -> dict[str, float]:
    """The times less `--time-offset`."""
    from ..errors import SettingsError

    if offset is None:
        return dict(times)
    if not times:
        raise SettingsError("--time-offset is of the times of a trajectory, and there are none")
    try:
        start = min(times.values()) if offset == "first" else float(offset)
    except ValueError:
        raise SettingsError(f"--time-offset {offset}: expected seconds, or first") from None
    return {name: time - start for name, time in times.items()}


def _is_edited(options: argparse.Namespace) -> bool:
    return options.crop is not None or options.undistort is not None


def _edited(cameras: Mapping[str, Camera | Rig], options: argparse.Namespace) -> Mapping[str, Camera | Rig]:
    """The cameras with `--crop` and `--undistort`; those of a file with one rig as that rig."""
    from ..camera import Camera
    from ..errors import SettingsError
    from ..rig import Rig

    if options.maps is not None and options.undistort is None:
        raise SettingsError("--maps goes with --undistort, whose tables it writes")
    if not _is_edited(options):
        return cameras
    if options.crop is not None and len(options.crop) != 4:
        raise SettingsError("--crop expects X,Y,WIDTH,HEIGHT, as 0,0,320,240")
    maps: dict[str, object] = {}

    def edited(name: str, camera: Camera) -> Camera:
        if options.crop is not None:
            camera = camera.cropped(*options.crop)
        if options.undistort is None:
            return camera
        made = camera.undistorted(options.undistort)
        if options.maps is not None:
            maps[name] = made.pixel_map(camera)
        return made

    def of_rig(rig: Rig, edit: Callable[[str, Camera], Camera]) -> Rig:
        mounts = {name: edit(name, camera) for name, camera in rig.mounts.items()}
        return Rig(mounts, rig.R, rig.C, name=rig.name, up=rig.up)

    found: dict[str, Camera | Rig] = {}
    for name, item in cameras.items():
        found[name] = (
            edited(name, item)
            if isinstance(item, Camera)
            else of_rig(item, lambda own, camera, name=name: edited(f"{name}/{own}", camera))  # type: ignore[misc]
        )
    rigs = cameras.rigs if isinstance(cameras, Cameras) else {}
    if maps:
        import numpy as np

        np.savez_compressed(options.maps, **maps)  # type: ignore[arg-type]
        print(f"{options.maps}: {len(maps)} table{'' if len(maps) == 1 else 's'} of cv2.remap")
    if len(rigs) == 1 and len(rig := next(iter(rigs.values()))) == len(found):
        return of_rig(rig, lambda name, camera: _at(found[name], camera))
    return found


def _at(camera: Camera | Rig, mount: Camera) -> Camera:
    """A camera at the pose of a mount."""
    from ..camera import Camera

    assert isinstance(camera, Camera)
    return camera.at_pose(mount.R, mount.location)


COMMAND = Command(
    _add,
    "show cameras, and convert calibrations and poses between the formats of other tools",
    [
        "raycam cameras camchain.yaml",
        "raycam cameras room.toml --to colmap -o model",
        "raycam cameras camchain.yaml --to opencv",
        "raycam cameras camchain.yaml:cam1 --to ros",
        "raycam cameras sparse/0 --to nerf -o transforms.json",
        "raycam cameras poses.txt --intrinsics calib.yaml --to colmap -o model",
        "raycam cameras calib.yaml --undistort 0 --maps maps.npz --to opencv -o undistorted.yaml",
    ],
)
