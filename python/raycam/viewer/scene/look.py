"""The look of a view: light, ground and background of a world."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ...arguments import one_of, real
from ...camera import Camera
from ...data import bundled
from ...errors import SettingsError
from ...render.background import picture_behind
from ...render.studio import STUDIO_OPTIONS, exposure_of_lights, is_unlit, lacks_surroundings
from ...world import World
from ...world.studio import (
    CLAY,
    add_clay,
    add_studio,
    add_studio_preview,
    add_sun,
    is_above,
    lacks_materials,
    studio_floor,
)
from .material_edits import color_text

__all__ = ["LIGHTS", "LOOK_OPTIONS", "SKY_IMAGE", "Look"]

LIGHTS = ("own", "default", "studio", "room", "sun", "sky")
"""The light of a view: the world's own, the renderer's default lights, the studio, the studio without its key light, a
sun, or an environment image.
"""
GROUNDS = ("auto", "none", "plain", "shadow")
"""The grounds of a look that are not a colour."""
LOOK_OPTIONS = ("hdri", "hdri_rotation", "sun", "studio", "ground", "background")
"""The options of `raycam.view` and `raycam view` that choose a look."""
ENVIRONMENT_OPTIONS = {"integrator": "path", "max_depth": 4, "view": "pbr_neutral"}
"""Defaults of render options with an environment image."""
DEFAULT_SUN = (30.0, 45.0)
"""Default azimuth and elevation of the sun, in degrees."""
SKY_IMAGE = "sky.hdr"
"""The bundled environment image, which is the default."""
NO_LIGHT = {"type": "sun", "direction": [0, 0, -1], "irradiance": [0, 0, 0]}
"""A light of zero strength: it prevents default lights."""
DEFAULT_SKY_RADIANCE, DEFAULT_SUN_IRRADIANCE = 0.4, 2.4
"""The strengths of the renderer's default lights."""
CACHED_WORLDS = 4

Light = Literal["own", "default", "studio", "room", "sun", "sky"]


