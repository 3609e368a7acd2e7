"""The command `raycam scan`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import SettingsError
from .options.command import Command
from .options.lidars import add_lidar_pose, chosen_lidar
from .options.messages import print_notices
from .options.worlds import add_world, load_world, parse_animation


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "--lidar",
        metavar="NAME|FILE",
        help="lidar of the world file, device by name (raycam lidars lists them), or the calibration file of an "
        "individual device (default: the world file's lidar)",
    )
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="output: .pcd .ply .npz .csv .las .laz .feather .pcap or KITTI's .bin (default: the world's name with "
        ".pcd)",
    )
    command.add_argument(
        "--fields",
        metavar="NAME",
        nargs="+",
        help="fields to write in addition to the position, such as intensity ring time instance",
    )
    add_lidar_pose(command)
    settings = command.add_argument_group("lidar settings")
    settings.add_argument(
        "--rate", metavar="HZ", type=float, help="frames per second (default: the device's)"
    )
    settings.add_argument(
        "--force-rate",
        action="store_const",
        const=True,
        help="accept a rate that the device does not support",
    )
    settings.add_argument(
        "--returns",
        metavar="MODE",
        help="echoes to report: first, last, strongest, dual (last and strongest) or all (default: the device's)",
    )
    settings.add_argument(
        "--beam-samples", metavar="N", type=int, help="rays per pulse: 1 (default), 7, 19 or 37"
    )
    settings.add_argument(
        "--no-noise", dest="noise", action="store_const", const=False, help="omit noise and rounding"
    )
    settings.add_argument("--seed", metavar="N", type=int, help="seed of the noise (default: 0)")
    command.add_argument(
        "--frame",
        metavar="N",
        type=int,
        default=0,
        help="number of the frame (default: 0), which selects the random numbers and the part of a scan pattern that "
        "does not repeat; use --at for the time",
    )
    command.add_argument(
        "--in-world", action="store_true", help="write points in world coordinates instead of the sensor's"
    )
    command.add_argument("--text", action="store_true", help="write a .pcd file as text")
    command.add_argument("--compress", action="store_true", help="write a compressed .pcd file")
    command.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="time of the world's video or animation, in seconds (default: no motion)",
    )
    command.add_argument("--animation", metavar="NAME", help="animation of a glTF file (default: the first)")
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..lidar import scan
    from ..lidar.files.save import check_extension
    from ..notices import collected

    output = options.output or f"{Path(options.world).stem}.pcd"
    check_extension(Path(output).suffix)
    if options.animation is not None and options.at is None:
        raise SettingsError("--animation requires --at SECONDS", code="missing_value")
    names = ("rate", "force_rate", "returns", "beam_samples", "noise", "seed")
    given: dict[str, Any] = {name: getattr(options, name) for name in names}
    settings = {name: value for name, value in given.items() if value is not None}
    world = load_world(options)
    if options.at is not None:
        world = world.at(options.at, parse_animation(world, options.animation))
    lidar = chosen_lidar(world, options, settings)
    with collected() as notices:
        result = scan(world, lidar, frame=options.frame, threads=options.threads)
    print_notices(notices)
    result.save(
        output, fields=options.fields, in_world=options.in_world, text=options.text, compress=options.compress
    )
    print(f"{output}: {result.count} points of {len(result.pattern)} pulses, {lidar.title}")


COMMAND = Command(
    _add,
    "scan a world with a lidar and write the points",
    [
        "raycam scan drive.toml --at 2.0 -o scan.pcd",
        "raycam scan spot.glb --lidar vlp16 --location -2 0 0.5 -o spot.pcd",
        "raycam scan drive.toml --lidar os1-128.json --at 2.0 --location 0 0 1.8 --yaw 90 -o scan.las",
        "raycam scan drive.toml --lidar vlp16 -o scan.pcd --fields intensity ring time instance",
    ],
)
