"""`raycam view`."""

from __future__ import annotations

import argparse
import ipaddress
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SettingsError
from ..io.system_calls import give_memory_back
from ._options import Command, add_camera, load_calibration, load_world, print_notice, view

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World

SHOWN = ("channel", "exposure", "view")
"""The options of a page of frames."""


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("world", metavar="WORLD|FRAME", help="a world, or a frame saved as .npz or .exr")
    command.add_argument(
        "compare", metavar="FRAME", nargs="?", help="a second frame, to compare with the first"
    )
    command.add_argument("--texture-memory", metavar="SIZE", help="memory for textures, as 512MiB")
    add_camera(command)
    command.add_argument(
        "--cameras",
        metavar="FILE",
        help="a calibration, a trajectory or another world, whose cameras are listed beside the world's",
    )
    command.add_argument("--integrator", metavar="NAME", help="the light of still pictures: direct or path")
    command.add_argument("--samples", metavar="N", type=int, help="rays per pixel of still pictures")
    command.add_argument(
        "--at", metavar="SECONDS", type=float, help="the time of its video or animation shown first"
    )
    command.add_argument("--animation", metavar="NAME", help="the animation of a glTF file shown first")
    command.add_argument(
        "--variant", dest="first_variant", metavar="NAME", help="the material variant shown first"
    )
    command.add_argument("--channel", metavar="NAME", help="the channel shown first, as depth")
    command.add_argument("--exposure", metavar="STOPS", type=float, help="the exposure at first")
    command.add_argument(
        "--view", metavar="NAME", help="the view transform at first: standard, agx or pbr_neutral"
    )
    command.add_argument("--threads", metavar="N", type=int, help="threads (default: all)")
    command.add_argument(
        "--port", metavar="N", type=int, help="the port (default: 7421, or the next free one)"
    )
    command.add_argument("--host", metavar="ADDRESS", default="127.0.0.1", help="the address to listen on")
    command.add_argument(
        "--yes", action="store_true", help="listen on another address than this machine's own"
    )
    command.add_argument(
        "--allow-host",
        metavar="NAME",
        action="append",
        default=[],
        help="a name of this server behind a proxy",
    )
    command.add_argument("--no-browser", action="store_true", help="print the address and open nothing")
    command.add_argument(
        "--no-edit", action="store_true", help="look alone: objects and lights stay as they are"
    )
    command.add_argument(
        "--allow-open", action="store_true", help="files that are dropped on the page are opened there"
    )
    command.add_argument("--follow", action="store_true", help="all clients share one camera, as in teaching")
    command.add_argument("--exit-when-closed", action="store_true", help="end when the page is closed")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..viewer.saved_frames import is_frame

    if is_frame(options.world):
        _show_frames(options)
    elif options.compare is not None:
        raise SettingsError(
            f"{options.compare}: two frames are compared, saved as .npz or .exr; {options.world} is a world"
        )
    else:
        _view_world(options)


def _show_frames(options: argparse.Namespace) -> None:
    """The page of one frame, or of two."""
    from ..viewer.page import page, write_page
    from ..viewer.saved_frames import load_frame

    frame = load_frame(options.world)
    _refuse_others(options)
    more: dict[str, Any] = {} if options.compare is None else {"compare": load_frame(options.compare)}
    shown = {name: getattr(options, name) for name in SHOWN}
    made = page(frame, title=Path(options.world).name, **shown, **more)
    print(write_page(made, browser=not options.no_browser))


def _refuse_others(options: argparse.Namespace) -> None:
    """Refuses options of worlds, which a saved frame does not have."""
    command = argparse.ArgumentParser(add_help=False)
    _add(command)
    defaults = vars(command.parse_args([options.world, *filter(None, [options.compare])]))
    given = [name for name, value in defaults.items() if getattr(options, name) != value]
    others = [name for name in given if name not in (*SHOWN, "no_browser")]
    if others:
        named = ", ".join(f"--{name.removeprefix('first_').replace('_', '-')}" for name in others)
        shown = ", ".join(f"--{name}" for name in SHOWN)
        raise SettingsError(
            f"{named}: for worlds, and {options.world} is a saved frame; its page takes {shown} and --no-browser"
        )


def _view_world(options: argparse.Namespace) -> None:
    """The live view, until Ctrl-C."""
    from ..viewer.viewer import Viewer, open_browser

    _check_host(options)
    give_memory_back()
    world = load_world(options)
    own = set(world.cameras)
    _add_cameras(world, options)
    with Viewer(
        world,
        view(world, options),
        title=Path(options.world).name,
        integrator=options.integrator,
        samples=options.samples,
        size=options.size,
        host=options.host,
        port=options.port,
        allow_hosts=options.allow_host,
        threads=options.threads,
        edit=not options.no_edit,
        follow=options.follow,
        allow_open=options.allow_open,
        source=options.world,
        added=set(world.cameras) - own,
        start={
            "time": options.at,
            "animation": options.animation,
            "variant": options.first_variant,
            "channel": options.channel,
            "exposure": options.exposure,
            "view": options.view,
        },
    ) as viewer:
        print(f"raycam view: {viewer.url}        (Ctrl-C ends it)", flush=True)
        if not open_browser(viewer.url, False if options.no_browser else None):
            port = viewer.url.split("/#")[0].rsplit(":", 1)[1]
            print_notice(f"from another machine: ssh -L {port}:127.0.0.1:{port} HOST, then the same address")
        viewer.wait(exit_when_closed=options.exit_when_closed)


def _add_cameras(world: World, options: argparse.Namespace) -> None:
    """Adds the cameras of `--cameras` to the world."""
    from ..render.arguments import UNPOSED, is_unposed_within
    from ..world.load import load

    if options.cameras is None:
        return
    found: Mapping[str, Camera] = (
        load(options.cameras).cameras
        if options.cameras.endswith((".toml", ".glb", ".gltf"))
        else load_calibration(options.cameras, options)
    )
    if any(is_unposed_within(world, camera) for camera in found.values()):
        print_notice(UNPOSED)
    for name, camera in found.items():
        world.add_camera(camera, name)


def _check_host(options: argparse.Namespace) -> None:
    """Refuses to be seen by the network unless it is told twice."""
    try:
        is_own = options.host == "localhost" or ipaddress.ip_address(options.host).is_loopback
    except ValueError:
        raise SettingsError(f"--host {options.host}: expected an address, as 0.0.0.0 or ::1") from None
    if not is_own and not options.yes:
        raise SettingsError(
            f"--host {options.host}: everyone on the network could then read along, for there is no encryption; "
            "forward the port with ssh instead, or add --yes"
        )
    if not is_own:
        print_notice("everyone on the network can try this port and read along")


COMMAND = Command(
    _add,
    "look at a world live in the browser, or at saved frames with every number",
    [
        "raycam view room.toml",
        "raycam view fox.glb --animation Run --at 0.5 --channel depth",
        "raycam view before.npz after.exr",
    ],
)
