"""The command `raycam render`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import SettingsError
from .options.cameras import add_camera, load_camera
from .options.command import Command, parse_region, parse_seconds
from .options.framing import find_camera, reject_options
from .options.jobs import add_job, job_pool, lower_priority, parse_shard
from .options.look import add_look, apply_look
from .options.messages import print_detail, print_notices, print_result
from .options.rendering import add_render_options, given_render_options
from .options.rigs import add_rig, require_rig_only, save_all
from .options.worlds import add_world, load_world, parse_animation

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from ..camera import Camera
    from ..render.frame import Frame
    from ..rig import Rig
    from ..world import World


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="output: .png, .jpg, .exr, .hdr, .npz or .html (default: the world's name with .png in the current "
        "folder); - writes a PNG to the standard output, -.exr an EXR, and so on",
    )
    add_camera(command)
    add_look(command)
    add_render_options(command)
    group = command.add_argument_group("ground truth and files")
    group.add_argument(
        "--channels",
        metavar="NAME",
        nargs="+",
        help="channels of the file, as listed in the documentation of raycam.Frame (color depth normal instance ...), "
        "or all (default: color; for .exr and .npz color depth instance triangle)",
    )
    group.add_argument(
        "--region",
        metavar="X,Y,W,H",
        type=parse_region,
        help="render only this part of the image: left column, top row, width and height in pixels",
    )
    group.add_argument("--bits", type=int, metavar="N", help="bits per channel of a .png: 8 (default) or 16")
    group.add_argument(
        "--half", action="store_true", default=None, help="write float16 instead of float32 to an .exr"
    )
    group = command.add_argument_group("motion and rigs")
    group.add_argument(
        "--turntable",
        metavar="SECONDS",
        nargs="?",
        const=4.0,
        type=parse_seconds,
        help="render a turntable video: one turn around the world in SECONDS (default: 4); for file formats, see "
        "raycam video --help",
    )
    group.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="time of the world's video or animation in seconds, for the world and the camera; motion continues "
        "during exposure",
    )
    group.add_argument(
        "--animation",
        metavar="NAME",
        help="animation of a glTF file for --at: a name, or a number from 0 (default: the first)",
    )
    add_rig(group)
    add_job(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..render import channel_names
    from ..render.frame import check_save, encoded

    if options.turntable is not None:
        _turntable(options)
        return
    output = Path(options.output or Path(options.world).with_suffix(".png").name)
    streamed = output.stem == "-" and output.parent == Path()
    if streamed:
        output = output if output.suffix else Path("-.png")
    if options.background == "transparent":
        options.transparent_background, options.background = True, None
    names, paired = _names(options, output)
    transparent = bool(options.transparent_background)
    if names or not paired:
        check_save(output, names, (1, 1), bits=options.bits, half=options.half, transparent=transparent)
    world = load_world(options)
    world, camera, rig = _moment(world, options)
    if rig is not None and not streamed:
        reject_options(options, LOOK_OPTIONS, "cannot be combined with --rig")
        _render_rig(options, output, world, rig, [*names, "disparity"] if paired else names)
        return
    if streamed and rig is not None:
        raise SettingsError(
            "-o - cannot be combined with --rig, which writes several images", code="conflicting_values"
        )
    if options.output is None and output.exists() and output.name in world.textures:
        raise SettingsError(
            f"{output} is a texture of this world; choose another name with -o", code="conflicting_values"
        )
    check_save(output, names, camera.size)

    def save(frame: Frame) -> None:
        print_notices(frame.notices)
        if streamed:
            sys.stdout.buffer.write(encoded(frame, output, bits=options.bits, half=options.half))
            return
        frame.save(output, bits=options.bits, half=options.half)
        _, _, width, height = frame.region
        print_result(f"{output}: {width} x {height}, {', '.join(frame.channels)}")

    _render(options, output, world, camera, channel_names(names), save)


LOOK_OPTIONS = (
    "view_from",
    "zoom",
    "fov",
    "hdri",
    "sun",
    "studio",
    "ground",
    "background",
    "background_camera",
    "orientation",
)
"""The options of a model's look."""


