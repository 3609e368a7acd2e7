"""Backgrounds laid behind frames: a colour or a picture, with the shadows that fall on the studio's floor."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import FormatError, SettingsError, WorldError
from ..render import render
from ..render.frame import Frame
from . import World
from .studio import FLOOR
from .texture import Texture

__all__ = ["laid_over", "read_backdrop"]

Colors = npt.NDArray[np.float32]
PICTURES = (".png", ".jpg", ".jpeg")
SHADE_NOISE = 0.04
"""The part of the light that a shadow takes at least: less is the noise of the samples."""


def read_backdrop(background: Any, size: tuple[int, int]) -> Colors:
    """A background [h, w, 3] for a picture of `size` (width, height), in linear light.

    `background` is a colour, the path of a .png or .jpg picture, which is enlarged and cut to cover the frame, or an
    array [h, w, 3] of that size (bytes are sRGB). Raises `SettingsError`, `FormatError` and `OSError`.
    """
    width, height = size
    if isinstance(background, str | os.PathLike) and Path(background).suffix.lower() in PICTURES:
        return _picture(Path(background), size)
    if isinstance(background, np.ndarray) and background.ndim == 3:
        if background.shape != (height, width, 3):
            raise SettingsError(
                f"background has the shape {list(background.shape)}: expected [{height}, {width}, 3], the frame's"
            )
        if background.dtype == np.uint8:
            return _core.linear_from_srgb8(np.ascontiguousarray(background))
        return background.astype(np.float32)
    return np.broadcast_to(_color(background), (height, width, 3)).astype(np.float32)


def laid_over(frame: Frame, background: Any, shadowed: Frame | None = None) -> Frame:
    """The frame, rendered with `transparent_background=True`, in front of a background of `read_backdrop`.

    `shadowed` is the same picture in the studio: as much as its floor is darkened, the background is.
    """
    if not (frame.transparent and "color" in frame and "alpha" in frame):
        raise SettingsError(
            "no opacity: render the frame with transparent_background=True and the channel color"
        )
    color, alpha = frame["color"], frame["alpha"][..., np.newaxis]
    behind = read_backdrop(background, (color.shape[1], color.shape[0]))
    if shadowed is None:
        laid = color + (1 - alpha) * behind
    else:
        lit = shadowed["color"]
        floor = np.clip(lit - color, 0, (1 - alpha) * FLOOR)
        share = floor / np.maximum((1 - alpha) * np.float32(FLOOR), np.float32(1e-6))
        share = np.minimum(share / np.float32(1 - SHADE_NOISE), 1)
        laid = lit - floor + (1 - alpha) * behind * share
    channels = {name: frame[name] for name in frame if name not in ("alpha", "color")}
    first = {"color": np.maximum(laid, 0).astype(np.float32)}
    return Frame(
        first | channels,
        camera=frame.camera,
        size=frame.size,
        region=frame.region,
        exposure=frame.exposure,
        view=frame.view,
        notices=frame.notices if shadowed is None else shadowed.notices,
    )


def _color(color: Any) -> Colors:
    """A colour as linear red, green, blue."""
    probe = World()
    try:
        probe.add_object(box={}, color=color)
    except WorldError as fault:
        raise SettingsError(
            f"background {color!r} is no colour and no .png or .jpg picture: {str(fault).splitlines()[0]}"
        ) from None
    found: Colors = probe.triangle_colors()[0]
    return found


def _picture(path: Path, size: tuple[int, int]) -> Colors:
    """A picture that covers a frame of this size, cut evenly at the sides that are too long."""
    own_width, own_height = _size_in_header(path)
    width, height = size
    world = World()
    world.add_object(
        plane={"size": [own_width, own_height]},
        type="unlit",
        color=[1, 1, 1],
        texture=Texture(path.absolute(), wrap="clamp"),
    )
    scale = max(width / own_width, height / own_height)
    half = np.array([width - 1, height - 1]) / 2
    matrix = [[scale, 0, 0, half[0]], [0, -scale, 0, half[1]], [0, 0, 0, 1]]
    camera = Camera.from_matrix(matrix, size)
    samples = 1 if scale == 1 else 16
    found: Colors = render(world, camera, integrator="flat", samples=samples, channels="color")["color"]
    return found


def _size_in_header(path: Path) -> tuple[int, int]:
    """The width and height of a PNG or JPEG picture."""
    with path.open("rb") as file:
        data = file.read(1 << 20)
    if data.startswith(b"\x89PNG\r\n\x1a\n") and len(data) >= 24:
        width, height = struct.unpack(">II", data[16:24])
        return width, height
    place = 2
    while data.startswith(b"\xff\xd8") and place + 9 <= len(data) and data[place] == 0xFF:
        marker = data[place + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (
            0xC4,
            0xC8,
            0xCC,
        ):  # a start of frame, ITU-T T.81 table B.1
            height, width = struct.unpack(">HH", data[place + 5 : place + 9])
            return width, height
        place += 2 + struct.unpack(">H", data[place + 2 : place + 4])[0]
    raise FormatError(f"{path}: expected a PNG or JPEG picture as a background")
