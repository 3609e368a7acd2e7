"""Progressive pictures: samples are added in slices, for as long as one looks."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Self

from .. import _core
from .._core import Cancel
from ..arguments import whole
from ..camera import Camera
from ..errors import SettingsError
from ..render.arguments import camera_of, world_of
from .frame import Frame
from .render import MAX_SAMPLES, Region, _region, channel_names, request_of

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Cancel", "Progressive", "progressive"]

SAMPLED = ("color", "alpha", "coverage", "error")
"""The channels that change with samples."""
LONGEST = 1e6  # seconds of a slice


class Progressive:
    """A picture to which samples are added. At any time it is that of `render` with as many samples, to the bit."""

    def __init__(
        self,
        world: World | str | os.PathLike[str],
        camera: Camera | str | os.PathLike[str] | None = None,
        *,
        channels: Sequence[str] | str = ("color", "alpha"),
        samples: int = MAX_SAMPLES,
        frame: int = 0,
        region: Region | None = None,
        transparent_background: bool = False,
        **settings: Any,
    ) -> None:
        """Begins a picture of `world`, seen by `camera`, without samples.

        World and camera are those of `render`. `channels` may be "color", "alpha", "coverage" and "error"; ground truth
        does not change with samples: render it once. `samples` is the number per pixel at which `add_for` ends.
        `settings` are those of `render`: `integrator`, `max_depth`, `clamp`, `filter`, `seed`, `ambient_occlusion`,
        `exposure`, `view` and `threads`, with the values of `[render]` of the world file, or else the defaults. Shadow
        catchers are surfaces, and there is no studio and no background behind the picture.

        Each square of 32 x 32 pixels or fewer keeps its own number of samples. Whatever stopped or sliced it, on any
        number of threads, its pixels are those of `render(samples=n)` for its n. A number that changes the picture's
        making (from 1 to 2, up to 16 in textured worlds, and once where a larger number pays for another tree) takes
        its samples anew.

        Raises `SettingsError` for other channels and settings, and errors of `render`.
        """
        self._options: dict[str, Any] = {
            "channels": channels,
            "samples": samples,
            "frame": frame,
            "region": region,
            "transparent_background": transparent_background,
            **settings,
        }
        self._world = world_of(world)
        self._camera = camera_of(self._world, camera)
        names = channel_names(channels)
        for name in names:
            if name not in SAMPLED:
                raise SettingsError(f"channel {name!r} does not change with samples: render it once")
        if transparent_background and self._world._core.has_catchers:
            raise SettingsError("shadow catchers are left out of pictures of render, not of progressive ones")
        request, self._exposure, self._view = request_of(
            self._world,
            {**settings, "samples": samples},
            names=names,
            surface="first",
            frame=frame,
            transparent_background=transparent_background,
            region=region,
        )
        for name in ("noise_threshold", "time_limit"):
            if settings.get(name) is not None:
                raise SettingsError(
                    f"{name} is an option of render: a progressive picture ends when you stop"
                )
            request[name] = None
        if request["integrator"] == "reference":
            raise SettingsError('integrator="reference" has no samples: render it once')
        self._clear = transparent_background
        self._core = _core.Progressive(self._world._core, self._camera._core, request)

    @property
    def samples(self) -> int:
        """The samples of the pixel that has the fewest."""
        return self._core.samples(None)

    def add(self, samples: int = 1, *, region: Region | None = None, cancel: Cancel | None = None) -> int:
        """Adds samples to every pixel, or those of `region` (x, y, width, height) and the squares that it touches.

        Pixels that have more than others get fewer. Returns the samples of the pixel there that has the fewest. Raises
        `Cancelled` once `cancel` is cancelled; every pixel is then a picture of the samples that it has.
        """
        count = whole("samples", samples, 1, 1 << 24)
        area = None if region is None else _region(region)
        least = self._core.samples(area)
        self._core.add(least + count, area, cancel)
        return self._core.samples(area)

    def add_for(self, seconds: float, *, cancel: Cancel | None = None) -> int:
        """Adds samples for about this time, from the middle outwards, and returns the samples of all pixels.

        It ends at a square of pixels, and at the picture's `samples`. Raises `Cancelled` as `add` does.
        """
        if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 <= seconds <= LONGEST:
            raise SettingsError(f"seconds must be a number from 0 to {LONGEST:g}, not {seconds!r}")
        return self._core.add_for(float(seconds), cancel)

    def frame(self) -> Frame:
        """The picture as it is. Raises `SettingsError` while a pixel has no sample."""
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
        """Begins anew, with another world, camera or settings where they are given."""
        options = self._options | settings
        seen = self._world if world is None else world
        self.__init__(seen, self._camera if camera is None else camera, **options)  # type: ignore[misc]
        return self

    def __repr__(self) -> str:
        """The size and the samples."""
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
    """The frames of a picture that gets better: `for frame in raycam.progressive(world, camera): ...`.

    Frames have 1, 2, 4, 8, ... samples, up to `samples` (default 16384), or come `every` so many seconds. They are
    those of `render` with so many samples, to the bit. `options` are those of `Progressive`. `cancel` ends the loop.
    """
    from ..errors import Cancelled

    picture = Progressive(world, camera, **options)
    most = whole("samples", picture._options["samples"], 1, 1 << 24)
    try:
        while (least := picture.samples) < most:
            if every is None:
                picture.add(min(max(least, 1), most - least), cancel=cancel)
            elif picture.add_for(every, cancel=cancel) == 0:
                continue
            yield picture.frame()
    except Cancelled:
        return
