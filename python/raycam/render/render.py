"""Rendering of a world, seen by a camera, into a frame."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

from .._core import Cancel
from ..arguments import flag
from ..camera import Camera
from ..errors import Notice, SettingsError
from ..notices import warn_all
from .arguments import camera_of, world_of
from .composition import over, shadow_ratio, studio_shadow
from .fireflies import firefly_notices
from .frame import CHANNELS, Frame
from .options import RenderOptions, check_option, given_options
from .request import (
    DEFAULT_CHANNELS,
    Region,
    Surface,
    channel_names,
    image_request,
    is_shaded,
    unlit,
)
from .sight import LIT_INTEGRATORS, blank_notices
from .studio import STUDIO_NOTICE, is_unlit, studio_options

if TYPE_CHECKING:
    from ..world import World

__all__ = ["CATCHER_NOTICE", "Progress", "render"]

Progress = Callable[[int, int], object]

CATCHER_NOTICE = Notice(
    "shadow catchers are rendered as surfaces; to show only their shadows, use transparent_background=True or a "
    "background",
    "shadow_catchers_visible",
)


def _list_options(function: Callable[..., Frame]) -> Callable[..., Frame]:
    """Lists the keys of `RenderOptions` in the function's signature, for `help` and editors."""
    signature = inspect.signature(function)
    own = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]
    listed = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hint.__forward_arg__)
        for name, hint in RenderOptions.__annotations__.items()
    ]
    function.__signature__ = signature.replace(parameters=[*own, *listed])  # type: ignore[attr-defined]
    return function


def render(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None = None,
    *,
    channels: Sequence[str] | str = DEFAULT_CHANNELS,
    surface: Surface = "first",
    frame: int = 0,
    region: Region | None = None,
    denoise: bool = False,
    transparent_background: bool = False,
    background: Any = None,
    catcher_truth: bool = False,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    **options: Unpack[RenderOptions],
) -> Frame:
    """Renders `world`, as seen by `camera`, and returns a `Frame`.

    `camera` is a `Camera`, the name of a camera in the world, or the path of a calibration file. Without `camera`,
    the world's first camera is used, or a camera that shows the whole world. A world without lights and cameras is
    then shown in the studio of `World.add_studio`, whose floor is background in ground truth.

    * `channels` are names, or "all". `region` (x, y, width, height) renders a part; `Frame.merge` joins parts.
    * `surface` ("first"): ground truth describes the first triangle on the pixel's centre ray. "solid" skips surfaces
      with an opacity below one half, back faces of one-sided surfaces, glass, and transmission of one half or more.
    * `frame` (0) is the number of a video's frame: frames have independent noise.
    * `denoise` applies Open Image Denoise (`pip install raycam[denoise]`): the image is then biased.
    * `transparent_background` hides the background. Colours are premultiplied by the channel `alpha`, which is added.
      Objects with `shadow_catcher` are hidden; the channel `shadow` is added, the factor by which their shadows darken
      the background.
    * `background` (`Camera.background`): a colour, a photo's path, an array, a tensor or a `Background` (`Frame.over`).
    * `catcher_truth`: ground truth describes shadow catchers even if they are hidden.
    * `progress(done, total)` is called about 50 times per second; an exception in it stops the render, as Ctrl-C does.
      `cancel.cancel()` stops it from another thread.

    Options that are not given have the value in `[render]` of the world file, or the default:

    * `integrator`: "direct" (default) adds direct light and shadows, "path" is path tracing with any number of bounces,
      and "ao" is ambient occlusion. "flat" shows the base colour, and "reference" is a slow NumPy program for
      comparison.
    * `samples` (16) is the number per pixel. `noise_threshold` chooses the number for each pixel so that the standard
      error of its luminance (channel `error`) is about this value or less, without bias (Kirk and Arvo 1991).
      `time_limit` ends the render after about this many seconds; a notice reports the number of samples that reproduces
      the image. With either option, `samples` is the maximum (16384).
    * `max_depth` is the maximum number of path segments: 1 shows only emission, 2 adds direct light. `clamp` is the
      maximum radiance of a sample; it removes fireflies and darkens the image. `filter` is "box" (default) or
      "blackman-harris".
    * `ambient_occlusion`: True, or the distance in metres up to which surfaces occlude the sky.
    * `seed` (0) selects the random numbers. The number of `threads` (default: all) does not change the image.
    * `exposure` (0 stops) and `view` ("standard", "agx", "pbr_neutral") of sRGB images: see `Frame.to_srgb8`.

    Raises `SettingsError` for invalid arguments, `WorldError` for an invalid world, and `CameraError` if the world is
    empty.
    """
    world, names = world_of(world), channel_names(channels)
    image = _Image(world, camera_of(world, camera), given_options(options, ARGUMENTS), surface, frame, region)
    image = replace(
        image, is_framed=camera is None and world._first_camera is None, progress=progress, cancel=cancel
    )
    image = replace(image, denoise=flag("denoise", denoise), truth=flag("catcher_truth", catcher_truth))
    return image.over(background, names, flag("transparent_background", transparent_background))


