"""The type of commands, and options of worlds, cameras and rendering that several commands share."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from ..errors import Notice, SettingsError
from .options.framing import add_preset, is_framed, preset, reject_look

if TYPE_CHECKING:
    from ..calibration import Cameras
    from ..camera import Camera
    from ..world import World


TOLD: set[str] = set()
"""The notices that this command has printed."""
LOUDNESS = {"quiet": False, "verbose": False}
"""The options `--quiet` and `--verbose` of this command."""


def add_loudness(command: argparse.ArgumentParser) -> None:
    """Adds `--quiet` and `--verbose`."""
    group = command.add_argument_group("messages")
    which = group.add_mutually_exclusive_group()
    which.add_argument("--quiet", action="store_true", help="print errors and asked for results alone")
    which.add_argument(
        "--verbose", action="store_true", help="print the settings and times, and a traceback after an error"
    )


def set_loudness(quiet: bool, verbose: bool) -> None:
    """Sets how much this command prints."""
    from .. import progress

    LOUDNESS.update(quiet=quiet, verbose=verbose)
    progress.SHOWN = not quiet


def print_result(text: str) -> None:
    """Prints the line that names a written file, unless `--quiet` is given."""
    if not LOUDNESS["quiet"]:
        print(text)


def print_detail(text: str) -> None:
    """Prints a line on stderr if `--verbose` is given."""
    if LOUDNESS["verbose"]:
        print(f"raycam: {text}", file=sys.stderr, flush=True)


class Command(NamedTuple):
    """One command: a row of `COMMANDS`."""

    add: Callable[[argparse.ArgumentParser], None]
    """Adds the command's options, and its function as the default of `run`."""
    help: str
    """One line of help."""
    examples: Sequence[str]
    """Example command lines, with their results."""


def add_world(command: argparse.ArgumentParser) -> None:
    """Adds the world, the first argument, `--variant`, `--folder` and `--texture-memory`."""
    command.add_argument(
        "world", metavar="WORLD", help="a world file (.toml), or .gltf .glb .obj .ply .stl .off .usd"
    )
    command.add_argument("--variant", metavar="NAME", help="a material variant of a glTF file")
    add_folder(command)
    command.add_argument(
        "--texture-memory",
        metavar="SIZE",
        help="memory for textures, as 512MiB; the others wait in a temporary file (default: no limit)",
    )


def add_folder(command: argparse.ArgumentParser) -> None:
    """Adds `--folder`."""
    command.add_argument(
        "--folder",
        metavar="FOLDER",
        help="where the files that the world names may lie (default: the folder of the world)",
    )


def add_camera(command: argparse.ArgumentParser) -> None:
    """Adds the camera and its picture size."""
    command.add_argument(
        "--camera",
        metavar="NAME|FILE[:NAME]",
        help="a camera of the world, or of the file of a calibration or another world; the first one otherwise",
    )
    command.add_argument(
        "--size",
        metavar="WxH",
        type=size_of,
        help="the picture's size in pixels; the view stays the camera's",
    )
    add_lens(command)


def add_known(command: argparse.ArgumentParser) -> None:
    """Adds the values that a calibration file may lack: format, size, intrinsics."""
    command.add_argument(
        "--format",
        dest="camera_format",
        metavar="FORMAT",
        help="of the calibration (default: found by its contents)",
    )
    command.add_argument(
        "--size",
        metavar="WxH",
        type=size_of,
        help="the picture's size: where FILE has another one, cameras are resized",
    )
    command.add_argument(
        "--intrinsics", metavar="FILE", help="a calibration whose first camera the poses of FILE get"
    )
    add_convention(command)
    add_lens(command)


def add_convention(command: argparse.ArgumentParser) -> None:
    """Adds the direction and the axes of poses whose file states neither."""
    command.add_argument(
        "--direction",
        metavar="NAME",
        help="of matrices whose file does not state it: world_from_camera (default) or camera_from_world",
    )
    command.add_argument(
        "--axes",
        metavar="NAME",
        help="of the camera in matrices whose file does not state them: opencv (default) or opengl",
    )


def add_lens(command: argparse.ArgumentParser) -> None:
    """Adds `--lens`."""
    command.add_argument(
        "--lens",
        metavar="MODEL",
        help="the lens model of the calibration's coefficients, where it does not say it: opencv, fisheye, ...",
    )


def load_calibration(path: str, options: argparse.Namespace) -> Cameras:
    """Loads the cameras of a file with the options of `add_known`, and prints the notices."""
    from ..calibration import load_cameras

    size, intrinsics = getattr(options, "size", None), None
    format, lens = getattr(options, "camera_format", None), getattr(options, "lens", None)
    if getattr(options, "intrinsics", None) is not None:
        intrinsics = next(iter(load_cameras(options.intrinsics, size=size, model=lens).values()))
        lens = None
    direction, axes = getattr(options, "direction", None), getattr(options, "axes", None)
    cameras = load_cameras(
        path, format, size=size, intrinsics=intrinsics, model=lens, direction=direction, axes=axes
    )
    print_notices(cameras.notices)
    return cameras


