"""The command `raycam view`."""

from __future__ import annotations

import argparse
import ipaddress
import signal
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SettingsError
from ..io.system_calls import give_memory_back
from .options.cameras import WORLD_ENDINGS, add_camera, load_calibration
from .options.command import Command
from .options.framing import find_camera, is_framed
from .options.look import add_look
from .options.messages import print_notice, print_notices
from .options.worlds import add_geometry, add_texture_memory, find_file, load_world

if TYPE_CHECKING:
    from ..camera import Camera
    from ..viewer.files.sources import Opening
    from ..world import World

FRAME_OPTIONS = ("channel", "exposure", "view")
"""The options of a page that shows saved frames."""


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "world",
        metavar="WORLD|FRAME",
        help="world, or a folder or .zip archive that contains a world; or a frame saved as .npz or .exr",
    )
    command.add_argument(
        "more",
        metavar="MODEL|FRAME",
        nargs="*",
        default=[],  # otherwise, argparse reports this argument as required
        help="further models, shown in the same world; or a second frame, to compare with the first",
    )
    add_geometry(command)
    add_texture_memory(command)
    add_camera(command)
    add_look(command)
    command.add_argument(
        "--cameras",
        metavar="FILE",
        help="calibration, trajectory or world file whose cameras are listed in addition to the world's",
    )
    command.add_argument(
        "--photos",
        metavar="DIR",
        help="folder with the photographs taken by --cameras; each is the background of its camera's view",
    )
    command.add_argument(
        "--integrator",
        metavar="NAME",
        help="integrator of still images: direct or path (default: the world's, or direct; path in the studio and "
        "with --hdri)",
    )
    command.add_argument(
        "--samples",
        metavar="N",
        type=int,
        help="samples per pixel of still images (default: 64 with direct, 256 with path)",
    )
    command.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="initial time of the world's video or animation, in seconds (default: 0)",
    )
    command.add_argument(
        "--animation", metavar="NAME", help="initial animation of a glTF file (default: the first)"
    )
    command.add_argument(
        "--variant", dest="first_variant", metavar="NAME", help="initial material variant of a glTF file"
    )
    command.add_argument(
        "--channel", metavar="NAME", help="initial channel, for example depth (default: color)"
    )
    command.add_argument("--exposure", metavar="STOPS", type=float, help="initial exposure in stops")
    command.add_argument(
        "--view",
        metavar="NAME",
        help="initial view transform: standard, agx or pbr_neutral (default: the world's, or standard; pbr_neutral "
        "in the studio and with --hdri)",
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    _add_server(command)
    command.set_defaults(run=_run)


def _add_server(command: argparse.ArgumentParser) -> None:
    """Adds the options of the server and its clients."""
    command.add_argument("--port", metavar="N", type=int, help="port (default: 7421, or the next free one)")
    command.add_argument(
        "--host", metavar="ADDRESS", default="127.0.0.1", help="address to listen on (default: 127.0.0.1)"
    )
    command.add_argument(
        "--yes", action="store_true", help="confirm that --host makes the viewer reachable from the network"
    )
    command.add_argument(
        "--allow-host",
        metavar="NAME",
        action="append",
        default=[],
        help="additional host name under which a proxy serves the viewer; may be repeated",
    )
    command.add_argument(
        "--proxy",
        metavar="ADDRESS",
        action="append",
        default=[],
        help="address of a proxy whose X-Forwarded-Host header is accepted; may be repeated",
    )
    command.add_argument(
        "--no-browser", action="store_true", help="print the address instead of opening a browser"
    )
    command.add_argument(
        "--watch",
        action="store_true",
        help="load the world again when its file or a file that it uses changes",
    )
    command.add_argument("--no-edit", action="store_true", help="disable editing of objects and lights")
    command.add_argument(
        "--allow-open", action="store_true", help="allow clients to open files by dropping them on the page"
    )
    command.add_argument(
        "--follow",
        action="store_true",
        help="print a second address for up to 40 followers, for example a class: their pages show your camera, "
        "channel, exposure and held pixel",
    )
    command.add_argument(
        "--exit-when-closed", action="store_true", help="stop the server when the page is closed"
    )


def _run(options: argparse.Namespace) -> None:
    from ..viewer.saved_frames import is_frame

    if is_frame(options.world):
        _show_frames(options)
    else:
        for other in options.more:
            if is_frame(other):
                raise SettingsError(
                    f"{other}: cannot be compared with {options.world}, which is a world; expected two frames saved "
                    "as .npz or .exr",
                    code="conflicting_values",
                )
        _view_world(options)


def _show_frames(options: argparse.Namespace) -> None:
    """The page that shows one frame or compares two frames."""
    from ..viewer.page import page, write_page
    from ..viewer.saved_frames import load_frame

    if len(options.more) > 1:
        raise SettingsError(
            f"{options.more[1]}: at most two frames can be compared, got {1 + len(options.more)}",
            code="conflicting_values",
        )
    frame = load_frame(options.world)
    _refuse_others(options)
    more: dict[str, Any] = {}
    for other in options.more:
        more = {"compare": load_frame(other), "compare_title": Path(other).name}
    shown = {name: getattr(options, name) for name in FRAME_OPTIONS}
    made = page(frame, title=Path(options.world).name, **shown, **more)
    print(write_page(made, browser=not options.no_browser))


def _refuse_others(options: argparse.Namespace) -> None:
    """Raises an error for options that do not apply to a saved frame."""
    command = argparse.ArgumentParser(add_help=False)
    _add(command)
    defaults = vars(command.parse_args([options.world, *options.more]))
    given = [name for name, value in defaults.items() if getattr(options, name) != value]
    others = [name for name in given if name not in (*FRAME_OPTIONS, "no_browser")]
    if others:
        named = ", ".join(f"--{name.removeprefix('first_').replace('_', '-')}" for name in others)
        shown = ", ".join(f"--{name}" for name in FRAME_OPTIONS)
        raise SettingsError(
            f"{named}: not supported for the saved frame {options.world}; supported: {shown} and --no-browser",
            code="conflicting_values",
        )


def _view_world(options: argparse.Namespace) -> None:
    """Runs the live view until Ctrl-C."""
    with tempfile.TemporaryDirectory(prefix="raycam-archive-") as unpacked:
        _view_files(options, Path(unpacked))


def _view_files(options: argparse.Namespace, unpacked: Path) -> None:
    """Runs the live view of files; archives are unpacked to a folder."""
    from ..viewer.files.photographs import Photographs
    from ..viewer.files.sources import Opening
    from ..viewer.view import open_browser
    from ..viewer.viewer import Viewer

    _check_host(options)
    _end_on_signals()
    give_memory_back()
    opening = Opening.find([find_file(each) for each in (options.world, *options.more)], unpacked)
    if options.watch:
        opening.check_watch()
    world = _load(opening, options)
    own = set(world.cameras)
    framed = options.camera is None and is_framed(world, options)
    camera = None if framed else find_camera(world, options)
    added = _add_cameras(world, options)
    photographs = None
    if options.photos is not None:
        photographs = Photographs(options.photos, _photographed(added, options))
        if options.camera is None and options.view_from is None and options.zoom is None:
            framed, camera = False, world.camera(photographs.cameras[0])
    framing = {"view_from": options.view_from or "default", "zoom": options.zoom, "fov": options.fov}

    def reload() -> World:
        changed = _load(opening, options)
        _add_cameras(changed, options)
        return changed

    with Viewer(
        world,
        camera,
        **(framing if framed else {}),
        **_start(options),
        title=opening.title,
        integrator=options.integrator,
        samples=options.samples,
        size=options.size,
        host=options.host,
        port=options.port,
        allow_hosts=options.allow_host,
        proxies=options.proxy,
        threads=options.threads,
        edit=not options.no_edit,
        follow=options.follow,
        allow_open=options.allow_open,
        source=opening.source,
        added=set(world.cameras) - own,
        reload=reload if options.watch else None,
        photographs=photographs,
        is_model=opening.is_model,
    ) as viewer:
        print(f"raycam view: {viewer.url}        (Ctrl-C stops it)", flush=True)
        for url in viewer.urls[1:]:
            print(f"             {url}", flush=True)
        for url in viewer.followers_urls if options.follow else []:
            print(f"for followers: {url}", flush=True)
        if not open_browser(viewer, False if options.no_browser else None) and len(viewer.urls) == 1:
            port = viewer.url.split("/#")[0].rsplit(":", 1)[1]
            print_notice(
                f"from another machine: run ssh -L {port}:127.0.0.1:{port} HOST, then open the same address"
            )
        viewer.wait(exit_when_closed=options.exit_when_closed)


def _load(opening: Opening, options: argparse.Namespace) -> World:
    """Loads the world, and prints its notices."""

    def load(path: Path, folder: Path | None) -> World:
        named = {"world": str(path), "folder": None if folder is None else str(folder)}
        return load_world(argparse.Namespace(**{**vars(options), **named}))

    world = opening.load(load)
    if len(opening.paths) > 1:
        print_notices(world.notices)
    return world


def _start(options: argparse.Namespace) -> dict[str, Any]:
    """The initial values of the view, and its look."""
    if options.background_camera is not None:
        raise SettingsError(
            "--background-camera is not supported by raycam view; use raycam render",
            code="unsupported_feature",
        )
    look = ("hdri", "hdri_rotation", "sun", "studio", "ground", "background")
    start = {
        "time": options.at,
        "animation": options.animation,
        "variant": options.first_variant,
        "channel": options.channel,
        "exposure": options.exposure,
        "view": options.view,
    }
    return {"start": start, **{name: getattr(options, name) for name in look}}


def _end_on_signals() -> None:
    """Ends the view on SIGTERM and SIGHUP as on Ctrl-C.

    Pages are notified, and dropped files are removed.
    """

    def stop(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), stop)


