"""The command `raycam selfcheck`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from .options.cameras import add_known, load_camera
from .options.command import Command

if TYPE_CHECKING:
    from ..render.frame import Frame


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--camera",
        metavar="FILE[:NAME]",
        help="camera to check, from a calibration or a world file (default: an example camera, 1920 x 1080, with "
        "lens model opencv)",
    )
    add_known(command)
    command.add_argument(
        "--views", metavar="N", type=int, default=20, help="number of board images (default: 20)"
    )
    command.add_argument(
        "--board", metavar="KIND", default="charuco", help="board: charuco (default) or checkerboard"
    )
    command.add_argument(
        "--samples", metavar="N", type=int, default=64, help="samples per pixel (default: 64)"
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help="save the board images in this folder, for other calibration tools",
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

    camera = None if options.camera is None else load_camera(options.camera, options)
    with bar("rendering the board") as progress:
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
    "render a calibration board, calibrate with OpenCV, and compare the result with the camera",
    [
        "raycam selfcheck",
        "raycam selfcheck --camera camchain.yaml:cam1 --views 40",
        "raycam selfcheck --camera calibration.yaml --size 960x540 -o boards",
    ],
)