@dataclass(frozen=True)
class _Image:
    """One image to render."""

    world: World
    camera: Camera
    options: dict[str, Any]
    """The options that are given."""
    surface: str
    number: int
    """The frame's number."""
    region: Region | None
    is_framed: bool = False
    """True if raycam chose the camera."""
    denoise: bool = False
    truth: bool = False
    """True if ground truth includes shadow catchers even if images hide them (`catcher_truth`)."""
    progress: Progress | None = None
    cancel: Cancel | None = None

    @property
    def is_in_studio(self) -> bool:
        """True if the studio lights the world: raycam chose the camera, and the world has no lights."""
        options = self.world.render_settings | self.options
        return self.is_framed and is_unlit(self.world, self.camera, options)

    def over(self, background: Any, names: list[str], transparent: bool) -> Frame:
        """The frame in front of `background`, or of the camera's own background."""
        if background is not None and transparent:
            raise SettingsError(
                "background and transparent_background cannot be combined; use only one of them",
                code="conflicting_values",
            )
        if background is not None and "color" not in names:
            raise SettingsError(
                f"background requires the channel color; requested channels: {', '.join(names)}",
                code="missing_value",
            )
        behind = self.camera.background if background is None else background
        if behind is None or transparent or "color" not in names:
            # Without colour, a camera with a background gets the same masks as in the composed image.
            return self.frame(names, transparent or (behind is not None and self.world._core.has_catchers))
        front = self.frame(names, True)
        if self.is_in_studio:
            front = studio_shadow(front, self.frame(["color"], False))
        return over(front, behind, keep=names)

    def frame(self, names: list[str], transparent: bool) -> Frame:
        """The frame, with a transparent background if `transparent`."""
        world, camera, options = self.world, self.camera, self.options
        hides_catchers = transparent and world._core.has_catchers
        if transparent and "color" in names:
            names = list(dict.fromkeys([*names, "alpha", *(["shadow"] if hides_catchers else [])]))
        notices: list[Notice] = []
        if "color" in names and self.is_in_studio:
            world = world.in_studio(camera, ground=not transparent)
            options = studio_options(world.render_settings | options)
            notices = [STUDIO_NOTICE]
        if self.denoise:
            image = replace(self, world=world, options=options, is_framed=False, denoise=False)
            return _denoised(image, names, transparent, notices)
        if options.get("integrator") == "reference":
            return _reference(self, names, dict(options), transparent)
        request, stops, view = image_request(
            world,
            options,
            names=names,
            surface=self.surface,
            frame=self.number,
            transparent_background=transparent,
            region=self.region,
        )
        request["cancel"] = self.cancel
        if hides_catchers:
            planes, area, found = _without_catchers(world, camera, request, self.progress, self.truth)
        else:
            planes, area, found = _planes(world, camera, request, self.progress)
            if world._core.has_catchers and "color" in names:
                found = [*found, CATCHER_NOTICE]
        if self.region is None:
            found = [*found, *_blank(world, camera, planes, request, stops, view)]
            if "color" in planes and not hides_catchers:
                found += firefly_notices(world, camera, planes["color"], request)
        notices += found
        warn_all(notices)
        return Frame(
            planes,
            camera=camera,
            size=camera.size,
            region=area,
            exposure=stops,
            view=view,
            transparent=transparent,
            notices=notices,
        )


def _without_catchers(
    world: World, camera: Camera, request: dict[str, Any], progress: Progress | None, catcher_truth: bool
) -> tuple[dict[str, Any], tuple[int, int, int, int], list[Notice]]:
    """Returns the channels without shadow catchers, and the catchers' shadows.

    The shadows are the ratio of two images with the same samples.
    """
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
        default_lights = {core.lit_by_default_lights for core in (world._core, catchers)}
        if len(default_lights) == 1 or request["integrator"] not in LIT_INTEGRATORS:
            planes["shadow"] = shadow_ratio(planes["alpha"], caught, free)
        else:
            message = "shadow catchers show no shadows, because emissive objects are the only light"
            notices.append(Notice(message, "no_caught_shadows"))
    truth = [name for name in names if not is_shaded(name) and name not in ("alpha", "coverage", "shadow")]
    if catcher_truth and truth:
        plain = unlit(request, truth) | {"transparent_background": False}
        planes |= world._core.render(camera._core, plain, None)[0]
    return {name: planes[name] for name in names}, area, notices


