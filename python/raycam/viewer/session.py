"""A session: what one client looks at, and which message changes what.

The server owns the camera. Each change gives the view a new version; a picture of an older version is not sent after
one of a newer version.
"""

from __future__ import annotations

import math
import secrets
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._core import Cancel, __version__
from ..arguments import Floats, one_of, real
from ..camera import Camera
from ..errors import Error, SettingsError, WorldError
from ..explanation.scene_figure import Line
from ..notices import collected
from ..render.frame import VIEWS, Frame
from ..world import World
from .files.uploads import Uploads
from .messages import WIDEST
from .pace import Pace
from .probe import bounds_at, ground_below, point_at
from .scene import navigation
from .scene.contents import names_of_objects
from .scene.copies import FILES, camera_table, camera_text, render_command
from .scene.edits import Edits
from .scene.overlay import MOST_CAMERAS, frusta, grid, polylines
from .scene.selection import Selection
from .stills import COLORS, SAMPLED, TRUTH, Refinement, refinement

__all__ = ["DEFAULT_SAMPLES", "Session", "lens_of", "pose_of"]

LARGEST = (1280, 960)
"""The pixels of a still picture at most."""
DEFAULT_SAMPLES = {"direct": 64, "path": 256}
LINE_PIECES = 24
ORBIT_PER_PIXEL = math.radians(0.35)

Send = Callable[[dict[str, Any], Sequence[bytes]], None]