@dataclass(frozen=True, eq=False)
class Look:
    """The look of a world. Edits of the world keep its light and its ground."""

    stage: Camera
    """The camera that the studio's lights are arranged around."""
    light: Light = "own"
    image: str | None = None
    """The environment image of the light "sky"; None for the bundled image."""
    rotation: float = 0.0
    """The rotation of the environment image, degrees counterclockwise, seen from above."""
    sun: tuple[float, float] = DEFAULT_SUN
    """Azimuth to the right of the front and elevation of the light "sun", degrees."""
    ground: str = "auto"
    """"auto" (the studio's floor, otherwise nothing), "none", "plain", "shadow", or a colour."""
    background: str | None = None
    """A colour or the path of an image; None for the light's own background."""
    exposure: float = 0.0
    """The initial exposure in stops, at which the light "room" has the studio's brightness."""
    is_clay: bool = False
    """True if objects without a material are grey in the studio."""
    uploaded: tuple[str, ...] = ()
    """The paths of images that a client has sent; copied commands contain only their names."""
    first: Look | None = None
    """The look that `restored` returns; None for a look that was not changed."""
    _worlds: dict[tuple[int, int, bool, bool], tuple[World, World, World]] = field(
        default_factory=dict, init=False, repr=False
    )
    _lock: Any = field(default_factory=threading.Lock, init=False, repr=False)

    @classmethod
    def choose(
        cls, world: World, camera: Camera, *, is_framed: bool, is_model: bool = False, **options: Any
    ) -> Look:
        """The look of `options`, or the look that `raycam render` chooses.

        A world without lights and cameras, which a framing camera shows, is lit by the studio. Any other world without
        lights has the renderer's default lights. A model with suns or lamps only is shown in the studio's room, and
        with `studio=False` in the dark. Raises `SettingsError` for invalid options.
        """
        only_own = options.get("studio") is False
        given = {name: value for name, value in options.items() if value not in (None, False)}
        for name in given:
            one_of("option", name, LOOK_OPTIONS)
        if "hdri_rotation" in given and "hdri" not in given:
            raise SettingsError(
                "hdri_rotation requires hdri, the file of an environment image", code="conflicting_values"
            )
        lights = [name for name in ("studio", "sun", "hdri") if name in given]
        if len(lights) > 1:
            raise SettingsError(
                f"{' and '.join(lights)} cannot be combined in a view; use only one of them",
                code="conflicting_values",
            )
        light: Any = {"hdri": "sky"}.get(lights[0], lights[0]) if lights else "own"
        exposure = 0.0
        if not lights and world.bounds is not None:
            if is_unlit(world, camera, {}):
                light = "studio" if is_framed and not only_own else "default"
            elif is_framed and is_model and not only_own and lacks_surroundings(world, {}):
                light, exposure = "room", exposure_of_lights(world, camera)
        ground = given.get("ground")
        look = cls(
            stage=camera,
            light=light,
            image=_image_path(given["hdri"]) if "hdri" in given else None,
            rotation=float(
                real("hdri_rotation", given.get("hdri_rotation", 0.0), -360, 360, what="an angle in degrees")
            ),
            sun=_sun(given["sun"]) if "sun" in given else DEFAULT_SUN,
            ground="auto" if ground is None else "plain" if ground in ("", True) else str(ground),
            background=_background(given.get("background")),
            exposure=exposure,
            is_clay=is_model and lacks_materials(world),
        )
        look.check(world, camera)
        return look

    def check(self, world: World, camera: Camera) -> None:
        """Raises the errors of files and colours, before an image is rendered."""
        self.light_up(world, world, camera)
        if self.background is not None:
            picture_behind(self.background, camera, camera.size)

    def changed(self, **values: Any) -> Look:
        """Returns a copy of the look with new values."""
        return replace(self, first=self.first or self, **values)

    def restored(self) -> Look:
        """Returns the look before all changes; the lights keep their arrangement around the current stage."""
        return replace(self.first or self, stage=self.stage)

    @property
    def _is_in_studio(self) -> bool:
        return self.light in ("studio", "room")

    @property
    def options(self) -> Mapping[str, Any]:
        """The defaults of render options with this light, without the number of samples."""
        if self._is_in_studio:
            return {name: value for name, value in STUDIO_OPTIONS.items() if name != "samples"}
        return ENVIRONMENT_OPTIONS if self.light == "sky" else {}

    def exposure_of(self, world: World, opened: World, camera: Camera) -> float:
        """The exposure in stops, at most 0, at which the world is not overexposed in this look."""
        return exposure_of_lights(self.light_up(world, opened, camera), camera)

    def describe(self) -> dict[str, Any]:
        """The look as the messages `welcome` and `look` describe it."""
        return {**self._described, "is_first": self.first is None or self.equals(self.first)}

    @cached_property
    def _described(self) -> dict[str, Any]:
        return {
            "light": self.light,
            "rotation": self.rotation,
            "azimuth": self.sun[0],
            "elevation": self.sun[1],
            "image": os.path.basename(self.image or SKY_IMAGE),
            "ground": self.ground if self.ground in GROUNDS else "color",
            "ground_color": "" if self.ground in GROUNDS else _hex_color(self.ground),
            "backdrop": "light"
            if self.background is None
            else "image"
            if self.has_background_image
            else "color",
            "background": ""
            if self.background is None or self.has_background_image
            else _hex_color(self.background),
            "background_image": os.path.basename(self.background or "") if self.has_background_image else "",
        }

    @property
    def has_background_image(self) -> bool:
        """True if the background is an image instead of a colour."""
        return self.background is not None and os.path.splitext(self.background)[1] != ""

    def equals(self, other: Look) -> bool:
        """True if both looks have the same light, ground and background."""
        return self._described == other._described and (self.image, self.background) == (
            other.image,
            other.background,
        )

    @property
    def first_samples(self) -> int:
        """The samples per pixel of the first still image.

        Images with fewer samples are noisier than the preceding moving image, and are blended with it.
        """
        return 8 if self._is_in_studio else 4 if self.light == "sky" else 1

    def notice(self) -> str | None:
        """The sentence that explains light and colours that are not in the file."""
        light = {
            "studio": "the model has no lights; it is shown in the studio, whose floor is not part of the ground truth",
            "room": "the model has lights but no surroundings; it is shown in the studio's room, whose floor is not "
            "part of the ground truth",
            "default": "the world has no lights; it is lit by a white sky of radiance 0.4 and a sun of irradiance 2.4",
        }.get(self.light)
        if light is not None and self.is_clay and self._is_in_studio:
            light += f"; the model has no materials, and is shown in grey (albedo {CLAY})"
        return light

    @property
    def behind(self) -> dict[str, Any]:
        """The argument `background` of `render`, if the look has a background."""
        return {} if self.background is None else {"background": self.background}

    def light_up(self, world: World, opened: World, camera: Camera, *, preview: bool = False) -> World:
        """Returns the world with the look's lights and ground, for `camera`.

        The ground keeps its position under `opened`, the world before its edits, and is hidden from cameras below it.
        Ground truth must be rendered from `world`. Returns `world` itself if the look adds nothing. The lights of a
        `preview` resemble the studio's, but require only one sample per pixel.
        """
        has_floor = self._has_floor(opened, camera)
        preview = preview and self._is_in_studio
        key = (id(world), id(opened), has_floor, preview)
        with self._lock:
            if key not in self._worlds:
                while len(self._worlds) >= CACHED_WORLDS:
                    self._worlds.pop(next(iter(self._worlds)))
                self._worlds[key] = (world, opened, self._build(world, opened, has_floor, preview))
            return self._worlds[key][2]

    def _has_floor(self, opened: World, camera: Camera) -> bool:
        if (
            self.ground == "none"
            or (self.ground == "auto" and not self._is_in_studio)
            or opened.bounds is None
        ):
            return False
        return camera.is_parallel or is_above(opened, camera)

    def _build(self, world: World, opened: World, has_floor: bool, preview: bool) -> World:
        if self.light == "own" and not has_floor and not _needs_no_light(world, opened, self.stage):
            return world
        made = world.copy()
        studio: dict[str, Any] = {} if self.light == "studio" else {"key": False, "exposure": self.exposure}
        if preview:
            add_studio_preview(made, self.stage, **studio)
        elif self._is_in_studio:
            add_studio(made, self.stage, ground=False, **studio)
        elif self.light == "sun":
            add_sun(made, *self.sun, sky=True)
        elif self.light == "sky":
            made.add_light(type="environment", image=self.image or _image_path(SKY_IMAGE), yaw=self.rotation)
        elif self.light == "default":
            _add_default_lights(made)
        elif _needs_no_light(world, opened, self.stage):
            made.add_light(NO_LIGHT)
        if self.is_clay and self._is_in_studio:
            add_clay(made)
        if has_floor:
            made.add_ground(name="studio floor", **studio_floor(opened), **self._floor_material())
        made._bare = world
        return made

    def _floor_material(self) -> dict[str, Any]:
        if self.ground == "shadow" or (self.background is not None and self.ground == "auto"):
            return {"shadow_catcher": True}
        return {} if self.ground in ("auto", "plain") else {"color": self.ground}


