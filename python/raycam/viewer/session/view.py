"""The view of a client: an immutable state, from which each message creates the next state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..._core import lens_coefficients
from ...arguments import Floats, one_of, real
from ...camera import Camera
from ...errors import Notice, SettingsError, WorldError
from ...render.frame import VIEWS
from ...world import World
from ..scene.contents import names_of_objects
from ..scene.edits import Edits
from ..scene.look import Look
from ..stills import COLORS, LIT_CHANNELS, SAMPLED, TRUTH
from .placement_check import PlacementCheck

__all__ = ["MAX_STILL_SIZE", "Opened", "View", "lens_of", "pose_of", "world_at"]

MAX_STILL_SIZE = (2560, 1600)
"""The largest still image, in pixels, unless the script chooses a size."""
FIRST_SPACE = (640, 480)
"""The space for the image until the client reports its own."""


@dataclass(frozen=True, eq=False)
class Opened:
    """The open world and its initial view."""

    edits: Edits
    """The world with its changes; several sessions may share it."""
    title: str = "raycam"
    source: Path | None = None
    """The file that the world was loaded from."""
    added: frozenset[str] = frozenset()
    """The names of cameras that the file does not contain."""
    camera: Camera | None = None
    """The first camera; None for the world's first camera, or for a camera that frames the world."""
    camera_name: str = field(init=False, default="")
    """The name of the first camera, if it belongs to the world; it is kept if the world's file is loaded again."""
    framing: Mapping[str, Any] = field(default_factory=dict)
    """The arguments of `World.view_from` for a camera that frames the world: `direction`, `zoom`, `fov`."""
    fixed_size: tuple[int, int] | None = None
    """The space for images that the script chose, instead of the space in the client's window."""
    is_model: bool = False
    """True if the world comes from model files, whose lights may need surroundings; see `Look.choose`."""
    placement: PlacementCheck = field(init=False, default_factory=PlacementCheck)
    """The check that the world's cameras show the world."""

    def __post_init__(self) -> None:
        """Finds the name of the first camera."""
        named = self.edits.world.cameras if self.camera is not None else {}
        name = next((name for name, each in named.items() if each == self.camera), "")
        object.__setattr__(self, "camera_name", name)

    @property
    def fills_window(self) -> bool:
        """True if the first camera frames the world and therefore has the shape of the window."""
        base = self.edits.world
        return (
            self.camera is None
            and base.bounds is not None
            and bool(self.framing or base._first_camera is None)
        )

    @property
    def first_shape(self) -> Literal["own", "home"]:
        """The shape of the first camera: its own shape, or the window's shape ("home")."""
        return "home" if self.fills_window and self.fixed_size is None else "own"

    def home(self, world: World, size: tuple[int, int] = FIRST_SPACE) -> tuple[Camera, str]:
        """Returns the view's first camera and its name, which is empty if the camera is not one of the world's.

        A camera that raycam placed shows all of the current `world`; if it fills the window, its size is `size`.
        """
        base = self.edits.world
        if self.fills_window:
            return world.view_from(size=size, **self.framing), ""
        if self.camera_name in base.cameras:
            return base.cameras[self.camera_name], self.camera_name
        camera = base.default_camera() if self.camera is None else self.camera
        for name, each in base.cameras.items():
            if each == camera:
                return each, name
        has_own = base._first_camera is not None or base.bounds is None
        is_framed = not has_own and camera == base.default_camera(camera.size)
        return (world.default_camera(camera.size) if is_framed else camera), ""


