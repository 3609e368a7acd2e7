"""What a client views: an immutable state, from which each message makes the next one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..._core import lens_coefficients
from ...arguments import Floats, one_of, real
from ...camera import Camera
from ...errors import SettingsError, WorldError
from ...render.frame import VIEWS
from ...world import World
from ..scene.contents import names_of_objects
from ..scene.edits import Edits
from ..stills import COLORS, SAMPLED, TRUTH

__all__ = ["MAX_STILL_SIZE", "Opened", "View", "lens_of", "pose_of"]

MAX_STILL_SIZE = (1280, 960)
"""The largest still image, in pixels, unless the script chooses a size."""


@dataclass(frozen=True, eq=False)
class Opened:
    """The world that is open, and where its view starts."""

    edits: Edits
    """The world with its changes; several sessions may share it."""
    title: str = "raycam"
    source: Path | None = None
    """The file that the world was loaded from."""
    added: frozenset[str] = frozenset()
    """The names of cameras that the file does not contain."""
    camera: Camera | None = None
    """The first camera; None for the world's default camera."""

    def home(self, world: World) -> tuple[Camera, str]:
        """The first camera of the view and its name; a camera without a name frames `world` as it is now."""
        base = self.edits.world
        camera = base.default_camera() if self.camera is None else self.camera
        for name, each in base.cameras.items():
            if each == camera:
                return each, name
        has_own = bool(base.cameras) or base.bounds is None
        is_framed = not has_own and camera == base.default_camera(camera.size)
        return (world.default_camera(camera.size) if is_framed else camera), ""


