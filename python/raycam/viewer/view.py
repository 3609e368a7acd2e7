"""`raycam.view`: a live view of a world in the browser, or a page with frames."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..arguments import size_of
from ..camera import Camera
from ..errors import SettingsError
from ..photos.images import Photos
from ..render.arguments import world_of
from ..render.frame import Frame
from ..world import World
from ..world.load import load_with_assumed_axis
from .files.photographs import Photographs
from .files.sources import Opening
from .saved_frames import is_frame, load_frame
from .viewer import Viewer

__all__ = ["open_browser", "view"]


def view(
    what: World | Frame | str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    camera: Camera | None = None,
    *,
    size: tuple[int, int] | None = None,
    browser: bool | None = None,
    block: bool | None = None,
    cell: bool | None = None,
    watch: bool = False,
    cameras: Mapping[str, Camera] | None = None,
    photos: Photos | None = None,
    **options: Any,
) -> Any:
    """Shows a world in the browser or in a notebook cell; returns a `Viewer`.

    The view can be moved with the mouse.

    `what` is a world or a frame, or the path of a world or a frame. It may also be a folder or a .zip archive with a
    world, or a list of models. Models are shown in one world, each at its own coordinates. A frame (.npz, .exr) is
    shown as by `Frame.show`, with its options. `camera` is the initial camera (default: the world's first camera),
    `size` (width, height) the size of the images (default: the size of the client's window). `integrator` ("direct" or
    "path") and `samples` apply to the image at rest. `title` is the page's title; `host` ("127.0.0.1"), `port` (7421 or
    the next free one) and `allow_hosts` are the server's addresses; `threads` is the number of threads. With
    `edit=False`, the world cannot be changed. With `follow=True`, up to 40 followers show the leader's view, for
    example in teaching. `Viewer.url` is the leader's address, and `Viewer.followers_urls` are the followers' addresses.
    With `allow_open=True`, worlds that are dropped on the page are copied to a private folder and opened. `source` is
    the world's file, next to which a changed world file can be saved. `start` contains initial values, for example
    {"time": 1.5, "animation": "Run", "variant": "red", "channel": "depth", "exposure": 1, "view": "agx"}.

    `cameras`, such as those of `raycam.load_cameras`, are listed in addition to the world's cameras. `photos` are the
    photographs of `cameras`: a folder, or a mapping from the photographs' names to paths or arrays [h, w, 3]. The
    view begins with the first of `cameras`, and a slider shows the photograph over the image of the model.

    With `watch=True`, the world is loaded again after each change of its file and of the files that it uses; the camera
    does not change. If the changed file is invalid, the error is shown and the previous world is kept.

    In a notebook, the view is a widget of `height` (560) pixels if anywidget is installed
    (`pip install raycam[notebook]`); `cell` selects or suppresses the widget. It uses the kernel's own connection and
    opens no port.

    A model without lights and cameras is shown in the studio, as in `raycam.render`. As in `raycam render`, a model
    file with suns or lamps only is shown in the studio's room (`studio=False`: in the dark), `hdri` (with
    `hdri_rotation`), `sun=(azimuth, elevation)`, `studio=True`, `ground` and `background` select another look, and
    `view_from`, `zoom` and `fov` select another initial camera.

    `browser` opens a browser (default: if one is available and this is not an SSH session). `block` waits until the
    view is closed (default: only in a script). Raises `SettingsError` for invalid arguments and `NetworkError` if the
    port cannot be used.
    """
    if isinstance(what, str | os.PathLike) and is_frame(what):
        options = {"title": Path(what).name, **options}
        what = load_frame(what)
    if isinstance(what, Frame):
        of_worlds: dict[str, Any] = {
            "camera": camera,
            "size": size,
            "browser": browser,
            "block": block,
            "cell": cell,
        }
        of_worlds |= {"cameras": cameras, "photos": photos, "watch": watch or None}
        return _show_frame(what, of_worlds, options)
    world, more = _open(what, watch)
    options = {**more, **options}
    if photos is not None:
        options["photographs"] = _photographs(photos, cameras)
    if cameras is not None:
        world = world.with_cameras(cameras)
        options["added"] = frozenset(cameras)
        camera = next(iter(cameras.values()), None) if camera is None and photos is not None else camera
    if size is not None:
        options["size"] = size_of(size)
        if camera is None and world._first_camera is not None:
            camera = world.default_camera()
        camera = None if camera is None else camera.resized(options["size"])
    if _in_notebook() if cell is None else cell:
        return Viewer(world, camera, cell=True, **options)
    viewer = Viewer(world, camera, **options)
    print(f"raycam view: {viewer.url}", file=sys.stderr, flush=True)
    if options.get("follow"):
        print(f"for followers: {viewer.followers_urls[0]}", file=sys.stderr, flush=True)
    open_browser(viewer, browser)
    if not _is_interactive() if block is None else block:
        with viewer:
            viewer.wait()
    return viewer


def _is_interactive() -> bool:
    """True at a prompt and in a notebook, where calls return at once."""
    return hasattr(sys, "ps1") or bool(sys.flags.interactive) or "ipykernel" in sys.modules


def _show_frame(frame: Frame, of_worlds: Mapping[str, Any], options: Mapping[str, Any]) -> Any:
    """Shows a frame; raises `SettingsError` for options of worlds."""
    for name in (name for name, value in of_worlds.items() if value is not None):
        raise SettingsError(
            f"{name} is an option for worlds, but this is a frame; Frame.show lists the options of frames",
            code="conflicting_values",
        )
    return frame.show(**options)


def _open(what: Any, watch: bool) -> tuple[World, dict[str, Any]]:
    """Returns the world of a path, folder, archive or list of models, and options of `Viewer`.

    The options follow from the opened files.
    """
    given = list(what) if isinstance(what, list | tuple) else [what]
    if not given or not all(isinstance(each, str | os.PathLike) for each in given):
        if watch:
            raise SettingsError(
                "watch requires the path of a world, got a loaded world", code="conflicting_values"
            )
        return world_of(what), {}
    with tempfile.TemporaryDirectory(prefix="raycam-archive-") as unpacked:
        opening = Opening.find(given, Path(unpacked))

        def load_again() -> World:
            return opening.load(lambda path, folder: load_with_assumed_axis(path, folder=folder))

        more: dict[str, Any] = {
            "title": opening.title,
            "source": opening.source,
            "is_model": opening.is_model,
        }
        if watch:
            opening.check_watch()
            more["reload"] = load_again
        return load_again(), more


def _photographs(photos: Photos, cameras: Mapping[str, Camera] | None) -> Photographs:
    """The photographs of cameras. Raises `SettingsError` without cameras."""
    if not cameras:
        raise SettingsError(
            "photos requires cameras= with the cameras of the photographs", code="missing_value"
        )
    names = getattr(cameras, "images", {})
    return Photographs(photos, {name: names.get(name, name) for name in cameras})


def _in_notebook() -> bool:
    """True if a cell can show a widget."""
    import importlib.util

    is_there = "ipykernel" in sys.modules or "marimo" in sys.modules
    return is_there and importlib.util.find_spec("anywidget") is not None


def open_browser(viewer: Viewer, wanted: bool | None = None) -> bool:
    """Opens a viewer in the browser; returns True if the viewer was opened.

    `wanted` determines whether the viewer is opened (default: if this machine has a browser).

    The browser opens a private file that redirects to the view with a token that is valid once. The list of processes
    therefore contains only the file's name, and the browser's history does not contain a valid token.
    """
    if not (_has_browser() if wanted is None else wanted):
        return False
    import webbrowser

    return webbrowser.open(viewer.redirect_file().as_uri())


def _has_browser() -> bool:
    """True if a browser can be opened on the user's own desktop."""
    if "SSH_CONNECTION" in os.environ:
        return False
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        return False
    import webbrowser

    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    return True