class Session:
    """The state of one client. Methods are called from the server's thread, the scheduler reads under `lock`."""

    def __init__(
        self,
        world: World | Edits,
        camera: Camera,
        *,
        integrator: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        title: str = "raycam",
        threads: int | None = None,
        source: Path | None = None,
        added: frozenset[str] = frozenset(),
        allows_open: bool = False,
        start: Mapping[str, Any] | None = None,
        picked: Callable[[Session, int, int], None] = lambda session, u, v: None,
    ) -> None:
        """Begins it with what `start` says: `time`, `animation`, `variant`, `channel`, `exposure`, `view`.

        Raises `SettingsError` for what there is not.
        """
        self.source = source
        """The file that the world was loaded from."""
        self.added = added
        """The names of cameras that the file does not have."""
        self.allows_open = allows_open
        self.picked = picked
        """Is told of the pixels that are clicked."""
        self.uploads = Uploads()
        self.edits = world if isinstance(world, Edits) else Edits(world)
        """The world, which other sessions may share, and its changes."""
        self.edits.listen(self)
        world = self.edits.world
        settings = world.render_settings
        self.id = secrets.token_urlsafe(24)
        self.lock = threading.Lock()
        self.world = world
        """The world that is shown."""
        self.time = 0.0
        self.animation = ""
        self.variant = ""
        self.title = title
        self.home = camera
        self.name = next((name for name, each in world.cameras.items() if each == camera), "")
        """The name of the world's camera that is looked through; "" for a free one."""
        self.home_name = self.name
        self.given = camera
        """The camera in its own size, at the pose looked from."""
        self.space = (640, 480)
        self.chosen = size
        """The space of still pictures, whatever a client has; None for that of the client, up to `LARGEST`."""
        if size is not None and (size[0] > WIDEST[0] or size[1] > WIDEST[1]):
            raise SettingsError(
                f"a view shows pictures of at most {WIDEST[0]} x {WIDEST[1]} pixels, not {size[0]} x {size[1]}: "
                "raycam.render makes larger ones"
            )
        self.channel = "color"
        self.exposure = float(settings.get("exposure", 0.0))
        self.view = str(settings.get("view", "standard"))
        chosen = integrator or settings.get("integrator", "direct")
        self.integrator = chosen if chosen in DEFAULT_SAMPLES else "direct"
        self.samples = samples
        self.threads = threads
        self._measure()
        self.pivot: Floats = self.bounds.mean(axis=0)
        self._begin()
        self._told: tuple[Any, ...] = ()
        """The outline of the world that the client was told last."""
        self._start(**{name: value for name, value in (start or {}).items() if value is not None})

    def _begin(self) -> None:
        """Sets what is known of the client and of its pictures: nothing yet."""
        self.pace = Pace()
        self.send: Send | None = None
        """Sends a message to the client; None while none is connected."""
        self.film_stop = threading.Event()
        """Ends the film that is made."""
        self.visible = True
        self.shows_cameras = False
        """True if the world's cameras are drawn over the picture."""
        self.shows_grid = False
        """True if the world's axes and a grid on its ground are drawn over the picture."""
        self.shows_explained = True
        """True if the rays of the explained pixel are drawn over the picture."""
        self.selection = Selection(self.edits)
        self._lines: list[Line] = []
        self.version = 0
        self.touched = 0.0
        """The monotonic time of the last change."""
        self.sent = 0
        self.acknowledged = 0
        self.moved = -1
        """The version that a moving picture has shown."""
        self.shown: tuple[int, str] = (-1, "")
        """Version and channel of the last still picture of a channel of truth."""
        self.refinement: Refinement | None = None
        self.cancel = Cancel()
        """Ends what is rendered of this version."""
        self.still: Frame | None = None
        """The newest picture of samples of this version."""

    def _start(
        self,
        *,
        time: float = 0.0,
        animation: str = "",
        variant: str = "",
        channel: str = "color",
        exposure: float | None = None,
        view: str | None = None,
    ) -> None:
        """Sets what is shown first."""
        animations = [each.name for each in self.base.animations]
        self.time = real("time", time, 0.0, what="seconds")
        if self.time > self.seconds:
            lasts = f"what moves in it lasts {self.seconds:g} s" if self.seconds else "nothing moves in it"
            raise SettingsError(f"the world has no time {self.time:g} s: {lasts}")
        self.animation = one_of("animation", animation, animations) if animation else ""
        self.variant = one_of("variant", variant, self.base.variants) if variant else ""
        self.channel = one_of("channel", channel, (*SAMPLED, *TRUTH))
        if exposure is not None:
            self.exposure = real("exposure", exposure, -100, 100, what="a number of stops")
        if view is not None:
            self.view = one_of("view", view, VIEWS)
        if self.time > 0 or self.animation or self.variant:
            self.world, self.given = self.moment(self.time)

    @property
    def base(self) -> World:
        """The world without a time and a variant."""
        return self.edits.world

    # Pictures ----------------------------------------------------------------------------------------------

    @property
    def size(self) -> tuple[int, int]:
        """The size of the still picture: the camera's sides, scaled to the chosen space or the client's."""
        width, height = self.given.size
        space = self.chosen or (min(self.space[0], LARGEST[0]), min(self.space[1], LARGEST[1]))
        scale = min(space[0] / width, space[1] / height)
        return max(1, round(width * scale)), max(1, round(height * scale))

    @property
    def camera(self) -> Camera:
        """The camera of the still picture."""
        return self.given.resized(self.size)

    def most_samples(self) -> int:
        """The samples at which a still picture is done."""
        return self.samples or DEFAULT_SAMPLES[self.integrator]

    def start_refinement(self) -> Refinement:
        """The refinement of this version, begun where there is none."""
        if self.refinement is None:
            self.refinement = refinement(
                self.world,
                self.camera,
                self.integrator,
                self.most_samples(),
                self.threads,
                SAMPLED if self.channel == "error" else COLORS,
            )
        return self.refinement

    def changed(self) -> None:
        """Begins a new version: the picture starts anew, with a moving one."""
        with self.lock:
            self.version += 1
            self.cancel.cancel()
            self.cancel = Cancel()
            self.touched = time.monotonic()
            self.refinement = None
            self.still = None

    # Messages ----------------------------------------------------------------------------------------------

    def welcome(self) -> dict[str, Any]:
        """The message that begins a session, or tells of another world."""
        self._told = self._outline()
        return {
            "type": "welcome",
            "version": __version__,
            "session": self.id,
            "title": self.title,
            "channels": [{"name": name} for name in (*COLORS[:1], *TRUTH, *COLORS[1:], "error")],
            "cameras": list(self.world.cameras),
            "names": {
                "instance": dict(enumerate(self.object_names)),
                "category": self.world.categories,
            },
            "origin": [0, 0],
            "channel": self.channel,
            "exposure": self.exposure,
            "view": self.view,
            "integrator": self.integrator,
            "explanations": [],
            "opens": self.allows_open,
            "overlay": {
                "cameras": self.shows_cameras,
                "explained": self.shows_explained,
                "grid": self.shows_grid,
            },
            "triangles": self.world.counts["triangles"],
            "time": {"now": self.time, "seconds": self.seconds, "animation": self.animation},
            "animations": [each.name for each in self.base.animations],
            "variants": self.base.variants,
            "variant": self.variant,
            **self.about(),
        }

    def about(self) -> dict[str, Any]:
        """The camera as text, and the notices of the world and of its picture."""
        counts, still = self.world.counts, self.still
        number = ", ".join(
            f"{counts[name]:,} {name if counts[name] != 1 else name[:-1]}"
            for name in ("objects", "triangles")
        )
        notices = [*self.world.notices, *(() if still is None else still.notices)]
        return {
            "about": f"{number}\n\n{self.given!r}",
            "notices": [str(notice) for notice in dict.fromkeys(notices)],
            "camera": self.name,
            "lens": lens_of(self.given),
            "pose": pose_of(self.given),
        }

    def receive(self, message: dict[str, Any]) -> None:
        """Does what a message of `messages.MESSAGES` says. Raises `raycam.Error` for names that are not there."""
        act: dict[str, Callable[[dict[str, Any]], None]] = {
            "size": self._size,
            "nav": self._nav,
            "camera": self._camera,
            "channel": self._channel,
            "display": self._display,
            "time": self._time,
            "variant": self._variant,
            "lens": self._lens,
            "pose": self._pose,
            "overlay": self._overlay,
            "select": self._select,
            "upload": self._upload,
            "gizmo": lambda said: self.selection.drag(self.camera, said, self.id),
            "edit": lambda said: self.edits.edit(
                *(said[name] for name in ("kind", "number", "key", "value"))
            ),
            "undo": lambda said: self.edits.undo(),
            "redo": lambda said: self.edits.redo(),
            "quality": self._quality,
            "ack": self._ack,
            "pick": lambda said: self.picked(self, said["u"], said["v"]),
            "visible": self._visible,
            "stop": lambda said: self.film_stop.set(),
        }
        act[message["type"]](message)

    def _size(self, message: dict[str, Any]) -> None:
        before = self.size
        self.space = (
            max(1, round(message["width"] * message["ratio"])),
            max(1, round(message["height"] * message["ratio"])),
        )
        if self.size != before or self.version == 0:
            self.changed()

    def _camera(self, message: dict[str, Any]) -> None:
        name = message["name"]
        if name and name not in self.world.cameras:
            raise WorldError("there is no camera of this name")
        if name:
            self.given = self._named(name, self.world, self.time)
        self.name = name
        self.changed()

    def _named(self, name: str, world: World, time: float) -> Camera:
        """A camera of the world of a time, where it is then."""
        if self.base.video is not None:
            return self.base.camera_at(self.base.camera(name), time)
        return world.camera(name)

    @property
    def seconds(self) -> float:
        """The duration of the video and the animations; 0 for a world that does not move."""
        video = self.base.video
        return max(
            [0.0 if video is None else video.seconds, *(each.duration for each in self.base.animations)]
        )

    def _time(self, message: dict[str, Any]) -> None:
        if message["animation"] and message["animation"] not in [each.name for each in self.base.animations]:
            raise WorldError("there is no animation of this name")
        self.time, self.animation = min(float(message["t"]), self.seconds), message["animation"]
        self._evaluate()

    def _variant(self, message: dict[str, Any]) -> None:
        if message["name"] and message["name"] not in self.base.variants:
            raise WorldError("there is no variant of this name")
        self.variant = message["name"]
        self._evaluate()

    def moment(self, time: float) -> tuple[World, Camera]:
        """The world of a time and the variant that is chosen, and the camera that is looked through then."""
        world = self.base.with_variant(self.variant) if self.variant else self.base
        if self.seconds > 0:
            world = world.at(time, self.animation or None)
        return world, self._named(self.name, world, time) if self.name else self.given

    def _evaluate(self) -> None:
        """Shows the world of the time and the variant that are chosen."""
        world, camera = self.moment(self.time)
        with self.lock:
            self.world, self.given = world, camera
        self.changed()

    def rebase(self) -> None:
        """Shows the world after an edit, or another world that a script gives."""
        self._measure()
        outline = self._outline()
        if outline != self._told:
            self._forget_what_is_gone()
        self._evaluate()
        if outline != self._told:
            self.send_message(self.welcome())
        self.send_message(self.edits.about())
        self.send_message(self.selection.about())

    def _outline(self) -> tuple[Any, ...]:
        """All that a client is told of a world once: names and times."""
        base = self.base
        animations = tuple((each.name, each.duration) for each in base.animations)
        return (
            tuple(base.cameras),
            self.object_names,
            tuple(base.variants),
            animations,
            self.seconds,
            tuple(base.categories.items()),
        )

    def _forget_what_is_gone(self) -> None:
        """Lets go of the camera, the variant, the animation and the time that the world does not have."""
        base = self.base
        self.name = self.name if self.name in base.cameras else ""
        self.variant = self.variant if self.variant in base.variants else ""
        self.animation = self.animation if self.animation in [each.name for each in base.animations] else ""
        self.time = min(self.time, self.seconds)

    def _measure(self) -> None:
        """Takes note of the world's objects: their names, and where they are."""
        self.object_names = tuple(names_of_objects(self.base))
        bounds = self.base.bounds
        self.bounds = np.array([[-1.0] * 3, [1.0] * 3]) if bounds is None else bounds

    def _upload(self, message: dict[str, Any]) -> None:
        self._require_open()
        name, size = message["name"], message["bytes"]
        if self.uploads.add(name, size, message["offset"], message["data"]):
            self.send_message({"type": "notice", "text": f"{name}: {size:,} bytes are there."})

    def _require_open(self) -> None:
        if not self.allows_open:
            raise SettingsError("this view opens no files: start it with --allow-open (allow_open=True)")

    def open_upload(self, name: str) -> None:
        """Shows the world of an uploaded file, for this client alone. Raises `SettingsError` and those of `load`."""
        self._require_open()
        with collected():
            world = self.uploads.open(name)
            camera = world.default_camera()
        allowed = self.edits.allowed
        self.edits.forget(self)
        with self.lock:
            self.edits = Edits(world, allowed=allowed)
            self.edits.listen(self)
            self.selection = Selection(self.edits)
            self.world, self.title, self.source, self._lines = world, name, None, []
            self.added = frozenset()
            self.time, self.animation, self.variant = 0.0, "", ""
            self.home = self.given = camera
            self.name = next((each for each, found in world.cameras.items() if found == camera), "")
            self.home_name = self.name
            self._measure()
            self.pivot = self.bounds.mean(axis=0)
        self.changed()
        self.send_message(self.welcome())
        self.send_message(self.edits.about())

    def _overlay(self, message: dict[str, Any]) -> None:
        begins = message["cameras"] and not self.shows_cameras
        self.shows_cameras, self.shows_explained = message["cameras"], message["explained"]
        self.shows_grid = message["grid"]
        count = len(self.world.cameras)
        if begins and count > MOST_CAMERAS:
            text = f"The first {MOST_CAMERAS} of {count:,} cameras are drawn."
            self.send_message({"type": "notice", "text": text})
        self.redraw()

    def _select(self, message: dict[str, Any]) -> None:
        self.selection.choose(message["number"], message["tool"])
        self.send_message(self.selection.about())
        self.redraw()

    def show_lines(self, lines: list[Line]) -> None:
        """Draws the rays of an explained pixel over the picture, from wherever it is seen."""
        self._lines = lines
        self.redraw()

    def redraw(self) -> None:
        """Sends the lines over the picture that is shown."""
        overlay = self.overlay(self.camera)
        self.send_message({"type": "overlay", "overlay": overlay})

    def overlay(self, camera: Camera) -> list[dict[str, Any]]:
        """The lines over a picture of `camera`."""
        made = grid(self.bounds, camera) if self.shows_grid else []
        if self.shows_cameras:
            length = 0.15 * float(np.linalg.norm(self.bounds[1] - self.bounds[0]))
            names = [name for name in self.world.cameras if name != self.name][:MOST_CAMERAS]
            made += frusta({name: self._named(name, self.world, self.time) for name in names}, camera, length)
        if self.shows_explained:
            made += [line for line in (drawn(each, camera) for each in self._lines) if line["lines"]]
        return made + self.selection.handles(self.world, camera)

    def follow(self, other: Session) -> None:
        """Looks at what another session of the same world looks at."""
        with self.lock:
            self.world, self.time = other.world, other.time
            self.animation, self.variant = other.animation, other.variant
            self.given, self.name, self.pivot = other.given, other.name, other.pivot
        self.changed()

    def _lens(self, message: dict[str, Any]) -> None:
        K = self.given.K
        K[0, 0], K[1, 1], K[0, 2], K[1, 2] = (float(message[name]) for name in ("fx", "fy", "cx", "cy"))
        self.given = self.given.replace(K=K, distortion=message["distortion"] or None)
        self.name = ""
        self.changed()

    def _pose(self, message: dict[str, Any]) -> None:
        roll, pitch, yaw = (float(message[name]) for name in ("roll", "pitch", "yaw"))
        place = message["location"]
        posed = Camera.from_pose(place, roll, pitch, yaw, size=(2, 2), focal=1, up=self.given.up)
        self._go(self.given.at_pose(posed.R, posed.location))

    def _channel(self, message: dict[str, Any]) -> None:
        if message["name"] not in (*SAMPLED, *TRUTH):
            raise WorldError(f"the live view has no channel {message['name']}")
        anew = (message["name"] == "error") != (self.channel == "error")
        with self.lock:
            self.channel = message["name"]
            self.shown = (-1, "")
        if anew:  # the estimate of the error takes samples of its own
            self.changed()

    def _display(self, message: dict[str, Any]) -> None:
        self.exposure, self.view = float(message["exposure"]), message["view"]

    def _quality(self, message: dict[str, Any]) -> None:
        self.integrator = message["integrator"]
        self.changed()

    def _ack(self, message: dict[str, Any]) -> None:
        self.acknowledged = max(self.acknowledged, min(message["picture"], self.sent))

    def _visible(self, message: dict[str, Any]) -> None:
        self.visible = message["visible"]

    def _nav(self, message: dict[str, Any]) -> None:
        camera, kind = self.camera, message["kind"]
        dx, dy, dz = (float(message[name]) for name in ("dx", "dy", "dz"))
        if kind == "orbit":
            moved = navigation.orbit(camera, self.pivot, -dx * ORBIT_PER_PIXEL, -dy * ORBIT_PER_PIXEL)
        elif kind == "look":
            moved = navigation.turn_camera(camera, -dx * ORBIT_PER_PIXEL, -dy * ORBIT_PER_PIXEL)
        elif kind == "pan":
            moved = navigation.pan(camera, self.pivot, dx, dy)
        elif kind == "move":
            moved = navigation.move(camera, *(self._pace_of_flight() * step for step in (dx, dy, dz)))
        elif kind == "walk":
            step = self._pace_of_flight()
            below = partial(ground_below, self.world, camera, foot=step / 2)
            moved = navigation.walk(camera, dx * step, dy * step, dz * step, below)
        elif kind == "roll":
            moved = navigation.roll(camera, math.radians(dx))
        elif kind == "dolly":
            moved = self._dollied(camera, message, 1.15 ** max(-20.0, min(20.0, dz)))
        elif kind == "pivot":
            point = point_at(self.world, camera, message["u"], message["v"])
            if point is not None:
                self.pivot = point
            return
        elif kind in ("fit", "frame"):
            within = bounds_at(self.world, camera, message["u"], message["v"]) if kind == "frame" else None
            within = self.bounds if within is None else within
            self.pivot = within.mean(axis=0)
            moved = navigation.fit(self.given, within)
        else:
            self.pivot = self.bounds.mean(axis=0)
            if self.home_name in self.world.cameras:
                self._camera({"name": self.home_name})
                self.send_message({"type": "about", **self.about()})
                return
            self.given = moved = self.home
        self._go(moved)

    def _dollied(self, camera: Camera, message: dict[str, Any], factor: float) -> Camera:
        """Nearer to the point under the pointer; beside everything, along the view to the pivot.

        A camera of parallel rays sees things larger instead.
        """
        if camera.is_parallel:
            origin, _ = camera.rays(np.array([message["u"], message["v"]]) + camera.corner)
            return navigation.magnified(self.given, origin, factor)
        point = point_at(self.world, camera, message["u"], message["v"])
        if point is None:
            distance = float(np.linalg.norm(self.pivot - camera.location))
            origin, direction = camera.rays(np.array([message["u"], message["v"]]) + camera.corner)
            point = origin + distance * (direction if np.isfinite(direction).all() else camera.forward)
        return navigation.dolly(camera, point, factor)

    def _pace_of_flight(self) -> float:
        """Metres of a step: a share of the world's size."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0])) / 100

    def _go(self, moved: Camera) -> None:
        if np.isfinite(moved.location).all() and np.isfinite(moved.R).all():
            is_scaled = moved.is_parallel and moved.size == self.given.size
            self.given = moved if is_scaled else self.given.at_pose(moved.R, moved.location)
            self.name = ""
            self.changed()

    # Answers -----------------------------------------------------------------------------------------------

    def copied(self, format: str) -> str:
        """The camera as text, with all digits. Raises `FormatError` where the format does not hold it."""
        if format == "command":
            return self._command()
        if format in FILES:
            text, notices = camera_text(self.given, format)
            for notice in notices:
                self.send_message({"type": "notice", "text": str(notice)})
            return text
        if format == "python":
            return f"camera = raycam.Camera.from_dict({self.given.to_dict()!r}, up={self.given.up!r})"
        return camera_table(self.given)

    def _command(self) -> str:
        """The command that renders what rests: by the camera's name, or by a calibration of its own."""
        if self.base is not self.edits.opened:
            text = "The file does not have the edits that were made here: Save TOML or Save GLB writes one that has."
            self.send_message({"type": "notice", "text": text})
        if self.source is None:
            text = "This world has no file here: put the name of one in the place of the first word after render."
            self.send_message({"type": "notice", "text": text})
        settings, named = self.base.render_settings, "" if self.name in self.added else self.name
        width, height = self.size
        options = {
            "size": f"{width}x{height}",
            "integrator": self.integrator,
            "samples": self.most_samples(),
            "at": self.time if self.seconds > 0 else None,
            "animation": self.animation or None,
            "variant": self.variant or None,
            "exposure": self.exposure if self.exposure != settings.get("exposure", 0.0) else None,
            "view": self.view if self.view != settings.get("view", "standard") else None,
        }
        return render_command(self.source or self.title, named or self._at_the_start(), options)

    def _at_the_start(self) -> Camera:
        """The free camera as it was before the motion of the video, with which `raycam render --at` moves it."""
        if self.base.video is None:
            return self.given
        before = self.base.camera_at(self.given, -self.time)
        if not np.allclose(self.base.camera_at(before, self.time).P, self.given.P, rtol=1e-9, atol=1e-9):
            text = f"The video moves its camera: at {self.time:.6g} s the command shows what that camera sees then."
            self.send_message({"type": "notice", "text": text})
        return before

    def send_message(self, message: dict[str, Any], buffers: Sequence[bytes] = ()) -> None:
        """Sends a message, if a client is connected."""
        send = self.send
        if send is not None:
            send(message, buffers)

    def complain(self, error: Error) -> None:
        """Tells the client of an error."""
        self.send_message({"type": "error", "text": str(error)})