@dataclass(frozen=True, eq=False)
class View:
    """Everything that a client shows. `View.start` creates one; the other methods return changed copies."""

    opened: Opened
    world: World
    """The world at the chosen time, with the chosen variant."""
    camera: Camera
    """The camera in its own size."""
    camera_name: str
    """The name of the world's camera that is looked through; empty for a free camera."""
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
    space: tuple[int, int] = (640, 480)
    """The space for the image in the client's window, device pixels."""
    fixed_size: tuple[int, int] | None = field(default=None)
    """The space that the script chose instead."""

    @classmethod
    def start(
        cls,
        opened: Opened,
        *,
        integrator: str | None = None,
        fixed_size: tuple[int, int] | None = None,
        start: Mapping[str, Any] | None = None,
    ) -> View:
        """The first view of a world. `start` has any of `time`, `animation`, `variant`, `channel`, `exposure`, `view`.

        Raises `SettingsError` for a value that the world does not have.
        """
        base = opened.edits.world
        given = {name: value for name, value in (start or {}).items() if value is not None}
        settings = base.render_settings
        seconds = seconds_of(base)
        time = real("time", given.get("time", 0.0), 0.0, what="seconds")
        if time > seconds:
            lasts = f"its motion lasts {seconds:g} s" if seconds else "nothing in it moves"
            raise SettingsError(f"time {time:g} s is too late for this world: {lasts}", code="out_of_range")
        animations, variants = [each.name for each in base.animations], base.variants
        animation, variant = given.get("animation", ""), given.get("variant", "")
        chosen = integrator or settings.get("integrator", "direct")
        exposure = given.get("exposure", settings.get("exposure", 0.0))
        world = world_at(
            base,
            time,
            one_of("animation", animation, animations) if animation else "",
            variant and one_of("variant", variant, variants),
        )
        camera, name = opened.home(world)
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
            fixed_size=fixed_size,
        )
        return replace(view, camera=view.camera_of(name)) if name else view

    # What follows from the state --------------------------------------------------------------------------

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
        """The bounds [2, 3] of the world as it is shown; a cube of 2 m for an empty world."""
        return bounds_of(self.world)

    @cached_property
    def object_names(self) -> tuple[str, ...]:
        """The names of the world's objects, in the order of their ids."""
        return tuple(names_of_objects(self.world))

    @property
    def size(self) -> tuple[int, int]:
        """The still image's size: the camera's sides, scaled to the available space."""
        width, height = self.camera.size
        space = self.fixed_size or (
            min(self.space[0], MAX_STILL_SIZE[0]),
            min(self.space[1], MAX_STILL_SIZE[1]),
        )
        scale = min(space[0] / width, space[1] / height)
        return max(1, round(width * scale)), max(1, round(height * scale))

    @cached_property
    def still_camera(self) -> Camera:
        """The camera of the still image."""
        return self.camera.resized(self.size)

    def renders_like(self, other: View) -> bool:
        """True if both views show the same image."""
        return (
            self.world is other.world
            and self.camera == other.camera
            and self.size == other.size
            and self.integrator == other.integrator
            and (self.channel == "error") == (other.channel == "error")  # its samples are separate
        )

    def camera_of(self, name: str) -> Camera:
        """A camera of the world, where it is at the view's time."""
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
        """The view after the world was edited or replaced, without names and times that no longer exist."""
        base = self.base
        return replace(
            self,
            camera_name=self.camera_name if self.camera_name in base.cameras else "",
            variant=self.variant if self.variant in base.variants else "",
            animation=self.animation if self.animation in [each.name for each in base.animations] else "",
            time=min(self.time, self.seconds),
        ).evaluated()

    def at(self, time: float, animation: str) -> View:
        """The view at a time, at most the last one. Raises `WorldError` for an unknown animation."""
        if animation:
            one_of("animation", animation, [each.name for each in self.base.animations], error=WorldError)
        return replace(self, time=min(float(time), self.seconds), animation=animation).evaluated()

    def with_variant(self, name: str) -> View:
        """The view with a material variant. Raises `WorldError` for an unknown one."""
        if name:
            one_of("variant", name, self.base.variants, error=WorldError)
        return replace(self, variant=name).evaluated()

    def through(self, name: str) -> View:
        """The view through a camera of the world, or with its pose as a free camera if the name is empty.

        Raises `WorldError` for an unknown camera.
        """
        if not name:
            return replace(self, camera_name="")
        one_of("camera", name, list(self.base.cameras), error=WorldError)
        return replace(self, camera=self.camera_of(name), camera_name=name)

    def at_home(self) -> View:
        """The view through its first camera."""
        camera, name = self.opened.home(self.world)
        moved = replace(self, pivot=self.bounds.mean(axis=0))
        return moved.through(name) if name else replace(moved, camera=camera, camera_name="")

    def with_camera(self, camera: Camera) -> View:
        """The view through a free camera."""
        return replace(self, camera=camera, camera_name="")

    def moved(self, R: Floats, C: Floats, fx: float, pivot: Floats) -> View:
        """The view from another pose, around another pivot. Parallel rays show objects of `fx` pixels per metre."""
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
        """The view with other intrinsics, in pixels of the camera's own size. Raises `CameraError`."""
        K = self.camera.K.copy()
        K[0, 0], K[1, 1], K[0, 2], K[1, 2] = fx, fy, cx, cy
        return self.with_camera(self.camera.replace(K=K, distortion=distortion or None))

    def with_pose(self, location: list[float], roll: float, pitch: float, yaw: float) -> View:
        """The view from a location in metres, with angles in degrees."""
        posed = Camera.from_pose(location, roll, pitch, yaw, size=(2, 2), focal=1, up=self.camera.up)
        return self.with_camera(self.camera.at_pose(posed.R, posed.location))

    # Messages ---------------------------------------------------------------------------------------------

    def outline(self) -> tuple[Any, ...]:
        """All that `welcome` tells a client: names, times, title."""
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
        }

    def about(self) -> str:
        """The world's counts and the camera, as text."""
        counts = self.world.counts
        number = ", ".join(
            f"{counts[name]:,} {name if counts[name] != 1 else name[:-1]}"
            for name in ("objects", "triangles")
        )
        return f"{number}\n\n{self.camera!r}"

    def camera_message(self, seq: int) -> dict[str, Any]:
        """The message `camera`: all that the client needs to navigate. `seq` is the last move that it contains."""
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
            "parallel": camera.is_parallel,
            "edges": [each.tolist() for each in edges @ camera.R.T if np.isfinite(each).all()],
            "bounds": self.bounds.tolist(),
            "pivot": self.pivot.tolist(),
        }


def bounds_of(world: World) -> Floats:
    """The bounds [2, 3] of a world; a cube of 2 m for an empty one."""
    return np.array([[-1.0] * 3, [1.0] * 3]) if world.bounds is None else world.bounds


def seconds_of(world: World) -> float:
    """The duration of a world's video and animations; 0 for a world that does not move."""
    video = world.video
    return max([0.0 if video is None else video.seconds, *(each.duration for each in world.animations)])


def world_at(base: World, time: float, animation: str, variant: str) -> World:
    """A world at a time of an animation (empty for the first), with a material variant (empty for its own)."""
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
    }
