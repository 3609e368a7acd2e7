"""The command `raycam selfcheck`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ._options import Command, add_known, named_camera

if TYPE_CHECKING:
    from ..render.frame import Frame


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--camera",
        metavar="FILE[:NAME]",
        help="a calibration or a world file, and the camera in it (default: 1920 x 1080 with a lens)",
    )
    add_known(command)
    command.add_argument("--views", metavar="N", type=int, default=20, help="pictures of the board (20)")
    command.add_argument(
        "--board", metavar="KIND", default="charuco", help="charuco (default) or checkerboard"
    )
    command.add_argument("--samples", metavar="N", type=int, default=64, help="rays per pixel (64)")
    command.add_argument("--threads", metavar="N", type=int, help="threads (default: all)")
    command.add_argument(
        "-o", "--output", metavar="DIR", help="keep the pictures of the board, for other calibration tools"
    )
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..calibration_check import selfcheck
    from ..progress import bar

    folder = None if options.output is None else Path(options.output)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)

    def keep(number: int, frame: Frame) -> None:
        if folder is not None:
            frame.save(folder / f"{number:06d}.png")

    camera = None if options.camera is None else named_camera(options.camera, options)
    with bar("looking at the board") as progress:
        found = selfcheck(
            camera,
            views=options.views,
            size=options.size,
            board=options.board,
            samples=options.samples,
            threads=options.threads,
            progress=progress,
            keep=keep,
        )
    print(found)


COMMAND = Command(
    _add,
    "render a calibration board, calibrate with OpenCV, and compare with the camera",
    [
        "raycam selfcheck",
        "raycam selfcheck --camera camchain.yaml:cam1 --views 40",
        "raycam selfcheck --camera calibration.yaml --size 960x540 -o boards",
    ],
)
