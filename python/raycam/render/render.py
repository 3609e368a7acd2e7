"""Rendering of a world, seen by a camera, into a frame."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from .._core import Cancel
from ..arguments import flag, one_of, real, whole, words
from ..camera import Camera
from ..errors import Notice, SettingsError, nearest
from ..notices import warn_all
from ..render.arguments import camera_of, world_of
from .composition import over, shadow_ratio, studio_shadow
from .fireflies import firefly_notices
from .frame import CHANNELS, VIEWS, Frame
from .old_names import ELSEWHERE, OLD_NAMES, current_names
from .sight import LIT, blank_notices

if TYPE_CHECKING:
    from ..world import World

__all__ = [
    "DEFAULT_CHANNELS",
    "FILTERS",
    "INTEGRATORS",
    "STUDIO_NOTICE",
    "channel_names",
    "is_unlit",
    "render",
    "studio_settings",
]

INTEGRATORS = ["flat", "direct", "path", "ao", "reference"]
SURFACES = ["first", "solid"]
FILTERS = ["box", "blackman-harris"]
DEFAULT_CHANNELS = ("color", "depth", "instance", "triangle")
DEFAULT_SAMPLES = 16
STUDIO = {"integrator": "path", "max_depth": 6, "samples": 8, "view": "pbr_neutral"}
"""Settings of pictures in the studio, of those that nobody gives."""
SHADED = ("color", "error")
"""The channels that show light."""
MAX_SAMPLES = 1 << 14
"""Default limit of samples per pixel with `noise_threshold` or `time_limit`."""

Integrator = Literal["flat", "direct", "path", "ao", "reference"]
Filter = Literal["box", "blackman-harris"]
Surface = Literal["first", "solid"]
View = Literal["standard", "agx", "pbr_neutral"]
Region = Sequence[int]
Progress = Callable[[int, int], object]


def render(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None = None,
    *,
    integrator: Integrator | None = None,
    samples: int | None = None,
    noise_threshold: float | None = None,
    time_limit: float | None = None,
    max_depth: int | None = None,
    clamp: float | None = None,
    filter: Filter | None = None,
    channels: Sequence[str] | str = DEFAULT_CHANNELS,
    surface: Surface = "first",
    seed: int | None = None,
    frame: int = 0,
    ambient_occlusion: bool | float | None = None,
    region: Region | None = None,
    exposure: float | None = None,
    view: View | None = None,
    denoise: bool = False,
    transparent_background: bool = False,
    background: Any = None,
    catcher_truth: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    **old_names: Any,
) -> Frame:
    """Renders `world`, seen by `camera` (default: the world's first camera, or one that frames the whole world).

    `world` may be the path of a world file, `camera` the name of a camera of the world or the path of a calibration.

    A world without lights and cameras, for which no camera is given, is shown in the studio, with a notice: as by
    `World.add_studio`, with `integrator="path"`, `max_depth=6`, `samples=8` and `view="pbr_neutral"` where these are
    not given. Its floor counts as background in ground truth.

    Arguments that are not given have the values of `[render]` of the world file, or else the defaults:

    * `integrator` ("direct"): "flat" is the colour of the closest triangle, unlit; "direct" adds lights, shadows
      and reflectances (a world without lights gets a sky, with a notice in the frame); "path" is unbiased path tracing
      with any number of bounces; "ao" is ambient occlusion, the visible fraction of the sky; "reference" is "flat" by
      the lecture's procedure in NumPy, brute force and slow.
    * `noise_threshold` stops each pixel when the estimated standard error of its luminance is at most this value; the
      channel `error` has the estimate. `time_limit` stops the picture after this many seconds; a notice tells the
      number of samples that reproduces the picture. With either, `samples` is the maximum per pixel (default 16384).
    * `max_depth` (no limit): the maximum number of path segments. 1 shows emitters only, 2 adds direct light, and so
      on.
    * `clamp` (off): the maximum radiance of a sample. It removes fireflies and darkens the picture; a notice counts the
      clamped samples. Without it, a whole picture by "path" of 256 samples or more has a notice of its fireflies,
      pixels more than 20 times as bright as the median around by a single path, with its light and objects.
    * `samples` (16) rays per pixel; with 1, the ray through the pixel's centre. `filter` ("box" or "blackman-harris")
      is the reconstruction filter. `channels` names the channels of the frame, "all" for all of them.
    * `surface` ("first"): ground truth describes the first triangle on the pixel's centre ray, of any material. With
      "solid", it describes the first opaque one: the straight ray passes surfaces with an opacity below one half, the
      backs of one-sided surfaces, and refractive ones (glass, transmission of one half or more).
    * `seed` (0) and `frame` (0) choose the random numbers. The same call gives the same bytes on any number of
      `threads` (default: all that the process may use).
    * `ambient_occlusion` (off): True, or the maximum distance in metres at which surfaces occlude the sky.
    * `region` (x, y, width, height) renders a part; `Frame.merge` joins parts. `exposure` (0) in stops and
      `view` ("standard", "agx" or "pbr_neutral") are for pictures in sRGB: see `Frame.to_srgb8`.
    * `denoise` (off) applies Open Image Denoise: `pip install raycam[denoise]`. The picture is then biased, and its
      bytes may differ between machines.
    * `transparent_background` (off) makes the background transparent, for compositing: the colour is premultiplied by
      the channel `alpha`, which is added, and PNG, EXR and videos have an opacity. Surfaces with an opacity below 1 are
      partly transparent; mirrors and glass show the sky and are opaque. Objects with `shadow_catcher` are left out, and
      the channel `shadow`, which is added, has the light of each colour that they leave to the background: the ratio of
      their radiance with the objects and without them.
    * `background` (the camera's `Camera.background`, if any) is behind what is rendered: a colour, the path of a
      photograph, an array [h, w, 3] or a `raycam.Background`. The frame is then that of `Frame.over`, in the light of
      the display: where nothing is rendered, the photograph's values stay as they are. Shadow catchers darken it.
    * `catcher_truth` (off): ground truth describes shadow catchers as well, where they are left out of the colour.
    * `progress(done, total)` is called about 50 times per second; an exception that it raises stops the rendering, as
      Ctrl-C does. `cancel` is a `raycam.Cancel`, whose `cancel()` ends the rendering from another thread, in
      milliseconds, with `Cancelled`.
    * `old_names`: `noise`, `time` and `transparent`, the names of three options until 0.2, each with a `Notice`.

    Raises `SettingsError` for invalid arguments, with the nearest valid name, `WorldError`, and `CameraError` if the
    world has no camera and nothing to frame.
    """
    world = world_of(world)
    denoise, catcher_truth = flag("denoise", denoise), flag("catcher_truth", catcher_truth)
    framed = camera is None and not world.cameras
    camera = camera_of(world, camera)
    renamed = current_names(
        {
            "noise_threshold": noise_threshold,
            "time_limit": time_limit,
            "transparent_background": None if transparent_background is False else transparent_background,
            **old_names,
        }
    )
    for name in renamed.keys() - set(OLD_NAMES.values()):
        if name in ELSEWHERE:
            raise SettingsError(f"render has no option {name}: {ELSEWHERE[name]}")
        raise SettingsError(nearest("option of render", name, OPTIONS))
    given = {
        "integrator": None if integrator is None else one_of("integrator", integrator, INTEGRATORS),
        "samples": samples,
        "noise_threshold": renamed["noise_threshold"],
        "time_limit": renamed["time_limit"],
        "max_depth": max_depth,
        "clamp": clamp,
        "filter": filter,
        "seed": seed,
        "threads": threads,
        "ambient_occlusion": ambient_occlusion,
        "exposure": exposure,
        "view": view,
    }
    chosen = {name: value for name, value in given.items() if value is not None}
    one = _Picture(
        world, camera, framed, chosen, surface, frame, region, denoise, catcher_truth, progress, cancel
    )
    names = channel_names(channels)
    clear = renamed["transparent_background"] is not None and flag(
        "transparent_background", renamed["transparent_background"]
    )
    if background is not None and clear:
        raise SettingsError("background and transparent_background are given: expected one of them")
    if background is not None and "color" not in names:
        raise SettingsError(f"background is behind the channel color; this has {', '.join(names)}")
    behind = camera.background if background is None else background
    if behind is None or clear or "color" not in names:
        # Masks of a camera's own composition are those of its picture.
        return one.frame(names, clear or (behind is not None and world._core.has_catchers))
    return one.composed(names, behind)


@dataclass(frozen=True)
class _Picture:
    """One picture that is asked for: what `render` was given."""

    world: World
    camera: Camera
    framed: bool
    """True if raycam chose the camera."""
    chosen: dict[str, Any]
    surface: str
    number: int
    region: Region | None
    denoised: bool
    catcher_truth: bool
    progress: Progress | None
    cancel: Cancel | None

    def frame(self, names: list[str], clear: bool) -> Frame:
        """The frame, with a transparent background if `clear`."""
        world, camera, chosen = self.world, self.camera, dict(self.chosen)
        catching = clear and world._core.has_catchers
        if clear and "color" in names:
            added = ("alpha", "shadow") if catching else ("alpha",)
            names = list(dict.fromkeys([*names, *added]))
        said: list[Notice] = []
        if self.framed and "color" in names and is_unlit(world, camera, world.render_settings | chosen):
            world = world.in_studio(camera, ground=not clear)
            chosen = studio_settings(world.render_settings | chosen)
            said = [STUDIO_NOTICE]
        if self.denoised:
            return _denoised(replace(self, world=world, chosen=chosen, framed=False), names, clear, said)
        if chosen.get("integrator") == "reference":
            return _reference(world, camera, names, chosen, self._unused(clear), self.progress)
        request, stops, display = request_of(
            world,
            chosen,
            names=names,
            surface=self.surface,
            frame=self.number,
            transparent_background=clear,
            region=self.region,
        )
        request["cancel"] = self.cancel
        if catching:
            planes, area, notices = _caught(world, camera, request, self.progress, self.catcher_truth)
        else:
            planes, area, notices = _planes(world, camera, request, self.progress)
            if world._core.has_catchers and "color" in names:
                notices = [*notices, CATCHER_NOTICE]
        if self.region is None:
            notices = [*notices, *_blank(world, camera, planes, request, stops, display)]
            if "color" in planes and not catching:
                notices += firefly_notices(world, camera, planes["color"], request)
        notices = [*said, *notices]
        warn_all(notices)
        return Frame(
            planes,
            camera=camera,
            size=camera.size,
            region=area,
            exposure=stops,
            view=display,
            transparent=clear,
            notices=notices,
        )

    def composed(self, names: list[str], behind: Any) -> Frame:
        """The frame in front of a background, with the shadow of the studio where it stands there."""
        clear = self.frame(names, True)
        if self.framed and STUDIO_NOTICE in clear.notices:
            clear = studio_shadow(clear, self.frame(["color"], False))
        return over(clear, behind, keep=names)

    def _unused(self, clear: bool) -> set[str]:
        """The names of options that the reference does not have."""
        unused = {"region"} if self.region is not None else set()
        unused |= {"surface"} if self.surface != "first" else set()
        return unused | ({"transparent_background"} if clear else set())


def request_of(
    world: World,
    chosen: dict[str, Any],
    *,
    names: list[str],
    surface: str,
    frame: int,
    transparent_background: bool,
    region: Region | None,
) -> tuple[dict[str, Any], float, str]:
    """Everything that the core needs to render, the exposure in stops and the view transform.

    `chosen` are the settings that are given; others have the world's values, or the defaults. Raises `SettingsError`.
    """
    settings: dict[str, Any] = {
        "integrator": "direct",
        "samples": DEFAULT_SAMPLES,
        "filter": "box",
        "seed": 0,
    }
    settings |= {
        "noise_threshold": None,
        "time_limit": None,
        "max_depth": None,
        "clamp": None,
        "threads": None,
        "ambient_occlusion": False,
        "exposure": 0.0,
        "view": "standard",
    }
    for name in chosen.keys() - set(settings) - {"noise_threshold", "time_limit"}:
        raise SettingsError(nearest("option of render", name, OPTIONS))
    asked = world.render_settings | {name: value for name, value in chosen.items() if value is not None}
    if ("noise_threshold" in asked or "time_limit" in asked) and "samples" not in asked:
        asked["samples"] = MAX_SAMPLES
    settings |= asked
    stops = _stops(settings.pop("exposure"))
    display = one_of("view", settings.pop("view"), VIEWS)
    request = {
        "integrator": one_of("integrator", settings["integrator"], INTEGRATORS),
        "samples": whole("samples", settings["samples"], 1, (1 << 32) - 1),
        "filter": one_of("filter", settings["filter"], FILTERS),
        "seed": whole("seed", settings["seed"], 0, (1 << 64) - 1),
        "frame": whole("frame", frame, 0, (1 << 32) - 1),
        "channels": names,
        "surface": one_of("surface", surface, SURFACES),
        "transparent_background": flag("transparent_background", transparent_background),
        "max_depth": _optional("max_depth", settings["max_depth"]),
        "noise_threshold": _positive("noise_threshold", settings["noise_threshold"], "a radiance"),
        "time_limit": _positive("time_limit", settings["time_limit"], "seconds"),
        "clamp": _positive("clamp", settings["clamp"], "a radiance"),
        "ambient_occlusion": _occlusion(settings["ambient_occlusion"]),
        "region": None if region is None else _region(region),
        "threads": None if settings["threads"] is None else whole("threads", settings["threads"], 1, 1 << 16),
    }
    return request, stops, display


CATCHER_NOTICE = Notice(
    "shadow catchers are surfaces in this picture; with transparent_background=True, or a background, it shows their "
    "shadows alone",
    "shadow_catchers_visible",
)


def _caught(
    world: World, camera: Camera, request: dict[str, Any], progress: Progress | None, catcher_truth: bool
) -> tuple[dict[str, Any], tuple[int, int, int, int], list[Notice]]:
    """The channels without shadow catchers, and their shadows: the ratio of two pictures of the same samples."""
    names = request["channels"]
    shaded = "shadow" in names and request["integrator"] != "flat"
    count = 3 if shaded else 1
    if request["time_limit"] is not None:
        request = request | {"time_limit": request["time_limit"] / count}

    def part(number: int) -> Progress | None:
        if progress is None:
            return None
        return lambda done, total: progress(number * total + done, count * total)

    world.prepare(threads=request["threads"])
    wanted = list(dict.fromkeys([*names, "alpha"] if shaded else names))
    hidden = request | {"catchers": "hide", "channels": wanted}
    planes, area, notices = world._core.render(camera._core, hidden, part(0))
    if shaded:
        only = request | {"catchers": "only", "channels": ["color", "alpha"]}
        catchers = world._core.only_catchers()
        caught = world._core.render(camera._core, only, part(1))[0]
        free = catchers.render(camera._core, only, part(2))[0]
        lights = {core.lit_by_default_lights for core in (world._core, catchers)}
        if len(lights) == 1 or request["integrator"] not in LIT:
            planes["shadow"] = shadow_ratio(planes["alpha"], caught, free)
        else:
            message = "objects that shine are the only light: shadow catchers show no shadows of them"
            notices.append(Notice(message, "no_caught_shadows"))
    truth = [name for name in names if name not in (*SHADED, "alpha", "coverage", "shadow")]
    if catcher_truth and truth:
        plain = PLAIN | {"channels": truth, "samples": 1, "transparent_background": False}
        planes |= world._core.render(camera._core, request | plain, None)[0]
    return {name: planes[name] for name in names}, area, notices


def _planes(
    world: World, camera: Camera, request: dict[str, Any], progress: Progress | None
) -> tuple[dict[str, Any], tuple[int, int, int, int], list[Notice]]:
    """The channels; of a world in the studio, ground truth is that of the world without the studio."""
    bare, names = world.without_studio, request["channels"]
    truth = [name for name in names if name not in SHADED]
    if bare is world or not truth or request["transparent_background"]:
        world.prepare(threads=request["threads"])
        return world._core.render(camera._core, request, progress)
    bare.prepare(threads=request["threads"])
    many = {"alpha", "coverage"} & set(truth)
    plain = PLAIN | {"channels": truth, "samples": min(request["samples"], 64) if many else 1}
    planes, area, notices = bare._core.render(camera._core, request | plain, None)
    if len(truth) < len(names):
        world.prepare(threads=request["threads"])
        shaded = request | {"channels": [name for name in names if name in SHADED]}
        lit, area, said = world._core.render(camera._core, shaded, progress)
        planes, notices = planes | lit, [*said, *notices]
    return {name: planes[name] for name in names}, area, list(dict.fromkeys(notices))


PLAIN: dict[str, Any] = {"integrator": "flat", "noise_threshold": None, "time_limit": None}
PLAIN |= {"ambient_occlusion": None, "clamp": None, "max_depth": None}
"""The request of a picture without light."""


def _blank(
    world: World, camera: Camera, planes: dict[str, Any], request: dict[str, Any], stops: float, display: str
) -> list[Notice]:
    """The notices of `blank_notices` for a finished picture."""
    seen = world.without_studio

    def truth() -> Any:
        plain = PLAIN | {"samples": 1, "channels": ["instance"]}
        return seen._core.render(camera._core, request | plain, None)[0]["instance"]

    return list(blank_notices(seen, camera, planes, str(request["integrator"]), stops, display, truth))


STUDIO_NOTICE = Notice(
    "the world has no lights and no camera: it is shown in the studio, from the front right above, by "
    'integrator="path" with max_depth=6; lights or a camera of yours replace it',
    "studio",
)


def is_unlit(world: World, camera: Camera, asked: dict[str, Any]) -> bool:
    """True if the integrator shows light and the world has none, so that the default lights would light it."""
    if world.lights or asked.get("integrator", "path") not in LIT:
        return False
    world.prepare()
    return world._core.lit_by_default_lights


def studio_settings(asked: dict[str, Any]) -> dict[str, Any]:
    """The settings with those of the studio where they are not given."""
    own = dict(STUDIO)
    if "noise_threshold" in asked or "time_limit" in asked:
        del own["samples"]
    return own | asked


OPTIONS = [name for name in inspect.signature(render).parameters if name != "old_names"]
"""The names of the options of `render`."""


def channel_names(channels: Sequence[str] | str) -> list[str]:
    """Returns the names of channels without duplicates; "all" means every channel. Raises `SettingsError`."""
    names = words(
        "channel", list(CHANNELS) if isinstance(channels, str) and channels == "all" else channels, CHANNELS
    )
    if not names:
        raise SettingsError(f"channels is empty; there are {', '.join(CHANNELS)}")
    return names


def _denoised(one: _Picture, names: list[str], clear: bool, said: list[Notice]) -> Frame:
    """Renders and denoises; raises `SettingsError` without the library before anything is rendered."""
    from . import denoise

    denoise.load()
    if "color" not in names:
        raise SettingsError(f"denoise is for the channel color, this has {', '.join(names)}")
    wanted = list(dict.fromkeys([*names, *denoise.GUIDES, *(["alpha"] if clear else [])]))
    seen = replace(one, denoised=False).frame(wanted, clear)
    guides = [seen[name] for name in denoise.GUIDES]
    planes = {name: seen[name] for name in names}
    if clear:
        planes["color"] = denoise.denoise_premultiplied(seen["color"], seen["alpha"], *guides)
    else:
        planes["color"] = denoise.denoise(seen["color"], *guides)
    if "shadow" in names and not (seen["shadow"] == 1).all():
        planes["shadow"] = denoise.denoise(seen["shadow"], *guides)
    warn_all(said)
    denoised = Notice(
        "the picture is denoised by Open Image Denoise: a guess, no longer unbiased", "denoised"
    )
    warn_all([denoised])
    return Frame(
        planes,
        camera=one.camera,
        size=seen.size,
        region=seen.region,
        exposure=seen.exposure,
        view=seen.view,
        transparent=seen.transparent,
        notices=[*said, *seen.notices, denoised],
    )


def _reference(
    world: World,
    camera: Camera,
    names: list[str],
    chosen: dict[str, Any],
    unused: set[str],
    progress: Progress | None,
) -> Frame:
    """Renders with the NumPy reference."""
    from .. import reference

    shown: dict[str, Any] = {"exposure": _stops(chosen.pop("exposure", 0.0))}
    shown["view"] = one_of("view", chosen.pop("view", "standard"), VIEWS)
    if chosen.get("samples") == 1:
        del chosen["samples"]  # what it does anyway
    unused = unused | (chosen.keys() - {"integrator"})
    if unused:
        raise SettingsError(
            f"{', '.join(sorted(unused))}: the reference traces one ray through each pixel's centre, plainly"
        )
    seen = reference.render(world, camera, progress)
    missing = [name for name in names if name not in seen]
    if missing:
        known = ", ".join(name for name in CHANNELS if name in seen)
        raise SettingsError(f"the reference has no channel {', '.join(missing)}, only {known}")
    planes = {name: seen[name].astype(CHANNELS[name][0]) for name in names}
    return Frame(planes, camera=camera, size=camera.size, **shown)


def _occlusion(value: object) -> float | None:
    """The maximum distance of ambient occlusion: None for off, infinite for True."""
    if isinstance(value, bool):
        return math.inf if value else None
    distance = real("ambient_occlusion", value, what="True, False or a distance > 0")
    if distance > 0:
        return distance
    raise SettingsError(f"ambient_occlusion must be True, False or a distance > 0, not {value!r}")


def _optional(name: str, value: object) -> int | None:
    return None if value is None else whole(name, value, 1, (1 << 32) - 1)


def _positive(name: str, value: object, what: str) -> float | None:
    """Returns a finite number above 0, or None."""
    if value is None:
        return None
    number = real(name, value, what=f"{what} > 0")
    if number > 0:
        return number
    raise SettingsError(f"{name} must be {what} > 0, not {value!r}")


def _stops(value: object) -> float:
    return real("exposure", value, -100, 100, what="a number of stops")


def _region(value: Region) -> list[int]:
    try:
        sides = [whole("region", side, 0, (1 << 32) - 1) for side in value]
    except TypeError:
        sides = []
    if len(sides) != 4:
        raise SettingsError(f"region must be (x, y, width, height) in pixels, not {value!r}")
    return sides
