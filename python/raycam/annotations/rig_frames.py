"""Rendering with all cameras of a rig."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import several, word
from ..errors import CameraError
from ..render import channel_names, render
from ..render.camera_seed import with_camera_seed
from ..render.frame import Frame
from ..rig import Rig
from ..world import World
from .flow import disparity

__all__ = ["render_rig"]


def render_rig(
    rig: Rig,
    world: World,
    *,
    channels: Sequence[str] | str,
    pair: tuple[str, str] | None,
    **options: Any,
) -> dict[str, Frame]:
    """Renders a frame with each camera of a rig; see `Rig.render`."""
    if not rig:
        raise CameraError(f"rig {rig.name!r} has no camera to render with", code="missing_camera")
    listed = [channels] if isinstance(channels, str) else several("channels", channels, "names")
    requested = [word("channel", name) for name in listed]
    names = [name for name in requested if name != "disparity"]
    found: dict[str, npt.NDArray[Any]] = {}
    if len(names) < len(requested):
        left, right = rig.pair(*(pair or ()))
        cameras, threads = (rig[left], rig[right]), options.get("threads")
        found[left] = disparity(world, *cameras, of="left", threads=threads)["disparity"]
        found[right] = disparity(world, *cameras, of="right", threads=threads)["disparity"]
    plain = channel_names("all" if names == ["all"] else names or ["depth"])
    frames = {}
    for index, (name, camera) in enumerate(rig.items()):
        frame = render(world, camera, channels=plain, **with_camera_seed(options, index))
        planes = {key: frame[key] for key in frame if names}
        if name in found:
            x, y, width, height = frame.region
            planes["disparity"] = np.ascontiguousarray(found[name][y : y + height, x : x + width])
        frames[name] = Frame(
            planes,
            camera=camera,
            size=frame.size,
            region=frame.region,
            exposure=frame.exposure,
            view=frame.view,
            transparent=frame.transparent,
            notices=frame.notices,
        )
    return frames