def _names(options: argparse.Namespace, output: Path) -> tuple[Sequence[str], bool]:
    """The channels of the file, and True if the disparity of a rig is added."""
    from ..render import DEFAULT_CHANNELS, channel_names
    from ..render.frame import PICTURES

    if options.channels is None:
        pictures = (*PICTURES, ".hdr")
        return (("color",) if output.suffix.lower() in pictures else DEFAULT_CHANNELS), False
    words = [name for part in options.channels for name in part.split(",") if name]
    paired = options.rig is not None and "disparity" in words
    words = [word for word in words if word != "disparity" or not paired]
    return (channel_names("all" if words == ["all"] else words) if words else []), paired


def _render(
    options: argparse.Namespace,
    output: Path,
    world: World,
    camera: Camera,
    names: Sequence[str],
    save: Callable[[Frame], object],
) -> None:
    """Renders one image in this process or as a job of tiles, and saves the image."""
    from ..render import is_shaded

    settings = given_render_options(options)
    by_job = any(value is not None for value in (options.workers, options.cluster, options.shard))
    if by_job:
        reject_options(options, ("background",), "cannot be combined with --workers, --cluster or --shard")
        lit = set(filter(is_shaded, names))
        shown, settings = apply_look(
            world, camera, options, settings, shaded=bool(lit), truth_of_world=lit == set(names)
        )
        if _by_job(options, output, shown, camera, names, save, settings) is None:
            print_result(f"shard {options.shard} is finished; {output} is written after the last shard")
        return
    if options.retry_failed or not options.resume:
        raise SettingsError(
            "--retry-failed and --no-resume require --workers, --cluster or --shard", code="missing_value"
        )
    lower_priority(options)
    save(_picture(options, world, camera, names, settings))


def _picture(
    options: argparse.Namespace,
    world: World,
    camera: Camera,
    names: Sequence[str],
    settings: Mapping[str, Any],
) -> Frame:
    """Renders the image in front of the background that the options specify."""
    import time

    from ..progress import bar
    from ..render import is_shaded, render

    def one(title: str, channels: Sequence[str], own: dict[str, Any]) -> Frame:
        shown, used = apply_look(world, camera, options, own, shaded=any(map(is_shaded, channels)))
        start = time.monotonic()
        print_detail(
            f"{title}: {', '.join(f'{name}={value}' for name, value in used.items()) or 'the defaults'}"
        )
        with bar(title) as progress:
            frame = render(shown, camera, channels=channels, region=options.region, progress=progress, **used)
        print_detail(f"{title}: {time.monotonic() - start:.2f} s")
        return frame

    if options.background is None:
        if options.background_camera is not None:
            raise SettingsError("--background-camera requires --background FILE", code="missing_value")
        if options.orientation is not None:
            raise SettingsError("--orientation requires --background FILE", code="missing_value")
        return one("rendering", names, dict(settings))
    if "color" not in names:
        raise SettingsError(
            f"--background requires the channel color; requested channels: {', '.join(names)}",
            code="missing_value",
        )
    from ..render.background import picture_behind
    from ..render.composition import over, studio_shadow

    behind = _background(options)
    picture_behind(behind, camera, camera.size)  # raises errors before rendering
    settings = {"view": "standard", **settings}  # the frame's look matches the background's
    clear = one("rendering", names, {**settings, "transparent_background": True})
    bare, _ = apply_look(world, camera, options, dict(settings))
    if bare.without_studio is not bare:
        clear = studio_shadow(clear, one("shadows", ["color"], dict(settings)))
    return over(clear, behind, keep=names)


def _background(options: argparse.Namespace) -> Any:
    """The colour or image of `--background`, with its camera and orientation."""
    from ..camera import Background
    from ..data import bundled

    found = bundled(options.background) or options.background
    if options.background_camera is None and options.orientation is None:
        return found
    orientation: Any = options.orientation or "auto"
    if options.background_camera is None:
        return Background(found, fit="cover", orientation=orientation)
    return Background(found, load_camera(options.background_camera, options), orientation=orientation)


