"""Rendering: a world, a camera and what is asked of the picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ..arrays import whole
from ..camera import Camera
from ..errors import SettingsError, nearest
from .frame import CHANNELS, VIEWS, Frame

if TYPE_CHECKING:
    from ..world import World

__all__ = ["DEFAULT_CHANNELS", "FILTERS", "INTEGRATORS", "channel_names", "render"]

INTEGRATORS = ["flat", "direct", "path", "ao", "reference"]
SURFACES = ["first", "solid"]
FILTERS = ["box", "blackman-harris"]
DEFAULT_CHANNELS = ("color", "depth", "instance", "triangle")
DEFAULT_SAMPLES = 16
MAX_SAMPLES = 1 << 14
"""What a pixel gets at most where noise or time ends it."""

Integrator = Literal["flat", "direct", "path", "ao", "reference"]
Filter = Literal["box", "blackman-harris"]
Surface = Literal["first", "solid"]
View = Literal["standard", "agx", "pbr_neutral"]
Region = Sequence[int]
Progress = Callable[[int, int], object]


def render(
    world: World,
    camera: Camera | None = None,
    *,
    integrator: Integrator | None = None,
    samples: int | None = None,
    noise: float | None = None,
    time: float | None = None,
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
    transparent: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Frame:
    """What `camera` (default: the world's first, or one that frames everything) sees of `world`.

    What is not given is what `[render]` of the world's file says, or else the default:

    * `integrator` ("direct"): "flat" is the colour of the closest triangle, unlit; "direct" adds lights, shadows
      and reflectances (a world without lights gets a sky, and the frame says so in its notices); "path" follows
      light over any number of bounces, unbiased; "ao" shows how much of the sky each point sees; "reference" is
      "flat" by the lecture's procedure in NumPy, brute force and slow: the oracle.
    * `noise` instead of samples stops each pixel when the estimated standard error of its luminance is no more than
      that; the channel `error` is the estimate. `time` stops the picture after so many seconds and says how many
      samples give the same one again. With either, `samples` is the most that a pixel gets (16384).
    * `max_depth` (no limit): the segments of a path at most. 1 sees what shines, 2 what it lights, and so on.
    * `clamp` (off): the largest radiance of a sample. It hides bright specks and makes the picture darker, and the
      frame's notices say how often.
    * `samples` (16) rays per pixel; with 1, the ray through the pixel's centre. `filter` ("box") or
      "blackman-harris" weighs them. `channels` names what the frame holds, "all" for everything there is.
    * `surface` ("first"): ground truth is of the first triangle on the pixel's centre ray, whatever it is made of; with
      "solid", of the first that one does not see through: surfaces less than half opaque, the backs of one-sided ones
      and what refracts (glass, transmission of a half or more) are passed along the straight ray.
    * `seed` (0) and `frame` (0) choose the random numbers. The same call gives the same bytes on any number of
      `threads` (default: all that the process may use).
    * `ambient_occlusion` (off): True, or a distance in metres up to which surfaces darken the sky of others.
    * `region` (x, y, width, height) renders a part; `Frame.merge` joins parts. `exposure` (0) in stops and
      `view` ("standard", "agx" or "pbr_neutral") are for pictures in sRGB: see `Frame.to_srgb8`.
    * `denoise` (off) guesses the picture without its noise, by Open Image Denoise: `pip install raycam[denoise]`.
      It is then no longer unbiased, nor the same bytes on every machine.
    * `transparent` (off) leaves the sky out where the camera sees it, for pictures to be laid over others: the colour
      is premultiplied by the channel `alpha`, which comes with it, and PNG, EXR and videos have an opacity. What is
      see-through by its own opacity counts in part; mirrors and glass show the sky, and are opaque.
    * `progress(done, total)` is called some 50 times a second; an exception it raises stops the rendering, as
      Ctrl-C does.

    Raises `SettingsError` for arguments that make no sense, with the nearest valid name, `WorldError`, and
    `CameraError` where the world has no camera and nothing to frame.
    """
    given = {
        "integrator": integrator,
        "samples": samples,
        "noise": noise,
        "time": time,
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
    if camera is None:
        camera = world.default_camera()
    names = channel_names(channels)
    if transparent and "color" in names and "alpha" not in names:
        names.append("alpha")
    if denoise:
        every: dict[str, Any] = {**chosen, "frame": frame, "region": region, "surface": surface}
        every["transparent"] = transparent
        return _denoised(world, camera, names, every, progress)
    if chosen.get("integrator") == "reference":
        shown: dict[str, Any] = {"exposure": _stops(chosen.pop("exposure", 0.0))}
        shown["view"] = _name("view", chosen.pop("view", "standard"), VIEWS)
        unused = (chosen.keys() - {"integrator"}) | ({"region"} if region is not None else set())
        unused |= {"surface"} if surface != "first" else set()
        unused |= {"transparent"} if transparent else set()
        return _reference(world, camera, names, sorted(unused), shown)

    settings: dict[str, Any] = {
        "integrator": "direct",
        "samples": DEFAULT_SAMPLES,
        "filter": "box",
        "seed": 0,
    }
    settings |= {
        "noise": None,
        "time": None,
        "max_depth": None,
        "clamp": None,
        "threads": None,
        "ambient_occlusion": False,
        "exposure": 0.0,
        "view": "standard",
    }
    asked = world.render_settings | chosen
    if ("noise" in asked or "time" in asked) and "samples" not in asked:
        asked["samples"] = MAX_SAMPLES
    settings |= asked
    stops = _stops(settings.pop("exposure"))
    display = _name("view", settings.pop("view"), VIEWS)
    request = {
        "integrator": _name("integrator", settings["integrator"], INTEGRATORS),
        "samples": whole("samples", settings["samples"], 1, (1 << 32) - 1),
        "filter": _name("filter", settings["filter"], FILTERS),
        "seed": whole("seed", settings["seed"], 0, (1 << 64) - 1),
        "frame": whole("frame", frame, 0, (1 << 32) - 1),
        "channels": names,
        "surface": _name("surface", surface, SURFACES),
        "transparent": bool(transparent),
        "max_depth": _optional("max_depth", settings["max_depth"]),
        "noise": _positive("noise", settings["noise"], "a radiance"),
        "time": _positive("time", settings["time"], "seconds"),
        "clamp": _positive("clamp", settings["clamp"], "a radiance"),
        "ambient_occlusion": _occlusion(settings["ambient_occlusion"]),
        "region": None if region is None else _region(region),
        "threads": None if settings["threads"] is None else whole("threads", settings["threads"], 1, 1 << 16),
    }
    planes, area, notices = world._core.render(camera._core, request, progress)
    return Frame(
        planes,
        camera=camera,
        size=camera.size,
        region=area,
        exposure=stops,
        view=display,
        transparent=transparent,
        notices=notices,
    )


def channel_names(channels: Sequence[str] | str) -> list[str]:
    """The names of channels, each once; "all" is every one there is. Raises `SettingsError`."""
    if isinstance(channels, str):
        channels = list(CHANNELS) if channels == "all" else [channels]
    names = [_name("channel", name, list(CHANNELS)) for name in channels]
    if not names:
        raise SettingsError(f"channels is empty; there are {', '.join(CHANNELS)}")
    return list(dict.fromkeys(names))


def _denoised(
    world: World, camera: Camera, names: list[str], settings: dict[str, Any], progress: Progress | None
) -> Frame:
    """The picture without noise; the library is asked for before anything is rendered."""
    from . import denoise

    denoise.load()
    if "color" not in names:
        raise SettingsError(f"denoise is for the channel color, this has {', '.join(names)}")
    wanted = list(dict.fromkeys([*names, *denoise.GUIDES]))
    seen = render(world, camera, channels=wanted, progress=progress, **settings)
    color = denoise.denoise(seen["color"], *(seen[name] for name in denoise.GUIDES))
    planes = {name: color if name == "color" else seen[name] for name in names}
    return Frame(
        planes,
        camera=camera,
        size=seen.size,
        region=seen.region,
        exposure=seen.exposure,
        view=seen.view,
        transparent=seen.transparent,
        notices=[*seen.notices, "the picture is denoised by Open Image Denoise: a guess, no longer unbiased"],
    )


def _reference(
    world: World, camera: Camera, names: list[str], unused: list[str], shown: dict[str, Any]
) -> Frame:
    """The picture of the oracle."""
    from .. import reference

    if unused:
        raise SettingsError(
            f"{', '.join(unused)}: the reference traces one ray through each pixel's centre, plainly"
        )
    seen = reference.render(world, camera)
    missing = [name for name in names if name not in seen]
    if missing:
        known = ", ".join(name for name in CHANNELS if name in seen)
        raise SettingsError(f"the reference has no channel {', '.join(missing)}, only {known}")
    planes = {name: seen[name].astype(CHANNELS[name][0]) for name in names}
    return Frame(planes, camera=camera, size=camera.size, **shown)


def _name(what: str, given: object, valid: list[str]) -> str:
    if not isinstance(given, str):
        raise SettingsError(f"{what} must be one of {', '.join(valid)}, not {given!r}")
    if given not in valid:
        raise SettingsError(nearest(what, given, valid))
    return given


def _occlusion(value: object) -> float | None:
    """The distance up to which surfaces count."""
    if isinstance(value, bool):
        return math.inf if value else None
    if isinstance(value, int | float) and value > 0:
        return float(value)
    raise SettingsError(f"ambient_occlusion must be True, False or a distance > 0, not {value!r}")


def _optional(name: str, value: object) -> int | None:
    return None if value is None else whole(name, value, 1, (1 << 32) - 1)


def _positive(name: str, value: object, what: str) -> float | None:
    """A finite number above 0, or None."""
    if value is None:
        return None
    if not isinstance(value, bool) and isinstance(value, int | float) and 0 < value < math.inf:
        return float(value)
    raise SettingsError(f"{name} must be {what} > 0, not {value!r}")


def _stops(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 100:
        raise SettingsError(f"exposure must be a number of stops from -100 to 100, not {value!r}")
    return float(value)


def _region(value: Region) -> list[int]:
    try:
        sides = [whole("region", side, 0, (1 << 32) - 1) for side in value]
    except TypeError:
        sides = []
    if len(sides) != 4:
        raise SettingsError(f"region must be (x, y, width, height) in pixels, not {value!r}")
    return sides