@dataclass(frozen=True, eq=False)
class View:
    """The complete state of a client's view.

    `View.start` creates a view; the other methods return changed copies.
    """

    opened: Opened
    world: World
    """The world at the chosen time, with the chosen variant."""
    camera: Camera
    """The camera, with its own size instead of the size of the client's window."""
    camera_name: str
    """The name of the world's camera that provides the view; empty for a free camera."""
    pivot: Floats
    """The point [3] that the camera orbits around."""
    time: float = 0.0
    animation: str = ""
    variant: str = ""
    channel: str = "color"
    exposure: float = 0.0
    transform: str = "standard"
    """The view transform."""
    integrator: Literal["direct", "path"] = "direct"
    look: Look = field(kw_only=True)
    shape: Literal["own", "window", "home"] = "own"
    """Whether the camera has its own shape or that of the window; "home" is a framing camera that was not moved."""
    space: tuple[int, int] = (640, 480)
    """The space for the image in the client's window, device pixels."""

    @classmethod
    def start(
        cls,
        opened: Opened,
        *,
        integrator: str | None = None,
        start: Mapping[str, Any] | None = None,
        look: Look | None = None,
    ) -> View:
        """The first view of a world.

        `start` may contain `time`, `animation`, `variant`, `channel`, `exposure` and `view`. `look` is by default the
        look that `raycam render` chooses.

        Raises `SettingsError` for a value that does not exist in the world.
        """
        base = opened.edits.world
        given = {name: value for name, value in (start or {}).items() if value is not None}
        settings = base.render_settings
        seconds = seconds_of(base)
        time = real("time", given.get("time", 0.0), 0.0, what="a time in seconds")
        if time > seconds:
            lasts = f"the motion lasts {seconds:g} s" if seconds else "nothing in this world moves"
            raise SettingsError(
                f"time {time:g} s is after the end of the motion; {lasts}", code="out_of_range"
            )
        animations, variants = [each.name for each in base.animations], base.variants
        animation, variant = given.get("animation", ""), given.get("variant", "")
        world = world_at(
            base,
            time,
            one_of("animation", animation, animations) if animation else "",
            variant and one_of("variant", variant, variants),
        )
        camera, name = opened.home(world, opened.fixed_size or FIRST_SPACE)
        if look is None:
            look = Look.choose(world, camera, is_framed=opened.fills_window, is_model=opened.is_model)
        settings = {"exposure": look.exposure, **look.options, **settings}
        exposure = given.get("exposure", settings["exposure"])
        chosen = integrator or settings.get("integrator", "direct")
        view = cls(
            opened=opened,
            world=world,
            camera=camera,
            camera_name=name,
            pivot=bounds_of(world).mean(axis=0),
            time=time,
            animation=animation,
            variant=variant,
            channel=one_of("channel", given.get("channel", "color"), (*SAMPLED, *TRUTH)),
            exposure=float(real("exposure", exposure, -100, 100, what="a number of stops")),
            transform=one_of("view", given.get("view", settings.get("view", "standard")), VIEWS),
            integrator="path" if chosen == "path" else "direct",
            look=look,
            shape=opened.first_shape,
        )
        return replace(view, camera=view.camera_of(name)) if name else view

    # Values derived from the state ------------------------------------------------------------------------

    @property
    def base(self) -> World:
        """The world without a time and a variant."""
        return self.opened.edits.world

    @property
    def seconds(self) -> float:
        """The duration of the video and the animations; 0 for a world that does not move."""
        return seconds_of(self.base)

    @cached_property
    def bounds(self) -> Floats:
        """The bounds [2, 3] of the displayed world; a cube of 2 m for an empty world."""
        return bounds_of(self.world)

    @cached_property
    def object_names(self) -> tuple[str, ...]:
        """The names of the world's objects, in the order of their ids."""
        return tuple(names_of_objects(self.world))

    @property
    def size(self) -> tuple[int, int]:
        """The still image's size: the camera's size, scaled to the available space."""
        if self.shape != "own":
            return self.camera.size
        return _fitted(
            self.camera.size, self.opened.fixed_size or _fitted(self.space, MAX_STILL_SIZE, most=1.0)
        )

    @cached_property
    def still_camera(self) -> Camera:
        """The camera of the still image."""
        return self.camera.resized(self.size)

    @property
    def lit(self) -> World:
        """The world with the light and the ground of the look, which colour images show."""
        return self.look.light_up(self.world, self._opened_world, self.camera)

    @property
    def preview(self) -> World:
        """The world of moving images: `lit`, or in the studio a copy with faster lights.

        The faster lights need only one sample per pixel.
        """
        if self.channel not in LIT_CHANNELS:
            return self.world
        return self.look.light_up(self.world, self._opened_world, self.camera, preview=True)

    @property
    def _opened_world(self) -> World:
        """The world before its edits, at the view's time."""
        opened = self.opened.edits.opened
        if self.base is opened:
            return self.world
        is_still = seconds_of(opened) == 0 or (self.time == 0 and not opened.animations)
        return opened if is_still else world_at(opened, self.time, self.animation, "")

    @property
    def shown(self) -> World:
        """The world of the chosen channel: `lit`, or without the look for ground truth."""
        return self.lit if self.channel in LIT_CHANNELS else self.world

    @property
    def render_options(self) -> dict[str, Any]:
        """The options of `render` that the look adds to the world's own."""
        own = self.base.render_settings
        return {
            name: each for name, each in self.look.options.items() if name == "max_depth" and name not in own
        }

    def renders_like(self, other: View) -> bool:
        """True if both views show the same image."""
        return (
            self.world is other.world
            and self.look is other.look
            and (self.lit is self.world or self._shows_light == other._shows_light)
            and self.camera == other.camera
            and self.size == other.size
            and self.integrator == other.integrator
            # The channel `error` is rendered with samples of its own.
            and (self.channel == "error") == (other.channel == "error")
        )

    def shows_like(self, other: View) -> bool:
        """True if both views have the same camera, pivot, look, variant and integrator."""
        return (
            self.camera == other.camera
            and self.camera_name == other.camera_name
            and np.array_equal(self.pivot, other.pivot)
            and (self.look is other.look or self.look.equals(other.look))
            and (self.variant, self.integrator) == (other.variant, other.integrator)
        )

    def restored(self, earlier: View) -> View:
        """The view with camera, pivot, look, variant and integrator of an earlier view."""
        view = replace(
            self.with_look(earlier.look),
            camera=earlier.camera,
            camera_name=earlier.camera_name,
            pivot=earlier.pivot,
            shape=earlier.shape,
            variant=earlier.variant,
            integrator=earlier.integrator,
        )
        return view.rebased().with_space(self.space)

    @property
    def _shows_light(self) -> bool:
        """True unless the channel is alpha or coverage, which do not depend on the look's light."""
        return self.channel not in COLORS[1:]

    def camera_of(self, name: str) -> Camera:
        """Returns a camera of the world at the view's time."""
        return self._camera_at(name, self.world, self.time)

    def _camera_at(self, name: str, world: World, time: float) -> Camera:
        if self.base.video is not None:
            return self.base.camera_at(self.base.camera(name), time)
        return world.camera(name)

    def moment(self, time: float) -> tuple[World, Camera]:
        """The world at a time, with the view's animation and variant, and the camera at that time."""
        world = world_at(self.base, time, self.animation, self.variant)
        return world, self._camera_at(self.camera_name, world, time) if self.camera_name else self.camera

    # Changes ----------------------------------------------------------------------------------------------

    def evaluated(self) -> View:
        """The view with its world and camera at its time."""
        world, camera = self.moment(self.time)
        return replace(self, world=world, camera=camera)

    def rebased(self) -> View:
        """The view after the world was edited or replaced.

        Names and times that no longer exist are removed. If the up axis has changed, the first camera and the
        studio's lights are placed again.
        """
        base = self.base
        view = replace(
            self,
            camera_name=self.camera_name if self.camera_name in base.cameras else "",
            variant=self.variant if self.variant in base.variants else "",
            animation=self.animation if self.animation in [each.name for each in base.animations] else "",
            time=min(self.time, self.seconds),
        ).evaluated()
        if view.camera.up == base.up:
            return view
        home = view.at_home()
        return replace(home, look=home.look.changed(stage=home.camera))

    def at(self, time: float, animation: str) -> View:
        """The view at a time in seconds; a time after the end of the motion becomes the end.

        Raises `WorldError` for an unknown animation.
        """
        if animation:
            one_of("animation", animation, [each.name for each in self.base.animations], error=WorldError)
        return replace(self, time=min(float(time), self.seconds), animation=animation).evaluated()

    def with_look(self, look: Look) -> View:
        """Returns the view with another look.

        If the world has lights, the look's lights are added to them, and the exposure changes by the difference between
        the exposures at which the old and the new image are not overexposed.
        """
        view = replace(self, look=look)
        if look.light == self.look.light or not self.base.lights:
            return view
        own, other = (
            each.look.exposure_of(each.world, each._opened_world, each.camera) for each in (self, view)
        )
        return replace(view, exposure=round(self.exposure + other - own, 2) + 0.0)  # + 0.0 turns -0 into 0

    def with_variant(self, name: str) -> View:
        """The view with a material variant. Raises `WorldError` for an unknown name."""
        if name:
            one_of("variant", name, self.base.variants, error=WorldError)
        return replace(self, variant=name).evaluated()

    def through(self, name: str) -> View:
        """The view through a camera of the world.

        If the name is empty, the pose is kept as a free camera. Raises `WorldError` for an unknown camera.
        """
        if not name:
            return replace(self, camera_name="")
        one_of("camera", name, list(self.base.cameras), error=WorldError)
        camera = self.camera_of(name)
        return replace(self, camera=camera, camera_name=name, shape="own")

    def at_home(self) -> View:
        """The view through its first camera."""
        camera, name = self.opened.home(
            self.world, self.opened.fixed_size or _fitted(self.space, MAX_STILL_SIZE, most=1.0)
        )
        moved = replace(self, pivot=self.bounds.mean(axis=0))
        if name:
            return moved.through(name)
        return replace(moved, camera=camera, camera_name="", shape=self.opened.first_shape)

    def from_side(self, direction: str) -> View:
        """The view of the whole world from a side, with the camera's lens.

        A side is a name such as "front", "top" or "iso". Raises `CameraError` if the lens cannot show the whole world.
        """
        if self.world.bounds is None:
            raise WorldError("the world has no objects to view from a side", code="nothing_visible")
        size = self.camera.size
        if self.shape != "own":
            fov = math.degrees(2 * math.atan(size[1] / (2 * float(self.camera.K[1, 1]))))
            camera = self.world.view_from(direction, size=size, fov=fov)
        else:
            camera = self.world.view_from(direction, camera=self.camera)
        return replace(self.with_camera(camera), pivot=self.bounds.mean(axis=0))

    def framed(self, zoom: float, fov: float) -> View:
        """The view of the whole world from the camera's present direction.

        `zoom` is the scale of the world, as in `World.view_from`. `fov` is the vertical field of view in degrees;
        with 0, the lens is kept. Raises `CameraError` if the lens cannot show the whole world.
        """
        if self.world.bounds is None:
            raise WorldError("the world has no objects to frame", code="nothing_visible")
        direction = -self.camera.R[2]
        if not fov:
            camera = self.world.view_from(direction, zoom=zoom, camera=self.camera)
            return replace(self.with_camera(camera), pivot=self.bounds.mean(axis=0))
        size = self.size if self.shape == "own" else self.camera.size
        camera = self.world.view_from(direction, zoom=zoom, fov=fov, size=size)
        return replace(self.with_camera(camera), pivot=self.bounds.mean(axis=0), shape="window")

    def with_space(self, space: tuple[int, int]) -> View:
        """The view for another size of the client's window."""
        view = replace(self, space=space)
        if self.shape == "own":
            return view
        size = _fitted(space, MAX_STILL_SIZE, most=1.0)
        if size == self.camera.size:
            return view
        if self.shape == "home":
            return replace(view, camera=self.opened.home(self.world, size)[0])
        return replace(view, camera=_reshaped(self.camera, size))

    def with_camera(self, camera: Camera) -> View:
        """The view through a free camera."""
        shape: Literal["own", "window"] = "own" if self.shape == "own" else "window"
        return replace(self, camera=camera, camera_name="", shape=shape)

    def moved(self, R: Floats, C: Floats, fx: float, pivot: Floats) -> View:
        """The view with a new pose and pivot.

        For an orthographic camera, `fx` is the scale in pixels per metre.
        """
        view = replace(self, pivot=pivot)
        camera = self.camera
        if camera.is_parallel:
            factor = fx / self.still_camera.K[0, 0]
            if abs(factor - 1) > 1e-12:
                K = camera.K.copy()
                K[0, :2] *= factor
                K[1, 1] *= factor
                camera = camera.replace(K=K)
        elif np.array_equal(R, camera.R) and np.array_equal(C, camera.location):
            return view
        return view.with_camera(camera.at_pose(R, C))

    def with_lens(self, fx: float, fy: float, cx: float, cy: float, distortion: list[float]) -> View:
        """Returns the view with other intrinsics, in pixels of the camera's own size.

        Raises `CameraError` for invalid intrinsics or lens coefficients.
        """
        K = self.camera.K.copy()
        K[0, 0], K[1, 1], K[0, 2], K[1, 2] = fx, fy, cx, cy
        return self.with_camera(self.camera.replace(K=K, distortion=distortion or None))

    def with_pose(self, location: list[float], roll: float, pitch: float, yaw: float) -> View:
        """The view from a location in metres, with angles in degrees."""
        posed = Camera.from_pose(location, roll, pitch, yaw, size=(2, 2), focal=1, up=self.camera.up)
        return self.with_camera(self.camera.at_pose(posed.R, posed.location))

    # Messages ---------------------------------------------------------------------------------------------

    def outline(self) -> tuple[Any, ...]:
        """Returns the contents of the message `welcome`: names, times, title."""
        base = self.base
        return (
            self.opened.title,
            tuple(base.cameras),
            self.object_names,
            tuple(base.variants),
            tuple((each.name, each.duration) for each in base.animations),
            self.seconds,
            tuple(base.categories.items()),
        )

    def welcome(self) -> dict[str, Any]:
        """The part of the message `welcome` that describes the view."""
        base = self.base
        return {
            "title": self.opened.title,
            "channels": [{"name": name} for name in (*COLORS[:1], *TRUTH, *COLORS[1:], "error")],
            "cameras": list(base.cameras),
            "names": {"instance": dict(enumerate(self.object_names)), "category": base.categories},
            "origin": [0, 0],
            "channel": self.channel,
            "exposure": self.exposure,
            "view": self.transform,
            "integrator": self.integrator,
            "explanations": [],
            "triangles": self.world.counts["triangles"],
            "time": {"now": self.time, "seconds": self.seconds, "animation": self.animation},
            "animations": [each.name for each in base.animations],
            "variants": base.variants,
            "variant": self.variant,
            "look": self.look.describe(),
        }

    def about(self) -> str:
        """The world's counts and the camera, as text."""
        counts = self.world.counts
        number = ", ".join(
            f"{counts[name]:,} {name if counts[name] != 1 else name[:-1]}"
            for name in ("objects", "triangles")
        )
        return f"{number}\n\n{self.camera!r}"

    def up_notice(self) -> Notice | None:
        """The notice that the world's up axis was assumed; None if the file, the script or the user chose the axis."""
        if not self.base._is_up_assumed:
            return None
        axis = self.base.up
        return Notice(
            f"up axis: mesh files do not specify it, and {axis} is assumed; if the model lies on its side, click "
            f'"Up: {axis.upper()} (assumed)" next to the image',
            "assumed_up_axis",
        )

    def camera_message(self, seq: int) -> dict[str, Any]:
        """The message `camera` with all data for navigation.

        `seq` is the number of the last move that is included.
        """
        camera = self.still_camera
        (width, height), corner = camera.size, camera.corner
        x, y = corner + width / 2, corner + height / 2
        edges = camera.rays(np.array([(corner, y), (corner + width, y), (x, corner), (x, corner + height)]))[
            1
        ]
        return {
            "type": "camera",
            "seq": seq,
            "name": self.camera_name,
            "lens": lens_of(self.camera),
            "pose": pose_of(self.camera),
            "R": camera.R.ravel().tolist(),
            "C": camera.location.tolist(),
            "K": camera.K.ravel().tolist(),
            "size": [width, height],
            "up": [0, 0, 1] if camera.up == "z" else [0, 1, 0],
            "up_assumed": self.base._is_up_assumed,
            "parallel": camera.is_parallel,
            "edges": [each.tolist() for each in edges @ camera.R.T if np.isfinite(each).all()],
            "bounds": self.bounds.tolist(),
            "pivot": self.pivot.tolist(),
        }


