"""Composition of frames with background images, including shadows on the background."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..errors import SettingsError
from ..notices import warn_all
from ..world.studio import FLOOR
from .background import numpy_background, picture_behind
from .frame import Frame

__all__ = ["over", "shadow_ratio", "studio_shadow"]

Colors = npt.NDArray[np.float32]
MIN_STUDIO_SHADE = 0.04
"""Minimum fraction of light that a studio shadow removes; smaller differences are sampling noise."""
MIN_CATCHER_RADIANCE = 1e-9
"""Radiance up to which a shadow catcher counts as unlit."""


def over(frame: Frame, background: Any, *, keep: Iterable[str] = ()) -> Frame:
    """Returns a transparent frame in front of a background; see `Frame.over`.

    The frame must have been rendered with `transparent_background=True`. The frame's exposure and view apply to the
    frame only; the background's values are unchanged. `keep` lists which of the channels `alpha` and `shadow` the
    result also contains. Raises `SettingsError` for a frame without opacity, and the errors of `picture_behind`.
    """
    if not (frame.transparent and "color" in frame and "alpha" in frame):
        raise SettingsError(
            "the frame has no opacity; render it with transparent_background=True and the channel color",
            code="missing_value",
        )
    x, y, width, height = frame.region
    background = numpy_background(background)
    part = isinstance(background, np.ndarray) and background.shape[:2] == (height, width)
    size = (width, height) if part else frame.size
    behind, notices = picture_behind(background, frame.camera, size)
    warn_all(notices)
    if not part:
        behind = behind[y : y + height, x : x + width]
    alpha = frame["alpha"][..., np.newaxis]
    light = frame["shadow"] if "shadow" in frame else np.float32(1)
    laid = _shown(frame) + (1 - alpha) * (light * behind)
    gone = {"color", *({"alpha", "shadow"} - set(keep))}
    channels = {name: frame[name] for name in frame if name not in gone}
    return Frame(
        {"color": np.maximum(laid, 0).astype(np.float32)} | channels,
        camera=frame.camera,
        size=frame.size,
        region=frame.region,
        notices=[*frame.notices, *notices],
    )


def shadow_ratio(alpha: Colors, caught: dict[str, Any], free: dict[str, Any]) -> Colors:
    """Returns the channel `shadow` [h, w, 3].

    The channel contains the factor by which shadow catchers darken the background. `alpha` is the objects' opacity.
    `caught` and `free` are the colour and alpha of the shadow catchers, rendered with and without the objects.
    """
    share, whole = caught["alpha"][..., np.newaxis], free["alpha"][..., np.newaxis]
    left = 1 - alpha[..., np.newaxis]
    lit = caught["color"] / np.where(share > 0, share, 1)
    unlit = free["color"] / np.where(whole > 0, whole, 1)
    ratio = np.where(unlit > MIN_CATCHER_RADIANCE, lit / np.where(unlit > MIN_CATCHER_RADIANCE, unlit, 1), 1)
    shadow = 1 + share * (ratio - 1) / np.where(left > 0, left, 1)
    return np.where(left > 0, np.maximum(shadow, 0), 1).astype(np.float32)


def studio_shadow(frame: Frame, shadowed: Frame) -> Frame:
    """Returns the frame with the shadow on the studio's floor as its channel `shadow`.

    `shadowed` is the image rendered with that floor.
    """
    color, left, lit = frame["color"], 1 - frame["alpha"][..., np.newaxis], shadowed["color"]
    floor = np.clip(lit - color, 0, left * FLOOR)
    share = floor / np.maximum(left * np.float32(FLOOR), np.float32(1e-6))
    share = np.minimum(share / np.float32(1 - MIN_STUDIO_SHADE), 1)
    return Frame(
        dict(frame) | {"color": lit - floor, "shadow": share},
        camera=frame.camera,
        size=frame.size,
        region=frame.region,
        exposure=frame.exposure,
        view=frame.view,
        transparent=True,
        notices=shadowed.notices,
    )


def _shown(frame: Frame) -> Colors:
    """The premultiplied colour in linear display light, after exposure and view transform."""
    color = frame["color"]
    if frame.view == "standard":
        return np.asarray(color * np.float32(2.0**frame.exposure))
    alpha = frame["alpha"][..., np.newaxis]
    opacity = np.where(alpha > 0, alpha, 1)
    plain = np.ascontiguousarray(color / opacity, dtype=np.float32)
    shown = _core.shown_from_linear(plain, 2.0**frame.exposure, frame.view) * opacity
    return np.where((alpha > 0) | (color > 0).any(axis=2, keepdims=True), shown, 0)
