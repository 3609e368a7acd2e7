"""Progressive images, to which samples are added until the result is good enough."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Self, Unpack

from .. import _core
from .._core import Cancel
from ..arguments import real, whole
from ..camera import Camera
from ..errors import SettingsError
from ..render.arguments import camera_of, world_of
from .frame import Frame, is_pass
from .options import ADAPTIVE_SAMPLES, MAX_SAMPLES, RenderOptions, given_options
from .request import Region, channel_names, check_region, image_request

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Cancel", "Progressive", "progressive"]

SAMPLED_CHANNELS = ("color", "alpha", "coverage", "error")
"""Channels that depend on the number of samples."""
MAX_SLICE_S = 1e6
"""Longest slice of `add_for`, in seconds."""


class Progressive:
    """An image to which samples are added.

    The image is always bit-identical to an image by `render` with the same number of samples.
    """

    def __init__(
        self,
        world: World | str | os.PathLike[str],
        camera: Camera | str | os.PathLike[str] | None = None,
        *,
        channels: Sequence[str] | str = ("color", "alpha"),
        frame: int = 0,
        region: Region | None = None,
        transparent_background: bool = False,
        **options: Unpack[RenderOptions],
    ) -> None:
        """Creates an image of `world` by `camera`, initially without samples.

        `world`, `camera`, `frame`, `region` and `transparent_background` are as in `render`. `channels` may
        be "color", "alpha", "coverage" and "error"; ground truth does not depend on the number of samples.
        `samples` (16384) is the number per pixel at which `add_for` stops. `options` are the options of
        `render` except `noise_threshold` and `time_limit`. Shadow catchers are shown as ordinary surfaces;
        the studio and backgrounds are not supported.

        Each tile of 32 x 32 pixels or fewer has its own number of samples n. Its pixels are identical to
        `render(samples=n)`, independent of the calls that added the samples and of the number of threads. When n
        increases from 1 to 2, reaches 16 in a textured world, or becomes so large that another acceleration structure
        is faster, the image is computed differently, and the tile is sampled from scratch.

        Raises `SettingsError` for other channels and options, and the errors of `render`.
        """
        self._options: dict[str, Any] = {
            "channels": channels,
            "frame": frame,
            "region": region,
            "transparent_background": transparent_background,
            **options,
        }
        given = given_options(options, ("channels", "frame", "region", "transparent_background"))
        for name in ("noise_threshold", "time_limit"):
            if name in given:
                raise SettingsError(
                    f"{name} is not supported by Progressive; stop adding samples when the image is good enough",
                    code="conflicting_values",
                )
        if given.get("integrator") == "reference":
            raise SettingsError(
                'integrator="reference" is not supported by Progressive; use raycam.render',
                code="conflicting_values",
            )
        self._world = world_of(world)
        self._camera = camera_of(self._world, camera)
        names = channel_names(channels)
        for name in names:
            if name not in SAMPLED_CHANNELS and not is_pass(name):
                raise SettingsError(
                    f"channel {name!r} does not depend on the number of samples; use raycam.render",
                    code="conflicting_values",
                )
        if transparent_background and self._world._core.has_catchers:
            raise SettingsError(
                "shadow catchers with transparent_background are not supported by Progressive; use raycam.render",
                code="conflicting_values",
            )
        request, self._exposure, self._view = image_request(
            self._world,
            {"samples": ADAPTIVE_SAMPLES, **given},
            names=names,
            surface="first",
            frame=frame,
            transparent_background=transparent_background,
            region=region,
        )
        self._max_samples = request["samples"]
        # These options of the world file are not used.
        request |= {"noise_threshold": None, "time_limit": None}
        self._clear = transparent_background
        self._core = _core.Progressive(self._world._core, self._camera._core, request)

    @property
    def samples(self) -> int:
        """The smallest number of samples among all pixels."""
        return self._core.samples(None)

    def add(self, samples: int = 1, *, region: Region | None = None, cancel: Cancel | None = None) -> int:
        """Adds `samples` to all pixels, or to the tiles that touch `region` (x, y, width, height).

        Tiles that already have more samples get fewer new samples. Returns the smallest number of samples of a pixel in
        the region. Raises `Cancelled` when `cancel` is cancelled; the samples added so far are kept.
        """
        count = whole("samples", samples, 1, MAX_SAMPLES)
        area = None if region is None else check_region(region)
        least = self._core.samples(area)
        self._core.add(least + count, area, cancel)
        return self._core.samples(area)

    def add_for(self, seconds: float, *, cancel: Cancel | None = None) -> int:
        """Adds samples for about `seconds`, from the centre outwards.

        Returns the smallest number of samples of any pixel. A tile that was started is finished. The call returns early
        when all pixels have the image's `samples`. Raises `Cancelled` as `add` does.
        """
        slice_s = real("seconds", seconds, 0, MAX_SLICE_S, what="a number of seconds")
        return self._core.add_for(slice_s, cancel)

    def frame(self) -> Frame:
        """Returns the current image; raises `SettingsError` while a pixel has no sample."""
        planes, area, notices = self._core.develop()
        return Frame(
            planes,
            camera=self._camera,
            size=self._camera.size,
            region=area,
            exposure=self._exposure,
            view=self._view,
            transparent=self._clear,
            notices=notices,
        )

    def restart(
        self,
        *,
        world: World | None = None,
        camera: Camera | str | os.PathLike[str] | None = None,
        **settings: Any,
    ) -> Self:
        """Removes all samples; replaces the `world`, the `camera` and `settings` that are given."""
        options = self._options | settings
        seen = self._world if world is None else world
        self.__init__(seen, self._camera if camera is None else camera, **options)  # type: ignore[misc]
        return self

    def __repr__(self) -> str:
        """The size and the number of samples as text."""
        width, height = self._camera.size
        return f"Progressive({width} x {height}, {self.samples} samples)"


def progressive(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None = None,
    *,
    every: float | None = None,
    cancel: Cancel | None = None,
    **options: Any,
) -> Iterator[Frame]:
    """Yields frames of one image with more and more samples.

    Example: `for frame in raycam.progressive(world, camera): ...`.

    The frames have 1, 2, 4, 8, ... samples per pixel, up to `samples` (default 16384); with `every`, a frame is
    yielded about every `every` seconds. Each frame is bit-identical to `render` with the same number of samples.
    `world`, `camera` and `options` are those of `Progressive`. Cancelling `cancel` ends the loop.
    """
    from ..errors import Cancelled

    picture = Progressive(world, camera, **options)
    most = picture._max_samples
    try:
        while (least := picture.samples) < most:
            if every is None:
                picture.add(min(max(least, 1), most - least), cancel=cancel)
            elif picture.add_for(every, cancel=cancel) == 0:
                continue
            yield picture.frame()
    except Cancelled:
        return