def _fitted(size: tuple[int, int], space: tuple[int, int], most: float = math.inf) -> tuple[int, int]:
    """A size of the same shape that fits into a space, enlarged at most by the factor `most`."""
    scale = min(space[0] / size[0], space[1] / size[1], most)
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def _reshaped(camera: Camera, size: tuple[int, int]) -> Camera:
    """Returns the camera with another size and the same vertical field of view.

    The principal point is scaled.
    """
    scale = size[1] / camera.size[1]
    K = camera.K.copy()
    K[0, :2] *= scale
    K[1, 1] *= scale
    for axis in (0, 1):
        middle = camera.size[axis] / 2 + camera.corner
        K[axis, 2] = size[axis] / 2 + camera.corner + (camera.K[axis, 2] - middle) * scale
    return camera.replace(K=K, size=size)


def bounds_of(world: World) -> Floats:
    """The bounds [2, 3] of a world; a cube of 2 m for an empty world."""
    return np.array([[-1.0] * 3, [1.0] * 3]) if world.bounds is None else world.bounds


def seconds_of(world: World) -> float:
    """The duration of a world's video and animations; 0 for a world that does not move."""
    video = world.video
    return max([0.0 if video is None else video.seconds, *(each.duration for each in world.animations)])


def world_at(base: World, time: float, animation: str, variant: str) -> World:
    """A world at a time of an animation, with a material variant.

    An empty `animation` means the first animation; an empty `variant` means the file's default materials.
    """
    world = base.with_variant(variant) if variant else base
    return world.at(time, animation or None) if seconds_of(base) > 0 else world


def pose_of(camera: Camera) -> dict[str, Any]:
    """A camera's location in metres, and its roll, pitch and yaw in degrees."""
    roll, pitch, yaw = (float(angle) for angle in camera.roll_pitch_yaw)
    return {"location": camera.location.tolist(), "roll": roll, "pitch": pitch, "yaw": yaw}


def lens_of(camera: Camera) -> dict[str, Any]:
    """A camera's intrinsics and distortion in its own size, as the client's fields show them."""
    K = camera.K
    coefficients = [] if camera.distortion is None else [float(value) for value in camera.distortion]
    names = dict(lens_coefficients()).get(camera.model, [])
    return {
        "model": camera.model,
        **{"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]},
        "distortion": coefficients,
        "names": names[: len(coefficients)],
        **{"size": list(camera.size), "corner": camera.corner},
    }