def _turntable(options: argparse.Namespace) -> None:
    """Renders the video of `--turntable`."""
    from ..video.files import ENDINGS
    from .video import run_turntable

    for name in ("at", "animation", "rig", "channels", "region", "bits", "half"):
        if getattr(options, name) is not None:
            raise SettingsError(f"--{name} cannot be combined with --turntable", code="conflicting_values")
    output = Path(options.output or Path(options.world).with_suffix(".mp4").name)
    if output.suffix and output.suffix.lower() not in ENDINGS:
        raise SettingsError(
            f"{output}: --turntable renders a video; expected {', '.join(ENDINGS)}, or a folder for PNG images",
            code="unknown_format",
        )
    run_turntable(options, output)


def _moment(world: World, options: argparse.Namespace) -> tuple[World, Camera, Rig | None]:
    """The world, the camera and the rig at the requested time."""
    rig = require_rig_only(world, options)
    if options.at is None:
        if options.animation is not None:
            raise SettingsError("--animation requires --at SECONDS", code="missing_value")
        return world, find_camera(world, options) if rig is None else next(iter(rig.values())), rig
    moment = world.at(options.at, parse_animation(world, options.animation))
    # An animation also moves the world's cameras. The camera that frames a world without cameras does not move.
    seen = world if options.camera is None and world._first_camera is None else moment
    camera = find_camera(seen, options, moving=seen is world) if rig is None else next(iter(rig.values()))
    if world.video is not None:
        camera = world.camera_at(camera, options.at)
        rig = None if rig is None else world.rig_at(rig, options.at)
    return moment, camera, rig


def _render_rig(
    options: argparse.Namespace, output: Path, world: World, rig: Rig, names: Sequence[str]
) -> None:
    """Renders and saves a frame for each camera of the rig."""
    if any(value is not None for value in (options.workers, options.cluster, options.shard)):
        raise SettingsError(
            "--rig cannot be combined with --workers, --cluster or --shard; use raycam dataset",
            code="conflicting_values",
        )
    lower_priority(options)
    frames = rig.render(world, channels=names, region=options.region, **given_render_options(options))
    for path, (name, frame) in zip(
        save_all(frames, output, options.bits, options.half), frames.items(), strict=True
    ):
        print_notices([notice.in_context(name) for notice in frame.notices])
        _, _, width, height = frame.region
        print_result(f"{path}: {width} x {height}, {', '.join(frame.channels)}")


def _by_job(
    options: argparse.Namespace,
    output: Path,
    world: World,
    camera: Camera,
    names: Sequence[str],
    save: Callable[[Frame], object],
    settings: Mapping[str, Any],
) -> Frame | None:
    """Renders the image in tiles and saves the image.

    Returns None if other shards still have tiles to render.
    """
    from ..jobs import tiled_picture
    from ..progress import frames_bar

    shard = parse_shard(options)
    package = tiled_picture.job_package(world, camera, channels=names, region=options.region, **settings)
    with job_pool(options) as pool, frames_bar("rendering", "tiles") as progress:
        return tiled_picture.render_tiled(
            package,
            output.with_name(output.name + ".job"),  # holds the tiles until the image is complete
            pool,
            shard=shard,
            resume=options.resume,
            retry_failed=options.retry_failed,
            progress=progress,
            save=save,
        )


COMMAND = Command(
    _add,
    "render an image of a world",
    [
        "raycam render model.glb                                    model.png, in the studio",
        "raycam render model.glb --view-from 1,1,2 --zoom 1.2       from another side",
        "raycam render model.glb --camera calib.yaml --view-from front    with a lens, from the front",
        "raycam render model.glb --hdri sky.hdr --ground -o a.png   lit by an environment image",
        "raycam render model.glb --background white --preset good   on white, with path tracing",
        "raycam render model.glb --turntable -o model.mp4           a video that turns around it",
        "raycam render room.toml --camera calib.yaml                with a calibrated camera",
        "raycam render room.toml -o room.exr --channels all         with all ground truth",
        "raycam render room.toml -o room.exr --workers 4            in tiles, by 4 processes; can be resumed",
        "raycam render room.toml --integrator flat --samples 1      the lecture's image",
        "raycam render car.toml --rig stereo -o car.exr --channels depth disparity    car_left.exr ...",
        "raycam render car.toml --at 1.5 -o car.png                 at 1.5 s of its video",
    ],
)