def _photographed(cameras: Mapping[str, Camera], options: argparse.Namespace) -> dict[str, str]:
    """Returns the photograph's name for each camera of `--cameras`, by the camera's name.

    Raises `SettingsError` without cameras.
    """
    if not cameras:
        raise SettingsError(
            f"--photos {options.photos}: requires --cameras with the cameras of the photographs",
            code="conflicting_values",
        )
    images = getattr(cameras, "images", {})
    return {name: images.get(name, name) for name in cameras}


def _add_cameras(world: World, options: argparse.Namespace) -> Mapping[str, Camera]:
    """Adds the cameras of `--cameras` to the world, and returns them."""
    from ..render.arguments import UNPOSED, is_unposed_within
    from ..world.load import load

    if options.cameras is None:
        return {}
    found: Mapping[str, Camera] = (
        load(options.cameras).cameras
        if options.cameras.endswith(WORLD_ENDINGS)
        else load_calibration(options.cameras, options)
    )
    if any(is_unposed_within(world, camera) for camera in found.values()):
        print_notice(UNPOSED)
    for name, camera in found.items():
        world.add_camera(camera, name)
    return found


def _check_host(options: argparse.Namespace) -> None:
    """Raises `SettingsError` for an address that the network can reach, unless `--yes` is given."""
    try:
        is_own = options.host == "localhost" or ipaddress.ip_address(options.host).is_loopback
    except ValueError:
        raise SettingsError(
            f"--host {options.host}: expected an address, such as 0.0.0.0 or ::1", code="invalid_value"
        ) from None
    if not is_own and not options.yes:
        raise SettingsError(
            f"--host {options.host}: other people on the network could connect, and the connection is not encrypted; "
            "forward the port with ssh instead, or add --yes",
            code="insecure_address",
        )
    if not is_own:
        print_notice("the viewer is reachable from the network, without encryption")


COMMAND = Command(
    _add,
    "show a world live in the browser, or inspect saved frames",
    [
        "raycam view room.toml",
        "raycam view fox.glb --animation Run --at 0.5 --channel depth",
        "raycam view room.toml --watch                      load it again after each change",
        "raycam view wheel.stl hub.stl axle.stl             several models in one world",
        "raycam view scan.ply --cameras sparse/0 --photos images   photographs behind their cameras",
        "raycam view panda.urdf --geometry both             a robot with its collision shapes, and sliders of joints",
        "raycam view model.zip                              an archive, or a folder",
        "raycam view before.npz after.exr",
    ],
)
