"""The viewer: a live view of a world, in a server or a notebook widget."""

from __future__ import annotations

import base64
import contextlib
import os
import tempfile
import threading
import time
import traceback
import weakref
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._core import Cancel
from ..arguments import one_of, size_of, thread_count, whole
from ..camera import Camera, check_camera
from ..errors import Error, SettingsError
from ..notices import collected
from ..render import render
from ..render.arguments import world_of
from ..render.frame import Frame
from ..world import World
from .callbacks import callback
from .controls import Control, Controls, Folder
from .files.browser_folder import browser_folder
from .files.photographs import Photographs
from .files.watch import Watcher
from .gate import prepare_page
from .joint_sliders import JointSliders
from .moving import prepare
from .recording import Recording
from .scene.edits import Edits
from .scene.look import Look
from .server import Server
from .session import DEFAULT_SAMPLES, Opened, Pixel, Session, world_at
from .stills import truth
from .wire import data_url

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["Viewer"]

QUEUED_PICKS = 16
"""Maximum number of clicked pixels that wait for callbacks; further clicks are dropped."""
FIRST_SIDE = 480
"""Longer side in pixels of the image that a notebook shows without a kernel."""
LINGER = 5.0  # seconds after the last client until `exit_when_closed` ends a viewer


class Viewer:
    """A live view: a server in the background or a notebook widget.

    A view may have several clients.
    """

    def __init__(
        self,
        world: World,
        camera: Camera | None = None,
        *,
        title: str = "raycam",
        integrator: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        host: str = "127.0.0.1",
        port: int | None = None,
        allow_hosts: Collection[str] = (),
        proxies: Collection[str] = (),
        threads: int | None = None,
        follow: bool = False,
        edit: bool = True,
        allow_open: bool = False,
        source: str | os.PathLike[str] | None = None,
        added: Collection[str] = (),
        reload: Callable[[], World] | None = None,
        photographs: Photographs | None = None,
        is_model: bool = False,
        start: Mapping[str, Any] | None = None,
        cell: bool = False,
        height: int = 560,
        view_from: str | npt.ArrayLike | None = None,
        zoom: float | None = None,
        fov: float | None = None,
        **look: Any,
    ) -> None:
        """Starts the view; use `raycam.view`, which describes the arguments.

        `is_model` is True for the world of a model file, whose suns and lamps are completed by the studio's room.
        `added` lists the cameras that are not in the file `source`. If `reload` is given, it loads the world again
        after each change of the file `source` and of the files that it uses. `photographs` are shown behind their
        cameras. `size` limits the image size, at most 2560 x 1600; by default, images have the size of the client's
        window. `start` contains the initial `time`, `animation`, `variant`, `channel`, `exposure` and `view`. `cell`
        creates a widget `height` pixels high instead of a server; it requires raycam[notebook].

        `view_from`, `zoom` and `fov` place the first camera as in `World.view_from`. `look` contains the options of
        `Look.choose`: `hdri`, `hdri_rotation`, `sun`, `studio`, `ground` and `background`.
        """
        _check(integrator, samples)
        threads = thread_count(threads)
        camera, framing = _framed(world, camera, {"direction": view_from, "zoom": zoom, "fov": fov})
        self.controls = Controls()
        """The controls that the script added."""
        # The view has its own copy, so that a script can prepare the next world in place.
        self._edits = Edits(world.copy(), allowed=edit)
        self._joints = JointSliders(self.controls, self._edits)
        self._camera = camera
        self._options: dict[str, Any] = {
            "title": title,
            "integrator": integrator,
            "samples": samples,
            "size": size,
            "threads": threads,
            "source": None if source is None else Path(source).absolute(),
            "added": frozenset(added),
            "allows_open": allow_open,
            "photographs": photographs,
            "start": None if start is None else dict(start),
            "framing": framing,
            "look": _chosen_look(
                Opened(self._edits, camera=camera, framing=framing, is_model=is_model), look
            ),
            "is_model": is_model,
            "controls": self.controls,
            "picked": _weakly(self._pick),
        }
        self._listeners: list[Callable[[dict[str, Any]], object]] = []
        self._recordings: weakref.WeakSet[Recording] = weakref.WeakSet()
        self._telling = ThreadPoolExecutor(1, "raycam picks")
        self._free_picks = threading.BoundedSemaphore(QUEUED_PICKS)
        # This call raises an error for unknown values.
        self._first = Session(self._edits, self._camera, **self._options)
        self._prepared: tuple[World, Session] | None = None
        """The session that waits for the first client, and the world with which it started."""
        self._redirects: tempfile.TemporaryDirectory[str] | None = None
        self._server: Server | None = None
        self._widget: Any = None
        self._load = reload
        self._watcher = None if reload is None or source is None else Watcher(source, _weakly(self._reload))
        if cell:
            self._show_in_cell(title, height)
        else:
            names = {"allow_hosts": allow_hosts, "proxies": proxies}
            self._server = Server(
                self._session, host=host, port=port, follow=follow, prepare=self._prepare, **names
            )
        if self._watcher is not None:
            self._watcher.start()

    def _show_in_cell(self, title: str, height: int) -> None:
        from .widget import make_widget

        self._widget = make_widget(_weakly(self._session), title, height)
        weakref.finalize(self, self._widget.close)
        if self._watcher is not None:
            weakref.finalize(self, self._watcher.end)

    def _session(self) -> Session:
        """Returns the prepared session at the first call, and a new session at every later call.

        If the world was replaced after the preparation, the first call also returns a new session.
        """
        prepared, self._prepared = self._prepared, None
        if prepared is not None and prepared[0] is self._edits.world:
            made = prepared[1]
        else:  # the camera and the look of the prepared session fit a world that is no longer shown
            made = Session(self._edits, self._camera, **self._options)
        made.images.pace.begin_like(self._first.images.pace)
        return made

    def _prepare(self, cancel: Cancel) -> None:
        """Assembles the page and prepares the world and the session of the first client."""
        prepare_page()
        world = self._edits.world
        session = Session(self._edits, self._camera, **self._options)
        self._prepared = world, session
        prepare(session.view, self._first.images.pace, self._options["threads"], cancel)

    @property
    def world(self) -> World:
        """A copy of the world, including edits made in the browser.

        Setting this property shows another world to all clients. Later changes of that world are shown when it is set
        again.
        """
        return self._edits.world.copy()

    @world.setter
    def world(self, world: World) -> None:
        self._edits.replace(world_of(world).copy())

    def _reload(self) -> None:
        """Shows the world of the changed file, or the error of loading the file."""
        assert self._load is not None
        name, texts = self._options["source"].name, []
        try:
            with collected() as notices:
                world = self._load()
            texts += [str(each) for each in notices]
            discarded = self._edits.reload(world)
            texts.append(f"{name} has changed and was loaded again.")
            if discarded:
                texts.append(f"Edits were discarded ({discarded}); undo restores them.")
        except (Error, OSError, MemoryError) as error:
            for session in self._sessions():
                session.complain(f"{name} has changed, but cannot be loaded: {error}")
            return
        for session in self._sessions():
            session.notify("\n".join(texts))

    @property
    def url(self) -> str:
        """The address to open in a browser.

        Anyone who knows the address can use the view. Raises `SettingsError` for a widget.
        """
        if self._server is None:
            raise SettingsError(
                "the view is shown in a notebook cell and has no address; use raycam.view(world, cell=False)",
                code="conflicting_values",
            )
        return self._server.url

    @property
    def urls(self) -> list[str]:
        """All addresses of the view.

        They include addresses for other machines if `host` allows them. Raises the errors of `url`.
        """
        return [self.url] if self._server is None else self._server.urls

    @property
    def followers_urls(self) -> list[str]:
        """The addresses for followers.

        Followers show the leader's view and cannot change the world; `urls` are the leader's addresses. Raises
        `SettingsError` without `follow=True`.
        """
        urls = [] if self._server is None else self._server.followers_urls
        if not urls:
            raise SettingsError(
                "the view has no followers: start it with follow=True", code="conflicting_values"
            )
        return urls

    def redirect_file(self) -> Path:
        """Writes a page that redirects to the view once; returns its path.

        Only this user can read the page; `close` removes the file.
        """
        if self._server is None:
            return Path(self.url)
        if self._redirects is None:
            # The folder's mode is 700, so only this user can read it.
            self._redirects = tempfile.TemporaryDirectory(prefix="raycam-open-", dir=browser_folder())
        path = Path(self._redirects.name) / f"view{len(list(Path(self._redirects.name).iterdir()))}.html"
        text = f"<!doctype html><title>raycam</title><script>location.replace({self._server.invitation()!r})</script>"
        path.touch(mode=0o600)
        path.write_text(text, encoding="utf-8")
        return path

    def _last(self) -> Session | None:
        """The session that was used last."""
        holder = self._widget.views if self._server is None else self._server
        return max(holder.sessions.values(), key=lambda each: each.images.touched, default=None)

    @property
    def camera(self) -> Camera:
        """The camera of the client that was used last; its size may differ from the window's.

        Without clients, the value is the initial camera. Assigning a camera shows it in all clients.
        """
        return (self._last() or self._first).view.camera

    @camera.setter
    def camera(self, camera: Camera) -> None:
        camera = check_camera(camera)
        for session in self._sessions():
            session.set_camera(camera)

    def _sessions(self) -> list[Session]:
        holder = self._widget.views if self._server is None else self._server
        if self._server is not None:
            self._server.scheduler.wake()
        return [self._first, *holder.sessions.values()]

    def screenshot(self, size: tuple[int, int] | None = None, **options: Any) -> Frame:
        """Renders the view of the client that was used last.

        `size` (width, height) is the size of the image (default: the client's size). `options` are those of
        `raycam.render`. Without clients, the initial camera is used. Raises the errors of `raycam.render`.
        """
        view = (self._last() or self._first).view
        camera = view.still_camera if size is None else view.camera.resized(size_of(size))
        own = {"integrator": view.integrator, "exposure": view.exposure, "view": view.transform}
        return render(view.lit, camera, **{**own, **view.render_options, **view.look.behind, **options})

    def record(self, *, fps: float = 10.0, seconds: float = 60.0) -> Recording:
        """Records the view of the client that was used last, up to `fps` times per second.

        The recording ends at `Recording.stop` or `Recording.save`, after `seconds` (at most 600), or when the
        view is closed. Camera, world, time, look, channel and exposure are recorded; `Recording.save` renders
        the images. Without clients, the initial view is recorded, including later assignments to `camera` and
        `world`. Raises `SettingsError` for values out of range.
        """
        made = Recording(
            lambda: (self._last() or self._first).view, title=self._options["title"], fps=fps, seconds=seconds
        )
        self._recordings.add(made)
        return made

    def add_folder(self, name: str) -> Folder:
        """Adds a group of controls to the panel `Script`.

        The returned `Folder` has the same methods `add_...` for controls as this class.
        """
        return self.controls.add_folder(name)

    def add_slider(self, label: str, **options: Any) -> Control:
        """Adds a slider from `min` (0) to `max` (1), with `step` and `value`.

        `options` are `min`, `max`, `step` and `value`. Returns a `Control` with `value` and `on_change`.
        """
        return self.controls.add_slider(label, **options)

    def add_button(self, label: str) -> Control:
        """Adds a button; `on_click` of the returned `Control` adds a callback."""
        return self.controls.add_button(label)

    def add_checkbox(self, label: str, value: bool = False) -> Control:
        """Adds a checkbox with a `label`, which is checked at the start if `value`."""
        return self.controls.add_checkbox(label, value)

    def add_text(self, label: str, value: str = "", *, editable: bool = True) -> Control:
        """Adds a text, which viewers can edit if `editable`."""
        return self.controls.add_text(label, value, editable=editable)

    def add_image(self, label: str, image: npt.ArrayLike) -> Control:
        """Adds an image [h, w, 3] of sRGB bytes; `update(image=...)` replaces the image."""
        return self.controls.add_image(label, image)

    def add_plot(self, label: str, x: npt.ArrayLike, y: npt.ArrayLike) -> Control:
        """Adds a line plot of `y` [n] over `x` [n]; `update(x=..., y=...)` replaces the data."""
        return self.controls.add_plot(label, x, y)

    def add_label(self, text: str, position: npt.ArrayLike, **options: Any) -> Control:
        """Adds a text at a point [3] of the world, in the `color` #rrggbb."""
        return self.controls.add_label(text, position, **options)

    def add_lines(self, points: npt.ArrayLike, **options: Any) -> Control:
        """Adds a line through points [n, 3] of the world, in the `color` #rrggbb."""
        return self.controls.add_lines(points, **options)

    def frame(self) -> Frame | None:
        """The newest still image of the client that was used last, or None.

        The image contains colour, alpha and coverage.
        """
        last = self._last()
        return None if last is None else last.images.still

    def wait(self, *, exit_when_closed: bool = False) -> None:
        """Waits until the view is closed.

        With `exit_when_closed`, the wait also ends 5 seconds after the last client disconnects.
        """
        while self._server is not None and not self._server.join(0.2):
            emptied = self._server.emptied
            if exit_when_closed and emptied is not None and time.monotonic() - emptied > LINGER:
                return

    def on_pick(self, function: Callable[[dict[str, Any]], object]) -> Callable[[dict[str, Any]], object]:
        """Calls `function` with the ground truth of each clicked pixel.

        Returns `function`, so that `on_pick` can be used as a decorator.

        The argument is a dict: `pixel` (column, row), `camera`, and the channels of `Frame` for this pixel as NumPy
        values: `position` [3], `instance` (-1 for the background), `triangle`, `normal` [3] and so on. Functions are
        called one after another on a thread of the view; coroutine functions run in the event loop in which
        `on_pick` is called. An exception is printed and shown in the view. Raises `SettingsError` for a
        coroutine function if no event loop is running.
        """
        self._listeners.append(callback(function))
        return function

    def _pick(self, session: Session, what: Control | Pixel) -> None:
        if isinstance(what, Control):
            self._telling.submit(self._call, session, what)
            return
        camera = what.view.still_camera
        is_inside = what.u < camera.size[0] and what.v < camera.size[1]
        if self._listeners and is_inside and self._free_picks.acquire(blocking=False):
            self._telling.submit(self._tell, session, what.view.world, camera, (what.u, what.v))

    def _call(self, session: Session, control: Control) -> None:
        with _reporting(session, control.label):
            control.call()

    def _tell(self, session: Session, world: World, camera: Camera, pixel: tuple[int, int]) -> None:
        """Calls the functions of `on_pick` with the ground truth of a pixel."""
        try:
            with _reporting(session, "on_pick"):
                seen = truth(world, camera, region=(*pixel, 1, 1), threads=1)
                channels = {name: array[0, 0] for name, array in seen.items()}
                for function in self._listeners:
                    function({"pixel": pixel, "camera": camera, **channels})
        finally:
            self._free_picks.release()

    def close(self) -> None:
        """Disconnects the clients and stops the server or the widget."""
        for each in list(self._recordings):
            each.stop()
        if self._watcher is not None:
            self._watcher.end()
        (self._widget if self._server is None else self._server).close()
        self._telling.shutdown(wait=False)
        if self._redirects is not None:
            self._redirects.cleanup()

    def __enter__(self) -> Viewer:
        """Returns the viewer, which is closed when the block ends."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Closes the viewer."""
        self.close()

    def __repr__(self) -> str:
        """The address as text."""
        return "Viewer in a cell" if self._server is None else f"Viewer at {self.url}"

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """Returns the widget at the end of a cell, and an image for readers without a kernel.

        If the viewer has a server, returns the address. If a program such as nbconvert executes the notebook,
        returns only the image.
        """
        if self._server is not None:
            return {"text/plain": repr(self)}
        picture = (self.frame() or self._first_picture()).to_jpeg()
        from .widget import is_unattended

        image = {"text/plain": repr(self), "image/jpeg": base64.b64encode(picture).decode()}
        if is_unattended():
            return image
        self._widget.still = data_url("image/jpeg", picture)
        self._widget.views.owner = self
        shown = self._widget._repr_mimebundle_(**options)
        data, *more = shown if isinstance(shown, tuple) else (shown,)
        data = {**data, **image}
        return (data, *more) if more else data

    def _first_picture(self) -> Frame:
        """Returns an image by the camera whose longer side has `FIRST_SIDE` pixels."""
        view = self._first.view
        scale = FIRST_SIDE / max(view.camera.size)
        width, height = (max(1, round(side * scale)) for side in view.camera.size)
        quick: dict[str, Any] = {"integrator": "direct", "samples": 4, "ambient_occlusion": False}
        with collected():
            return render(
                view.lit,
                view.camera.resized((width, height)),
                channels="color",
                threads=self._options["threads"],
                **quick,
                **view.look.behind,
            )


