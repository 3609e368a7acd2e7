"""The command `raycam depth`."""

from __future__ import annotations

import argparse

from .options.command import Command
from .options.jobs import add_job, job_options, parse_shard
from .options.messages import print_notices
from .options.photographs import add_photograph_cameras, photograph_cameras
from .options.worlds import add_world, load_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    add_photograph_cameras(command)
    command.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write to")
    command.add_argument(
        "--channels",
        metavar="NAME",
        nargs="+",
        default=["depth"],
        help="channels to write: depth (default), distance, normal, mask, instance, position, valid, confidence",
    )
    command.add_argument(
        "--layout",
        metavar="NAME",
        default="plain",
        help="folder layout: plain (default), scannetpp, mvsnet, colmap, blendedmvs",
    )
    command.add_argument(
        "--depth-format",
        metavar="NAME",
        default="png",
        help="file format of depth: png (default), exr or npy",
    )
    command.add_argument(
        "--depth-scale",
        metavar="MM",
        type=float,
        default=1.0,
        help="millimetres per unit of depth in PNG files (default: 1)",
    )
    command.add_argument(
        "--normal-bits",
        metavar="BITS",
        type=int,
        default=8,
        help="bits of normals in PNG files: 8 (default) or 16",
    )
    command.add_argument(
        "--normal-axes",
        metavar="NAME",
        default="opencv",
        help="camera axes of normals: opencv (default) or opengl",
    )
    command.add_argument(
        "--facing",
        metavar="SIDE",
        default="both",
        help="front: ignore the back sides of surfaces (default: both sides)",
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    add_job(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..photos import photo_truth
    from ..progress import frames_bar

    shard = parse_shard(options)
    world, cameras = load_world(options), photograph_cameras(options)
    with job_options(options), frames_bar("measuring depth") as progress:
        written = photo_truth(
            world,
            cameras,
            options.output,
            channels=options.channels,
            layout=options.layout,
            depth_format=options.depth_format,
            depth_scale=options.depth_scale,
            normal_bits=options.normal_bits,
            normal_axes=options.normal_axes,
            facing=options.facing,
            threads=options.threads,
            resume=options.resume,
            workers=options.cluster if options.cluster is not None else options.workers,
            shard=shard,
            retry_failed=options.retry_failed,
            progress=progress,
        )
    print_notices(written.notices)
    if written.complete:
        print(f"{options.output}: {written.frames} photographs, layout {options.layout}")
    else:
        print(
            f"shard {options.shard} is finished; {options.output}/error.json is written after the last shard"
        )


COMMAND = Command(
    _add,
    "write the depth, normals and masks of photographs of a mesh",
    [
        "raycam depth scan.ply --cameras sparse/0 -o truth                 depth/IMG_0001.png, ...",
        "raycam depth scan.ply --cameras sparse/0 -o truth --channels depth normal mask",
        "raycam depth scan.ply --cameras transforms.json --size 876x584 -o small",
        "raycam depth scan.ply --cameras sparse/0 --undistort -o dense --layout colmap",
    ],
)
