"""A session: executes a client's messages, and sends changes to the client."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..._core import __version__
from ...arguments import one_of
from ...camera import Camera
from ...errors import Error, SettingsError, WorldError
from ...explanation.scene_figure import Line
from ...notices import collected
from ...render.frame import Frame
from ...world import World
from .. import client_messages as messages
from ..client_messages import MAX_IMAGE_SIZE, Message, chosen_slot
from ..controls import Control, Controls
from ..files.photographs import Photographs
from ..files.uploads import LIGHT_IMAGES, Uploads, file_types, is_image
from ..probe import ground_below, locate
from ..scene.edits import READ_ONLY, Edits
from ..scene.look import Look
from ..scene.overlay import MAX_CAMERAS
from ..scene.scan_points import ScanPoints, lidar_names
from ..scene.selection import Selection
from ..scene.textures import set_texture
from ..stills import SAMPLED, TRUTH
from .connection import Connection
from .history import History
from .images import Images
from .overlays import Overlays
from .panes import Pane, update_panes
from .role import Role
from .sent_views import Pixel
from .view import Opened, View

__all__ = ["Session"]

NO_SCAN = {"type": "scan", "lidar": "", "total": 0, "fields": {}}
"""The message for a missing scan, or for a scan of a world that is no longer shown."""


class Session:
    """One client: its connection, its view and its images.

    The client's messages are handled on one thread, and the images are rendered on another thread.
    """

    def __init__(
        self,
        world: World | Edits,
        camera: Camera | None = None,
        *,
        integrator: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        title: str = "raycam",
        threads: int | None = None,
        source: Path | None = None,
        added: frozenset[str] = frozenset(),
        allows_open: bool = False,
        photographs: Photographs | None = None,
        start: dict[str, Any] | None = None,
        framing: Mapping[str, Any] | None = None,
        look: Look | None = None,
        is_model: bool = False,
        controls: Controls | None = None,
        picked: Callable[[Session, Control | Pixel], None] = lambda session, what: None,
    ) -> None:
        """Starts a session with `camera` and the values in `start`, see `View.start`.

        If `camera` is None, the session starts with the world's default camera. `picked` is called for each
        clicked pixel and each changed control.

        Raises `SettingsError` for unknown values.
        """
        if size is not None and (size[0] > MAX_IMAGE_SIZE[0] or size[1] > MAX_IMAGE_SIZE[1]):
            raise SettingsError(
                f"size {size[0]} x {size[1]} is too large for a view: the limit is {MAX_IMAGE_SIZE[0]} x "
                f"{MAX_IMAGE_SIZE[1]}; raycam.render creates larger images",
                code="out_of_range",
            )
        edits = world if isinstance(world, Edits) else Edits(world)
        opened = Opened(edits, title, source, added, camera, framing or {}, size, is_model)
        self.connection = Connection()
        self.images = Images(samples, threads)
        self.uploads = Uploads()
        self._photographs = photographs
        self.lock = threading.Lock()
        """Held while the view and its version change together."""
        self.selection = Selection(edits)
        self.overlays = Overlays()
        self.panes: tuple[Pane, ...] = ()
        """The cameras that are shown at once; empty if only the main view is shown."""
        self.history = History()
        self._picked = picked
        self.controls = Controls() if controls is None else controls
        self._changes = threading.RLock()
        self._outline: tuple[Any, ...] = ()
        # A script may replace the world on another thread. The new world waits until this session can show it.
        with edits.lock:
            self.view = View.start(opened, integrator=integrator, start=start, look=look)
            self.role = Role(self.images, self.view.space, allows_open)
            edits.listen(self)
        self.controls.listen(self)

    # The view ---------------------------------------------------------------------------------------------

    def snapshot(self) -> tuple[View, int]:
        """The view and its version, which belong together."""
        with self.lock:
            return self.view, self.images.version

    def view_of_image(self, image: int) -> tuple[View, Frame | None] | None:
        """Returns the view and the newest still image of an image that the client shows.

        The still image is None for an older view than the current view. The result is None if the image is unknown or
        shows a world that is no longer open.
        """
        with self.lock:
            view, images = self.view, self.images
            sent = images.sent.find(image)
            is_current = images.sent.newest == (image, images.version)
            still = images.still if is_current else None
        return None if sent is None or sent.opened.edits is not view.opened.edits else (sent, still)

    def require_image(self, image: int) -> View:
        """Returns the view of an image. Raises `SettingsError` if the image is out of date."""
        found = self.view_of_image(image)
        if found is None:
            raise SettingsError("image: out of date; click again in the new image", code="out_of_range")
        return found[0]

    def show(self, view: View) -> None:
        """Shows another view and sends the changes to the client.

        Images are restarted if the other view has different images.
        """
        with self._changes:
            before = self.view
            with self.lock:
                self.view = view
                if not view.renders_like(before) or self.images.version == 0:
                    self.images.restart()
                if self.panes and view is not before:
                    self._update_panes([each.name for each in self.panes])
            self._send_changes(before)
            if self.role.on_show is not None:
                self.role.on_show()

    def mirror(self, leader: Session, held: tuple[int, int] | None, *, begins: bool = False) -> None:
        """Shows the view, the images and the held pixel of another session.

        Changes are sent to the client; if the session `begins` to follow, camera, look and display are always sent.
        """
        with self._changes:
            before = self.view
            with self.lock:
                self.role.is_attached, self.view, self.images = True, leader.view, leader.images
                self.panes = ()
            if begins:
                self.role.own_images.cancel.cancel()
                self.overlays = Overlays()
                self.selection = Selection(self.view.opened.edits)
                self.role.display = {}
            self._send_changes(before)
            if begins:
                self.send_camera()
                self.send_look()
            elif self.view.look is not before.look or self.view.integrator != before.integrator:
                self.send_look()
            self.show_display(held)

    def look_around(self) -> None:
        """Continues with the session's own view and images, after it has followed another session."""
        with self._changes:
            with self.lock:
                self.role.is_attached, self.images = False, self.role.own_images
                self.view = self.view.with_space(self.role.space)
                self.images.restart()
            self.send_camera()
            self.redraw()

    def show_display(self, held: tuple[int, int] | None) -> None:
        """Sends the leader's channel, display, time and held pixel, if they have changed."""
        view = self.view
        shown = {
            "channel": view.channel,
            "exposure": view.exposure,
            "view": view.transform,
            "time": view.time,
            "held": held,
        }
        if shown != self.role.display:
            self.role.display = shown
            self.connection.send({"type": "display", **shown})

    def _send_changes(self, before: View) -> None:
        """Sends the changes of the view; keeps the selection and the history of the same world."""
        view = self.view
        if view.opened.edits is not before.opened.edits:
            before.opened.edits.forget(self)
            view.opened.edits.listen(self)
            self.selection = Selection(view.opened.edits)
            self.history = History()
        if view.world is not before.world or view.integrator != before.integrator:
            self.overlays = replace(self.overlays, rays=())
        if view.world is not before.world and self.overlays.scan is not None:
            self.overlays = replace(self.overlays, scan=None)
            self.connection.send(NO_SCAN)
        if view.outline() != self._outline:
            self.greet()
        elif view.camera is not before.camera or view.bounds is not before.bounds or view.size != before.size:
            self.send_camera(is_moving=True)

    def greet(self) -> None:
        """Sends the complete view to the client."""
        self._outline = self.view.outline()
        self.connection.send(self.welcome())
        self._send_contents()
        self.send_history()
        self.connection.send(self.controls.message())

    def _send_contents(self) -> None:
        contents = self.view.opened.edits.about()
        self.connection.send({**contents, "editable": contents["editable"] and not self.role.is_read_only})

    def show_controls(self) -> None:
        """Sends the script's controls, and the lines over the image."""
        self.connection.send(self.controls.message())
        self.redraw()

    def _change_control(self, message: messages.Control) -> None:
        self._picked(self, self.controls.set_from_client(message.id, message.value))

    def welcome(self) -> dict[str, Any]:
        """The message `welcome`, which starts a session or announces another world."""
        return {
            "type": "welcome",
            "version": __version__,
            "session": self.connection.id,
            "opens": file_types() if self.role.allows_open else None,
            "photographs": self._photographed(),
            "overlay": {
                "cameras": self.overlays.cameras,
                "explained": self.overlays.explained,
                "grid": self.overlays.grid,
            },
            "lidars": lidar_names(self.view.base),
            **self.view.welcome(),
            **self.about(),
            "camera": self.view.camera_message(self.connection.cameras.last_move),
        }

    def about(self) -> dict[str, Any]:
        """The camera as text, and the notices of the world and the still image."""
        still = self.images.still
        notices = [*self.view.world.notices, *(() if still is None else still.notices)]
        added = [each for each in (self.view.look.notice(), self.view.up_notice()) if each is not None]
        notices += [*self.view.opened.placement.texts, *added]
        return {"about": self.view.about(), "notices": list(dict.fromkeys(map(str, notices)))}

    def check_placement(self) -> None:
        """Shows a notice if most of the world's cameras do not show the world."""
        placement = self.view.opened.placement
        before = placement.texts
        for text in placement.check(self.view.base):
            self.notify(text)
        if placement.texts != before:
            self.connection.send({"type": "about", **self.about()})

    def send_camera(self, *, is_moving: bool = False) -> None:
        """Sends the current camera of the view.

        While the camera is moving, at most one message is sent for each image.
        """
        message = self.view.camera_message(self.connection.cameras.last_move)
        self.connection.send_camera(message, is_moving=is_moving)

    def rebase(self) -> None:
        """Shows the world after an edit, or another world from a script."""
        with self._changes:
            if not self.role.is_attached:  # an attached follower shows the leader's view
                self.show(self.view.rebased())
        self._send_contents()
        self.send_history()
        self.connection.send(self.selection.about())

    def send_history(self) -> None:
        """Sends the numbers of steps that can be undone and repeated."""
        edits = self.view.opened.edits.about()
        undo, redo = self.history.counts
        message = {"type": "history", "undo": undo + edits["undo"], "redo": redo + edits["redo"]}
        self.connection.send(message)

    def _undo(self, message: messages.Undo) -> None:
        """Undoes the newest step: of this client's view, or of the world."""
        edits = self.view.opened.edits
        if self.history.undo_number > edits.undo_number:
            self._restore(self.history.undo(self.view))
        else:
            edits.undo()

    def _redo(self, message: messages.Redo) -> None:
        """Repeats the step that was undone last."""
        edits = self.view.opened.edits
        if self.history.redo_number < edits.redo_number:
            self._restore(self.history.redo(self.view))
        else:
            edits.redo()

    def _restore(self, view: View) -> None:
        self.show(view)
        self.send_camera()
        self.send_look()
        self.send_history()

    def send_look(self) -> None:
        """Sends look, exposure, integrator and variant, which the client's controls show."""
        view = self.view
        own = {
            "look": view.look.describe(),
            "exposure": view.exposure,
            "integrator": view.integrator,
            "variant": view.variant,
        }
        self.connection.send({"type": "look", **own, **self.about()})

    def open_upload(self, name: str, more: Sequence[str] = ()) -> None:
        """Opens an uploaded file for this client, with `more` models in the same world.

        Raises `SettingsError` and the errors of `raycam.load`.
        """
        self._require_open()
        with collected():
            world, is_model = self.uploads.open(name, more)
        edits = Edits(world, allowed=self.view.opened.edits.allowed)
        opened = Opened(edits, name, fixed_size=self.view.opened.fixed_size, is_model=is_model)
        view = View.start(opened)
        with self._changes:
            self.show(view.with_space(self.view.space))

    def _photographed(self) -> list[str]:
        """The cameras of the world that have a photograph."""
        named = [] if self._photographs is None else self._photographs.cameras
        return [name for name in named if name in self.view.base.cameras]

    def send_photograph(self, name: str) -> None:
        """Sends the photograph of a camera. Raises `SettingsError` and the errors of its file."""
        view = self.view
        if self._photographs is None or name not in self._photographed():
            raise SettingsError(f"camera {name} has no photograph", code="missing_photograph")
        data, notices = self._photographs.jpeg(name, view.camera_of(name))
        self.connection.send({"type": "photograph", "camera": name}, [data])
        for text in notices:
            self.notify(text)

    def _require_open(self) -> None:
        if not self.role.allows_open:
            raise SettingsError(
                "this view cannot open files: start it with --allow-open (allow_open=True)", code="read_only"
            )

    # Messages ---------------------------------------------------------------------------------------------

    def receive(self, message: Message) -> None:
        """Carries out a message. Raises `raycam.Error` for names that do not exist."""
        with self._changes:
            before = self.view
            self.ACTIONS[type(message)](self, message)
            if self.history.record(message, before, self.view):
                self.send_history()

    def _resize(self, message: messages.Size) -> None:
        space = (
            max(1, round(message.width * message.ratio)),
            max(1, round(message.height * message.ratio)),
        )
        self.role.space = space
        if not self.role.is_attached:
            self.show(self.view.with_space(space))

    def _move(self, message: messages.Move) -> None:
        self.connection.cameras.last_move = message.seq
        try:
            view = self.view.moved(
                np.reshape(message.R, (3, 3)),
                np.array(message.C, float),
                message.fx,
                np.array(message.pivot, float),
            )
        except Error:
            self.send_camera()  # the client returns to the last valid pose
            raise
        self.show(view)

    def _update_panes(self, names: Sequence[str]) -> None:
        own = self.role.own_images
        self.panes = update_panes(self.panes, names, self.view, own.samples, own.threads)

    def _show_panes(self, message: messages.Panes) -> None:
        for name in filter(None, message.names):
            one_of("camera", name, list(self.view.base.cameras), error=WorldError)
        with self.lock:
            self._update_panes(message.names)
            for each in self.panes:
                each.images.show_again()  # the client may have reconnected

    def _go_home(self, message: messages.Home) -> None:
        self.connection.cameras.last_move = message.seq
        self.show(self.view.at_home())
        self.send_camera()

    def _locate(self, message: messages.Locate) -> None:
        known = self.view_of_image(message.image)
        view = self.view if known is None else known[0]
        found = locate(view.world, view.still_camera, message.u, message.v)
        self.connection.send({"type": "answer", "id": message.id, **found})

    def _pick(self, message: messages.Pick) -> None:
        self._picked(self, Pixel(self.require_image(message.image), message.u, message.v))

    def _find_ground(self, message: messages.Ground) -> None:
        view = self.view
        below = [
            ground_below(view.world, view.camera, np.array(place, float), message.foot)
            for place in (message.begin, message.end)
        ]
        self.connection.send({"type": "answer", "id": message.id, "below": below})

    def _choose_channel(self, message: messages.Channel) -> None:
        if message.name not in (*SAMPLED, *TRUTH):
            raise WorldError(f"channel {message.name} is not available in the live view", code="unknown_name")
        with self.lock:
            self.images.show_again()
        self.show(replace(self.view, channel=message.name))

    def _set_display(self, message: messages.Display) -> None:
        before = self.view.exposure, self.view.transform
        self.show(replace(self.view, exposure=float(message.exposure), transform=message.view))
        if (
            before != (message.exposure, message.view)
            and self.view.channel == "color"
            and not self.connection.wants_planes
        ):
            with self.lock:
                self.images.show_moving_again()

    def _send_planes(self, message: messages.Planes) -> None:
        if self.connection.request_planes(message.wanted):
            with self.lock:
                self.images.show_again()

    def _set_overlay(self, message: messages.Overlay) -> None:
        count = len(self.view.base.cameras)
        if message.cameras and not self.overlays.cameras and count > MAX_CAMERAS:
            self.notify(f"Showing the first {MAX_CAMERAS} of {count:,} cameras.")
        self.overlays = replace(
            self.overlays, cameras=message.cameras, explained=message.explained, grid=message.grid
        )
        self.redraw()

    def _forget_rays(self, message: messages.Forget) -> None:
        if self.overlays.rays:
            self.overlays = replace(self.overlays, rays=())
            self.redraw()

    def _select(self, message: messages.Select) -> None:
        self.selection.choose(message.number, message.tool, chosen_slot(message.slot))
        self.connection.send(self.selection.about())
        self.redraw()

    def _upload(self, message: messages.Upload) -> None:
        if not (self.view.opened.edits.allowed and is_image(message.name, LIGHT_IMAGES)):
            self._require_open()
        if self.uploads.add(message.name, message.bytes, message.offset, message.data):
            self.notify(f"{Path(message.name).name}: received {message.bytes:,} bytes.")

    def _select_light(self, message: messages.SelectLight) -> None:
        self.selection.choose_light(message.number)
        self.redraw()

    def _set_texture(self, message: messages.Texture) -> None:
        edits = self.view.opened.edits
        if not edits.allowed:
            raise SettingsError(READ_ONLY, code="read_only")
        file = self.uploads.image(message.file) if message.file else None
        edits.replace(
            set_texture(edits.world, message.number, message.texture, file, chosen_slot(message.slot))
        )

    def _keep_camera(self, message: messages.KeepCamera) -> None:
        name = self.view.opened.edits.keep_camera(self.view.camera, message.name)
        self.show(self.view.through(name))
        self.send_camera()
        self.notify(f'Added the camera "{name}" to the world.')

    def _remove_camera(self, message: messages.RemoveCamera) -> None:
        self.view.opened.edits.remove_camera(message.name)

    def _edit(self, message: messages.Edit) -> None:
        self.view.opened.edits.edit(message.kind, message.number, message.key, message.value)

    def _edit_material(self, message: messages.EditMaterial) -> None:
        self.view.opened.edits.edit_material(
            message.number, chosen_slot(message.slot), message.key, message.value
        )

    def _drag(self, message: messages.Gizmo) -> None:
        self.selection.drag(self.view.still_camera, message, self.connection.id)

    def _set_up(self, message: messages.TurnUp) -> None:
        self.view.opened.edits.set_up(message.axis)
        self.send_camera()

    def _set_look(self, message: messages.Look) -> None:
        old = self.view.look
        kept = old.background if old.has_background_image else None
        backgrounds = {"light": None, "color": message.background or "#ffffff", "image": kept}
        look = old.changed(
            light=message.light,
            rotation=float(message.rotation),
            sun=(float(message.azimuth), float(message.elevation)),
            ground=(message.ground_color or "#808080") if message.ground == "color" else message.ground,
            background=backgrounds[message.backdrop],
        )
        self._show_look(look)

    def _set_look_image(self, message: messages.LookImage) -> None:
        file = self.uploads.keep_image(message.file)
        old = self.view.look
        changed: dict[str, Any] = (
            {"light": "sky", "image": file} if message.use == "light" else {"background": file}
        )
        look = old.changed(**changed, uploaded=(*old.uploaded, file))
        with collected() as notices, self.uploads.hidden_path(file):
            look.check(self.view.world, self.view.camera)
        for notice in notices:
            self.notify(self.uploads.without_path(str(notice), file))
        self._show_look(look)

    def _show_look(self, look: Look) -> None:
        before = self.view.exposure
        self.show(self.view.with_look(look))
        self.send_look()
        if self.view.exposure != before:
            self.notify(
                f"The exposure is now {self.view.exposure:g} stops, because the choice of light changes the image's "
                "brightness."
            )

    def set_camera(self, camera: Camera) -> None:
        """Shows the view of a camera that the script chose, in the camera's own shape."""
        with self._changes:
            if not self.role.is_attached:
                self.show(replace(self.view, camera=camera, camera_name="", shape="own"))
                self.send_camera()

    def _view_from(self, message: messages.FromSide) -> None:
        self.connection.cameras.last_move = message.seq
        self.show(self.view.from_side(message.name))
        self.send_camera()

    def _frame(self, message: messages.Framing) -> None:
        self.connection.cameras.last_move = message.seq
        try:
            self.show(self.view.framed(float(message.zoom), float(message.fov)))
        finally:
            self.send_camera()  # after an error, the client returns to its last valid camera

    def _look_through(self, message: messages.LookThrough) -> None:
        self.connection.cameras.last_move = message.seq
        try:
            self.show(self.view.through(message.name))
        finally:
            self.send_camera()  # after an error, the client returns to its last valid camera

    def _set_lens(self, message: messages.Lens) -> None:
        self.show(self.view.with_lens(message.fx, message.fy, message.cx, message.cy, message.distortion))

    def _set_pose(self, message: messages.Pose) -> None:
        self.show(self.view.with_pose(message.location, message.roll, message.pitch, message.yaw))

    ACTIONS: ClassVar[dict[type[Message], Callable[[Session, Any], None]]] = {
        messages.Size: _resize,
        messages.Move: _move,
        messages.Home: _go_home,
        messages.Locate: _locate,
        messages.Ground: _find_ground,
        messages.LookThrough: _look_through,
        messages.Panes: _show_panes,
        messages.Look: _set_look,
        messages.LookImage: _set_look_image,
        messages.RestoreLook: lambda self, message: self._show_look(self.view.look.restored()),
        messages.TurnUp: _set_up,
        messages.FromSide: _view_from,
        messages.Framing: _frame,
        messages.Channel: _choose_channel,
        messages.Display: _set_display,
        messages.Time: lambda self, message: self.show(self.view.at(message.t, message.animation)),
        messages.Variant: lambda self, message: self.show(self.view.with_variant(message.name)),
        messages.Lens: _set_lens,
        messages.Pose: _set_pose,
        messages.Overlay: _set_overlay,
        messages.Forget: _forget_rays,
        messages.Select: _select,
        messages.Upload: _upload,
        messages.Gizmo: _drag,
        messages.SelectLight: _select_light,
        messages.Texture: _set_texture,
        messages.KeepCamera: _keep_camera,
        messages.RemoveCamera: _remove_camera,
        messages.Edit: _edit,
        messages.EditMaterial: _edit_material,
        messages.Undo: _undo,
        messages.Redo: _redo,
        messages.Quality: lambda self, message: self.show(replace(self.view, integrator=message.integrator)),
        messages.Acknowledge: lambda self, message: self.connection.acknowledge(message.picture),
        messages.Planes: _send_planes,
        messages.Control: _change_control,
        messages.Pick: _pick,
        messages.Visible: lambda self, message: self.connection.set_visible(message.visible),
        messages.Stop: lambda self, message: self.connection.film_stop.set(),
    }
    """The action of each message; `answers` handles the other messages."""

    # Lines over the image ---------------------------------------------------------------------------------

    def show_rays(self, rays: list[Line], world: World) -> None:
        """Draws the rays of an explained pixel over the image.

        If the view no longer shows `world`, this method has no effect.
        """
        with self._changes:
            if self.view.world is not world:
                return
            self.overlays = replace(self.overlays, rays=tuple(rays))
        self.redraw()

    def show_scan(self, scan: ScanPoints | None, world: World) -> None:
        """Draws the points of a scan of `world`; None removes them.

        If the view shows another world, the client requests a new scan.
        """
        with self._changes:
            current = scan if self.view.world is world else None
            self.overlays = replace(self.overlays, scan=current)
        self.connection.send(NO_SCAN if current is None else current.message())
        self.redraw()

    def redraw(self) -> None:
        """Sends the lines over the current image again."""
        self.connection.broadcast({"type": "overlay", "overlay": self.overlay(self.view)})

    def overlay(self, view: View) -> list[dict[str, Any]]:
        """The lines over the still image of a view."""
        drawn = self.overlays.drawn(view, self.controls.lines())
        return [*drawn, *self.selection.handles(view.world, view.still_camera)]

    # Answers ----------------------------------------------------------------------------------------------

    def notify(self, text: str) -> None:
        """Shows a notice in the client."""
        self.connection.send({"type": "notice", "text": text})

    def complain(self, text: str) -> None:
        """Shows an error in the client."""
        self.connection.send({"type": "error", "text": text})
