"""The command line: `raycam render`, `video`, `explain`, `info`, `doctor`, `demo`.

Starting up is part of every picture's time: modules that only one command needs are imported by that command.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from .errors import Error, SettingsError, nearest

if TYPE_CHECKING:
    from .camera import Camera
    from .world import World

__all__ = ["main"]

STOPPED = 130  # what a shell reports of a command that Ctrl-C ended


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit status: 0, 1 for an error, 2 for a wrong command line."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    try:
        parser = _parser()
        if words and not words[0].startswith("-") and words[0] not in COMMANDS:
            parser.error(nearest("command", words[0], list(COMMANDS)))
        options = parser.parse_args(words)
        options.run(options)
        sys.stdout.flush()
        return 0
    except KeyboardInterrupt:
        print("raycam: stopped", file=sys.stderr)
        return STOPPED
    except BrokenPipeError:
        # Whoever read the output has seen enough; Python would complain once more on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Error, ValueError, OSError, MemoryError) as error:
        print(f"raycam: error: {_message(error)}", file=sys.stderr)
        return 2 if isinstance(error, SettingsError) else 1


def _message(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return f"out of memory {error}".rstrip()
    return str(error)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """Exits with status 2."""
        self.exit(2, f"raycam: error: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    from ._core import __version__

    parser = _Parser(
        prog="raycam",
        description="Virtual worlds made of triangles, seen through any camera matrix.",
        epilog="Begin with `raycam demo DIR`: a world, pictures and a video. `raycam COMMAND --help` shows more.",
    )
    parser.add_argument("--version", action="version", version=f"raycam {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, dest="command", parser_class=_Parser)
    for name, (add, help_text, examples) in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=help_text,
            description=f"{help_text[0].upper()}{help_text[1:]}.",
            epilog="examples:\n" + "\n".join(f"  {example}" for example in examples),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        add(command)
    return parser


# Options that several commands have ---------------------------------------------------------------------------


def _add_world(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "world", metavar="WORLD", help="a world file (.toml) or a mesh (.obj .ply .stl .off)"
    )


def _add_camera(command: argparse.ArgumentParser) -> None:
    command.add_argument("--camera", metavar="NAME", help="a camera of the world; its first one otherwise")
    command.add_argument(
        "--size", metavar="WxH", type=_size, help="the picture's size in pixels; the view stays the camera's"
    )


def _add_rendering(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group(
        "rendering", "what is not given is what [render] of the world file says"
    )
    group.add_argument(
        "--integrator",
        metavar="NAME",
        help="direct: lit, with shadows (default); flat: plain colours; reference: flat by the lecture, slow",
    )
    group.add_argument("--samples", metavar="N", type=int, help="rays per pixel (default 16)")
    group.add_argument("--filter", metavar="NAME", help="box (default) or blackman-harris")
    group.add_argument("--seed", metavar="N", type=int, help="the seed of all random numbers (default 0)")
    group.add_argument(
        "--threads", metavar="N", type=int, help="threads (default: all); never changes the picture"
    )
    group.add_argument(
        "--ambient-occlusion",
        metavar="METRES",
        type=float,
        nargs="?",
        const=True,
        help="darken the sky in corners: by surfaces at any distance, or up to METRES",
    )
    group.add_argument(
        "--no-ambient-occlusion",
        dest="ambient_occlusion",
        action="store_const",
        const=False,
        help="an open sky, whatever the world file says",
    )
    group.add_argument(
        "--exposure", metavar="STOPS", type=float, help="brighten the picture; +1 doubles (default 0)"
    )


RENDERING = ("integrator", "samples", "filter", "seed", "threads", "ambient_occlusion", "exposure")


def _rendering(options: argparse.Namespace) -> dict[str, Any]:
    """What was given of the options of `_add_rendering`, as arguments of `raycam.render`."""
    return {name: value for name in RENDERING if (value := getattr(options, name)) is not None}


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, as in 640x480") from None


def _numbers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,WIDTH,HEIGHT, as in 0,0,320,240") from None


def _view(world: World, options: argparse.Namespace) -> Camera:
    """The camera that `--camera` and `--size` ask for."""
    if options.camera is None and not world.cameras:
        return world.default_camera(options.size or (640, 480))
    camera = world.camera(options.camera) if options.camera is not None else world.default_camera()
    if options.size is None:
        return camera
    (width, height), (new_width, new_height) = camera.size, options.size
    if width * new_height != 0 and abs(new_width * height / (width * new_height) - 1.0) > 0.01:
        raise SettingsError(
            f"--size {new_width}x{new_height} would stretch the picture of the camera, which has {width} x {height}"
        )
    return camera.resized(options.size)


def _load(options: argparse.Namespace) -> World:
    from .world import load

    world = load(options.world)
    _notices(world.notices)
    return world


def _notices(notices: Sequence[str]) -> None:
    for notice in notices:
        print(f"raycam: {notice}", file=sys.stderr)


# The commands -------------------------------------------------------------------------------------------------


def _add_render(command: argparse.ArgumentParser) -> None:
    _add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=".png, .exr or .npz (default: the world's name with .png, here)",
    )
    _add_camera(command)
    command.add_argument(
        "--channels",
        metavar="NAME",
        nargs="+",
        help="what the file holds: color depth distance position normal instance triangle barycentric coverage, or "
        "all (default: color; for .exr and .npz color depth instance triangle)",
    )
    command.add_argument("--region", metavar="X,Y,W,H", type=_numbers, help="render a part of the picture")
    command.add_argument("--bits", type=int, metavar="N", help="8 (default) or 16 bits per channel, for .png")
    command.add_argument(
        "--half", action="store_true", default=None, help="float16 instead of float32, for .exr"
    )
    _add_rendering(command)
    command.set_defaults(run=_render)


def _render(options: argparse.Namespace) -> None:
    from .frame import check_save
    from .progress import bar
    from .render import DEFAULT_CHANNELS, channel_names, render

    output = Path(options.output or Path(options.world).with_suffix(".png").name)
    names: Sequence[str] = ("color",) if output.suffix.lower() == ".png" else DEFAULT_CHANNELS
    if options.channels is not None:
        words = [name for part in options.channels for name in part.split(",") if name]
        names = channel_names("all" if words == ["all"] else words)
    check_save(output, names, (1, 1), bits=options.bits, half=options.half)
    world = _load(options)
    camera = _view(world, options)
    if options.output is None and output.exists() and output.name in world.textures:
        raise SettingsError(f"{output} is a texture of this world: choose another name with -o")
    check_save(output, names, camera.size)
    settings = _rendering(options)
    with bar("rendering") as progress:
        frame = render(world, camera, channels=names, region=options.region, progress=progress, **settings)
    _notices(frame.notices)
    frame.save(output, bits=options.bits, half=options.half)
    _, _, width, height = frame.region
    print(f"{output}: {width} x {height}, {', '.join(frame.channels)}")


def _add_video(command: argparse.ArgumentParser) -> None:
    _add_world(command)
    command.add_argument(
        "-o", "--output", metavar="FILE", required=True, help=".mp4, .gif, or a folder for PNG pictures"
    )
    _add_camera(command)
    command.add_argument(
        "--frames", metavar="A:B", help="only frames A up to but not B, from 0, as in 0:24 or 24:"
    )
    command.add_argument(
        "--fps", metavar="N", type=float, help="frames per second (default: the world's, or 24)"
    )
    command.add_argument("--seconds", metavar="N", type=float, help="play the same motion in N seconds")
    _add_rendering(command)
    command.set_defaults(run=_video)


def _video(options: argparse.Namespace) -> None:
    from .progress import bar
    from .video import frame_range, write_video

    frames = None if options.frames is None else frame_range(options.frames)
    world = _load(options)
    with bar("rendering frames") as progress:
        film = write_video(
            world,
            options.output,
            camera=_view(world, options),
            frames=frames,
            fps=options.fps,
            seconds=options.seconds,
            progress=progress,
            **_rendering(options),
        )
    _notices(film.notices)
    width, height = film.camera.size
    count = len(range(len(film))[slice(*frames)]) if frames else len(film)
    print(f"{options.output}: {count} frames of {width} x {height}, {film.fps:g} a second")


def _add_explain(command: argparse.ArgumentParser) -> None:
    _add_world(command)
    command.add_argument(
        "--pixel",
        metavar=("U", "V"),
        nargs=2,
        type=int,
        required=True,
        help="column and row, from 0 at the top left",
    )
    command.add_argument("--figure", metavar="FILE.svg", help="draw the explanation too")
    _add_camera(command)
    command.set_defaults(run=_explain)


def _explain(options: argparse.Namespace) -> None:
    from .explain_pixel import check_figure, explain

    if options.figure is not None:
        check_figure(options.figure)
    world = _load(options)
    explanation = explain(world, _view(world, options), options.pixel)
    print(explanation)
    if options.figure is not None:
        explanation.save_figure(options.figure)
        print(f"\n{options.figure}: the figure")


def _add_info(command: argparse.ArgumentParser) -> None:
    _add_world(command)
    command.set_defaults(run=_info)


def _info(options: argparse.Namespace) -> None:
    from .info import info
    from .world import load

    print(info(load(options.world)))


def _add_doctor(command: argparse.ArgumentParser) -> None:
    command.set_defaults(run=_doctor)


def _doctor(options: argparse.Namespace) -> None:
    from .doctor import doctor

    print(doctor())


def _add_demo(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "folder", metavar="DIR", nargs="?", default="raycam-demo", help="made if it is not there"
    )
    command.set_defaults(run=_demo)


def _demo(options: argparse.Namespace) -> None:
    from .demo import demo

    demo(Path(options.folder))


# Name: how its options are added, what it does, examples.
COMMANDS = {
    "render": (
        _add_render,
        "make a picture of a world",
        [
            "raycam render room.toml                                   a lit picture, room.png",
            "raycam render room.toml -o room.exr --channels all         with all ground truth",
            "raycam render bunny.ply -o bunny.png --size 1920x1080      a bare mesh, framed and lit",
            "raycam render room.toml --integrator flat --samples 1      the lecture's picture",
        ],
    ),
    "video": (
        _add_video,
        "make a video of a world as its [video] says",
        [
            "raycam video room.toml -o room.mp4",
            "raycam video room.toml -o room.gif --frames 0:24 --size 320x240",
        ],
    ),
    "explain": (
        _add_explain,
        "show every step that finds the colour of one pixel",
        [
            "raycam explain room.toml --pixel 320 240",
            "raycam explain room.toml --pixel 320 240 --figure explain.svg",
        ],
    ),
    "info": (_add_info, "show what a world holds: counts, bounds, cameras", ["raycam info room.toml"]),
    "doctor": (_add_doctor, "show versions, processor and threads, and test a picture", ["raycam doctor"]),
    "demo": (_add_demo, "make a world, pictures of it and a video", ["raycam demo demo"]),
}