def _planes(
    world: World, camera: Camera, request: dict[str, Any], progress: Progress | None
) -> tuple[dict[str, Any], tuple[int, int, int, int], list[Notice]]:
    """Returns the rendered channels, the rendered area, and notices.

    Ground truth of a world in the studio describes the world without the studio.
    """
    bare, names = world.without_studio, request["channels"]
    truth = [name for name in names if not is_shaded(name)]
    if bare is world or not truth or request["transparent_background"]:
        world.prepare(threads=request["threads"])
        return world._core.render(camera._core, request, progress)
    bare.prepare(threads=request["threads"])
    many = {"alpha", "coverage"} & set(truth)
    plain = unlit(request, truth, samples=min(request["samples"], 64) if many else 1)
    planes, area, notices = bare._core.render(camera._core, plain, None)
    if len(truth) < len(names):
        world.prepare(threads=request["threads"])
        shaded = request | {"channels": [name for name in names if is_shaded(name)]}
        lit, area, lit_notices = world._core.render(camera._core, shaded, progress)
        planes, notices = planes | lit, [*lit_notices, *notices]
    return {name: planes[name] for name in names}, area, list(dict.fromkeys(notices))


def _blank(
    world: World, camera: Camera, planes: dict[str, Any], request: dict[str, Any], stops: float, view: str
) -> list[Notice]:
    """The notices of `blank_notices` for a finished image."""
    shown = world.without_studio

    def truth() -> Any:
        return shown._core.render(camera._core, unlit(request, ["instance"]), None)[0]["instance"]

    return list(blank_notices(shown, camera, planes, str(request["integrator"]), stops, view, truth))


def _denoised(image: _Image, names: list[str], transparent: bool, notices: list[Notice]) -> Frame:
    """Renders and denoises an image.

    Raises `SettingsError` before anything is rendered if the library is missing.
    """
    from . import denoise

    denoise.load()
    if "color" not in names:
        raise SettingsError(
            f"denoise requires the channel color; requested channels: {', '.join(names)}",
            code="missing_value",
        )
    guided = list(dict.fromkeys([*names, *denoise.GUIDES, *(["alpha"] if transparent else [])]))
    noisy = image.frame(guided, transparent)
    guides = [noisy[name] for name in denoise.GUIDES]
    planes = {name: noisy[name] for name in names}
    if transparent:
        planes["color"] = denoise.denoise_premultiplied(noisy["color"], noisy["alpha"], *guides)
    else:
        planes["color"] = denoise.denoise(noisy["color"], *guides)
    if "shadow" in names and not (noisy["shadow"] == 1).all():
        planes["shadow"] = denoise.denoise(noisy["shadow"], *guides)
    message = "the image is denoised by Open Image Denoise, so it is an estimate and no longer unbiased"
    notice = Notice(message, "denoised")
    warn_all([*notices, notice])
    return Frame(
        planes,
        camera=image.camera,
        size=noisy.size,
        region=noisy.region,
        exposure=noisy.exposure,
        view=noisy.view,
        transparent=noisy.transparent,
        notices=[*notices, *noisy.notices, notice],
    )


def _reference(image: _Image, names: list[str], options: dict[str, Any], transparent: bool) -> Frame:
    """Renders with the NumPy reference."""
    from .. import reference

    shown = {name: check_option(name, options.pop(name, None)) for name in ("exposure", "view")}
    if options.get("samples") == 1:
        del options["samples"]  # the reference traces one ray per pixel
    unused = options.keys() - {"integrator"}
    unused |= {"region"} if image.region is not None else set()
    unused |= {"surface"} if image.surface != "first" else set()
    unused |= {"transparent_background"} if transparent else set()
    if unused:
        raise SettingsError(
            f'{", ".join(sorted(unused))}: not supported by integrator="reference", which traces one ray through each '
            "pixel's centre",
            code="conflicting_values",
        )
    planes = reference.render(image.world, image.camera, image.progress)
    missing = [name for name in names if name not in planes]
    if missing:
        known = ", ".join(name for name in CHANNELS if name in planes)
        raise SettingsError(
            f'channel {", ".join(missing)}: not supported by integrator="reference"; options: {known}',
            code="conflicting_values",
        )
    arrays = {name: planes[name].astype(CHANNELS[name][0]) for name in names}
    return Frame(arrays, camera=image.camera, size=image.camera.size, **shown)


ARGUMENTS = [
    name for name, each in inspect.signature(render).parameters.items() if each.kind is not each.VAR_KEYWORD
]
"""The arguments of `render` that are not render options."""
_list_options(render)
