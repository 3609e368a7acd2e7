"""Textures of materials."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..arguments import refuse_mask
from ..errors import WorldError
from ..one_line import one_line

Wrap = Literal["repeat", "clamp", "mirror"]


@one_line
@dataclass(frozen=True, eq=False)
class Texture:
    """An image with its lookup parameters, for the keys `texture` and `textures` of an object.

    `image` is the path of an image file, or an array [h, w] or [h, w, 1..4] whose first row is at v = 0: uint8,
    uint16 or bool (sRGB for colours, otherwise linear), or linear floats. Floats outside 0 to 1 (for emission:
    below 0) are clamped, with a notice; heights may have any sign. `wrap` is the addressing mode outside 0..1
    (one for both axes or one each), `filter` the interpolation between texels. Texture coordinates (u, v) are
    multiplied by `repeat`, rotated by `rotation` degrees and shifted by `offset`, as in glTF's
    `KHR_texture_transform`. `uv_set` selects one of the mesh's coordinate sets. `channel` uses one channel of the
    image for all values. `strength` scales normal and occlusion textures.

        box = world.add_object(box={}, type="principled", textures={"roughness": raycam.Texture(array, repeat=4)})

    Raises `WorldError` for an array with a wrong shape or dtype.
    """

    image: str | os.PathLike[str] | npt.NDArray[Any]
    wrap: Wrap | tuple[Wrap, Wrap] = "repeat"
    filter: Literal["linear", "nearest"] = "linear"
    repeat: float | Sequence[float] = 1.0
    rotation: float = 0.0
    offset: Sequence[float] = (0.0, 0.0)
    uv_set: int = 0
    channel: Literal["red", "green", "blue", "alpha"] | None = None
    strength: float | None = None

    def description(self) -> dict[str, Any]:
        """Returns the texture as a table of a world file."""
        table = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "image"}
        return {"image": _image(self.image)} | {
            name: value for name, value in table.items() if value is not None
        }


def _image(image: object) -> object:
    if isinstance(image, str | os.PathLike):
        return os.fspath(image)
    refuse_mask("texture", image, WorldError)
    array = np.asarray(image)
    if array.ndim not in (2, 3) or array.size == 0 or (array.ndim == 3 and not 1 <= array.shape[2] <= 4):
        raise WorldError(
            f"texture of shape {list(array.shape)}: expected [h, w] or [h, w, 1..4]", code="wrong_shape"
        )
    if array.dtype not in (np.uint8, np.uint16, np.bool_) and array.dtype.kind != "f":
        raise WorldError(
            f"texture of dtype {array.dtype}: expected uint8, uint16, bool or floats", code="wrong_type"
        )
    return array