class Renamed(argparse.Action):
    """Stores the value of an option whose last name is an old one, understood until 0.2 with a notice."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Stores the value, and prints a notice for the old name."""
        if option_string == self.option_strings[-1]:
            print_notices([f"{option_string} is called {self.option_strings[0]} now; understood until 0.2"])
        setattr(namespace, self.dest, self.const if self.nargs == 0 else values)


def options_of(command: argparse.ArgumentParser) -> list[str]:
    """The options of a command, as they are typed."""
    return [option for action in command._actions for option in action.option_strings]


def add_rendering(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `raycam.render`."""
    group = command.add_argument_group("quality", "what is not given is what [render] of the world file says")
    add_preset(group)
    group.add_argument(
        "--integrator",
        metavar="NAME",
        help="direct: lit, with shadows (default); path: all light (default in the studio and with --hdri); "
        "ao: open sky; flat: plain colours; reference: flat by the lecture, slow",
    )
    group.add_argument(
        "--samples", metavar="N", type=int, help="rays per pixel (default 16; studio 8; --hdri 32)"
    )
    group.add_argument(
        "--noise-threshold",
        "--noise",
        action=Renamed,
        metavar="ERROR",
        type=float,
        help="sample each pixel until its standard error is this",
    )
    group.add_argument(
        "--time-limit",
        "--time",
        action=Renamed,
        metavar="SECONDS",
        type=seconds,
        help="sample for this long: 30, 30s or 5m",
    )
    group.add_argument(
        "--max-depth", metavar="N", type=int, help="segments of a path at most (default: no limit)"
    )
    group.add_argument(
        "--clamp", metavar="RADIANCE", type=float, help="the largest value of a sample (default: none)"
    )
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
    group.add_argument(
        "--denoise",
        action="store_true",
        default=None,
        help="guess the picture without its noise; needs raycam[denoise]",
    )
    group.add_argument(
        "--transparent-background",
        "--transparent",
        action=Renamed,
        nargs=0,
        const=True,
        help="leave the sky out: pictures and videos with an opacity, to be laid over others",
    )
    group.add_argument(
        "--view",
        metavar="NAME",
        help="what is brighter than white: standard (cut off, default), agx, pbr_neutral (default in the studio "
        "and with --hdri)",
    )


RENDERING = (
    "integrator",
    "samples",
    "noise_threshold",
    "time_limit",
    "max_depth",
    "clamp",
    "filter",
    "seed",
    "threads",
    "ambient_occlusion",
    "exposure",
    "view",
    "denoise",
    "transparent_background",
)


def rendering(options: argparse.Namespace) -> dict[str, Any]:
    """The given options of `add_rendering`, and those of `--preset`, as arguments of `raycam.render`."""
    return preset(options) | {
        name: value for name in RENDERING if (value := getattr(options, name)) is not None
    }


def size_of(text: str) -> tuple[int, int]:
    """Parses "640x480" as (width, height), and "640,480" as well."""
    width, _, height = text.lower().replace(",", "x").partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, as in 640x480") from None


def seconds(text: str) -> float:
    """Parses "30", "30s", "5m" or "1h" as seconds."""
    unit = {"s": 1.0, "m": 60.0, "h": 3600.0}
    try:
        return float(text[:-1]) * unit[text[-1]] if text[-1:] in unit else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time, as in 30s or 5m") from None


def numbers(text: str) -> tuple[int, ...]:
    """Parses "0,0,320,240" as whole numbers."""
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,WIDTH,HEIGHT, as in 0,0,320,240") from None


def named_camera(text: str, options: argparse.Namespace) -> Camera:
    """The camera of "FILE" (its first one) or "FILE:NAME", where FILE is a calibration or a world file."""
    from ..world.load import load

    found = calibration_file(text)
    if found is None:
        from ..world.missing_files import nearest_names

        expected = "expected a calibration or a world file"
        raise FileNotFoundError(f"{text}: there is no such file; {expected}{nearest_names(text)}")
    file, name = found
    if os.path.isfile(file) and file.endswith((".toml", ".glb", ".gltf")):
        world = load(file)
        return world.camera(name) if name else world.default_camera()
    cameras = load_calibration(file, options)
    return cameras.find(name) if name else next(iter(cameras.values()))


def view(world: World, options: argparse.Namespace, *, moving: bool = False) -> Camera:
    """The camera of `--camera` and `--size`, at the place of `--view-from` and `--zoom`.

    If the world is shown `moving`, all of its motion fits.
    """
    from ..render.arguments import UNPOSED, is_unposed_within
    from ..world.framing import framing_camera, moments_of

    if is_framed(world, options):
        moments = moments_of(world, animation_of(world, options)) if moving else []
        return framing_camera(world, **_framing(world, options), moments=moments)
    camera = _given_camera(world, options)
    if options.camera is not None and is_unposed_within(world, camera):
        print_notice(f"{UNPOSED}; --view-from SIDE puts it where the world fits")
    return camera


def animation_of(world: World, options: argparse.Namespace) -> str | int | None:
    """The animation of `--animation`: a name, or a number where no animation has it as its name."""
    given: str | None = options.animation
    if given is None or not given.isdecimal() or given in (each.name for each in world.animations):
        return given
    return int(given)


def _given_camera(world: World, options: argparse.Namespace) -> Camera:
    """The camera of `--camera` and `--size`, where it stands."""
    if options.camera is not None:
        reject_look(options, ("fov",), "the field of view is that of --camera")
    if options.camera is None:
        camera = world.default_camera()
    elif options.camera not in world.cameras and calibration_file(options.camera) is not None:
        camera = named_camera(options.camera, options)
    elif options.camera not in world.cameras and (
        os.sep in options.camera or os.path.splitext(options.camera)[1]
    ):
        from ..world.missing_files import nearest_names

        close = nearest_names(options.camera)
        raise SettingsError(
            f"--camera {options.camera}: there is no such file, and no camera of this name{close}"
        )
    else:
        camera = world.camera(options.camera)
    if options.size is None:
        return camera
    (width, height), (new_width, new_height) = camera.size, options.size
    if width * new_height != 0 and abs(new_width * height / (width * new_height) - 1.0) > 0.01:
        raise SettingsError(
            f"--size {new_width}x{new_height} would stretch the picture of the camera, which has {width} x {height}"
        )
    return camera.resized(options.size)


def turning_view(world: World, options: argparse.Namespace) -> Camera:
    """The camera that frames a world that turns around the upright axis through its middle."""
    from ..world.framing import framing_camera

    return framing_camera(world, **_framing(world, options), turning=True)


def _framing(world: World, options: argparse.Namespace) -> dict[str, Any]:
    """The options of looks as arguments of `World.view_from`."""
    given = {name: getattr(options, name, None) for name in ("fov", "zoom")}
    if getattr(options, "camera", None) is not None:
        given["camera"] = _given_camera(world, options)
    return {
        "size": options.size or (640, 480),
        "direction": getattr(options, "view_from", None) or "default",
        **{name: value for name, value in given.items() if value is not None},
    }


def calibration_file(text: str) -> tuple[str, str] | None:
    """Splits FILE or FILE:NAME into file and name; None if there is no such file."""
    from ..data import bundled

    file, _, name = text.rpartition(":")
    pairs = [(text, ""), (file, name)]
    for given, camera in pairs:
        path = bundled(given)
        if path is not None:
            print_notice(f"{given}: there is no such file here, so the one that comes with raycam is meant")
            return os.fspath(path), camera
    return next((pair for pair in pairs if pair[0] and os.path.exists(pair[0])), None)


def load_world(options: argparse.Namespace) -> World:
    """Loads the world and prints its notices."""
    from ..data import bundled
    from ..world.load import load

    path = bundled(options.world) or options.world
    if path != options.world:
        print_notice(
            f"{options.world}: there is no such file here, so the one that comes with raycam is meant"
        )
    folder = getattr(options, "folder", None)
    up = getattr(options, "up", None) or guessed_up(path)
    variant = getattr(options, "variant", None)
    world = load(path, variant=variant, texture_memory=options.texture_memory, folder=folder, up=up)
    if up is not None and getattr(options, "up", None) is None:
        print_notice("taken as y up, as most OBJ files are; --up z if it lies on its side")
    print_notices(world.notices)
    print_detail(f"{world!r}, bounds {[] if world.bounds is None else world.bounds.round(6).tolist()}")
    return world


def guessed_up(path: str | os.PathLike[str]) -> Literal["y"] | None:
    """The up axis of a mesh whose file does not state it: y for OBJ; None for all others, which `load` knows."""
    return "y" if os.fspath(path).lower().endswith(".obj") else None


def print_notices(notices: Iterable[Notice | str]) -> None:
    """Prints notices on stderr, one per line."""
    for notice in notices:
        print_notice(notice)


def print_notice(notice: Notice | str) -> None:
    """Prints a notice on stderr at once, unless this command has printed it before."""
    if str(notice) not in TOLD:
        TOLD.add(str(notice))
        if LOUDNESS["quiet"]:
            return
        print(f"raycam: notice: {notice}", file=sys.stderr, flush=True)