def _needs_no_light(world: World, opened: World, camera: Camera) -> bool:
    """True if edits removed the last light; `render` would then use default lights."""
    return world is not opened and world.bounds is not None and is_unlit(world, camera, {})


def _add_default_lights(world: World) -> None:
    """Adds the lights of the renderer for worlds without lights.

    These lights then stay if another light is added.
    """
    direction = [1.0, 2.0, -3.0] if world.up == "z" else [1.0, -3.0, -2.0]
    world.add_light(type="sky", radiance=DEFAULT_SKY_RADIANCE)
    world.add_light(type="sun", direction=direction, irradiance=DEFAULT_SUN_IRRADIANCE, angular_diameter=0.0)


def _hex_color(color: str) -> str:
    """Returns a colour, which may be a name, as #rrggbb."""
    return color_text(picture_behind(color, None, (1, 1))[0][0, 0].tolist())


def _image_path(image: str | os.PathLike[str]) -> str:
    return os.path.abspath(bundled(os.fspath(image)) or image)


def _sun(value: Any) -> tuple[float, float]:
    """Returns azimuth and elevation in degrees; raises `SettingsError` unless both are finite."""
    angles = np.asarray(value, float).ravel() if not isinstance(value, bool) else DEFAULT_SUN
    if len(angles) != 2 or not all(map(math.isfinite, angles)):
        raise SettingsError(
            f"sun: expected azimuth and elevation in degrees, got {value!r}", code="invalid_value"
        )
    return float(angles[0]), float(angles[1])


def _background(value: Any) -> str | None:
    """Returns a colour or an image's absolute path; raises `SettingsError` for "transparent"."""
    if value is None:
        return None
    if value == "transparent":
        raise SettingsError(
            "background transparent: not supported by the view; save the image with raycam render",
            code="unsupported_feature",
        )
    text = os.fspath(value)
    found = bundled(text) or text
    return os.path.abspath(found) if os.path.splitext(str(found))[1] else text