def _check(integrator: str | None, samples: int | None) -> None:
    """Raises `SettingsError` for an unknown integrator and an invalid number of samples."""
    if integrator is not None:
        one_of("integrator", integrator, list(DEFAULT_SAMPLES))
    if samples is not None:
        whole("samples", samples, 1, 1 << 16)


def _framed(
    world: World, camera: Camera | None, framing: Mapping[str, Any]
) -> tuple[Camera | None, dict[str, Any]]:
    """Returns the first camera, or None and the arguments of `World.view_from`.

    The arguments are for a camera with the window's shape.
    """
    given = {name: value for name, value in framing.items() if value is not None}
    if camera is None or not given:
        return camera, given
    if "fov" in given:
        raise SettingsError(
            "fov cannot be combined with a camera, which has its own field of view", code="conflicting_values"
        )
    return world.view_from(**given, camera=camera), {}


def _chosen_look(opened: Opened, options: Mapping[str, Any]) -> Look:
    """The look of a view when it starts."""
    world = world_at(opened.edits.world, 0.0, "", "")
    camera, _ = opened.home(world)
    return Look.choose(world, camera, is_framed=opened.fills_window, is_model=opened.is_model, **options)


@contextlib.contextmanager
def _reporting(session: Session, name: str) -> Iterator[None]:
    """Prints an exception of a callback, and shows it in the view; the view continues."""
    try:
        yield
    except Exception as error:
        traceback.print_exc()
        session.complain(f"{name}: the callback failed: {type(error).__name__}: {error}")


def _weakly(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wraps a method without keeping its object alive; returns None when the object is gone."""
    found = weakref.WeakMethod(method)

    def call(*values: Any) -> Any:
        bound = found()
        return None if bound is None else bound(*values)

    return call