def drawn(line: Line, camera: Camera) -> dict[str, Any]:
    """A line of the world in pixels of a camera."""
    spread = np.linspace(0, 1, LINE_PIECES + 1)[:, None]
    pieces = [a + spread * (b - a) for a, b in zip(line.points[:-1], line.points[1:], strict=True)]
    return {"name": line.name, "color": line.color, "lines": polylines(pieces, camera)}


def pose_of(camera: Camera) -> dict[str, Any]:
    """Location, metres, and roll, pitch and yaw, degrees, of a camera."""
    roll, pitch, yaw = (float(angle) for angle in camera.roll_pitch_yaw)
    return {"location": camera.location.tolist(), "roll": roll, "pitch": pitch, "yaw": yaw}


COEFFICIENTS = {
    "opencv": ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tx", "ty"],
    "fisheye": ["k1", "k2", "k3", "k4"],
}
"""The names of coefficients by lens model; of others they are numbered."""


def lens_of(camera: Camera) -> dict[str, Any]:
    """Intrinsics and distortion of a camera in its own size, as the client's sliders have them."""
    K = camera.K
    coefficients = [] if camera.distortion is None else [float(value) for value in camera.distortion]
    names = COEFFICIENTS.get(camera.model, [])
    names = names if len(names) >= len(coefficients) else [str(i) for i in range(len(coefficients))]
    return {
        "model": camera.model,
        **{"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]},
        "distortion": coefficients,
        "names": names[: len(coefficients)],
    }
