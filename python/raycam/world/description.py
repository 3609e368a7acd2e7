"""Converts descriptions of parts of a world to the core's types.

These types are dicts, lists, arrays and strings.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import floats, is_tensor, numbers, refuse_mask
from ..camera import Camera
from ..errors import WorldError
from .texture import Texture

__all__ = ["corner_values", "indices", "plain"]


def plain(value: Any, name: str = "value") -> Any:
    """Converts a value to types that the core accepts.

    Mappings become dicts, textures and cameras their tables, paths strings, and tensors arrays.

    Raises `WorldError` with the name of a tensor that is not on the CPU.
    """
    if isinstance(value, Texture):
        return value.description()
    if isinstance(value, Camera):
        return value.to_dict()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {key: plain(item, str(key)) for key, item in value.items()}
    if isinstance(value, list | tuple) and any(isinstance(item, Mapping | Texture) for item in value):
        return [plain(item, name) for item in value]
    refuse_mask(name, value, WorldError)
    return numbers(name, value, WorldError) if is_tensor(value) else value


def corner_values(name: str, value: npt.ArrayLike | None, columns: int) -> npt.NDArray[Any] | None:
    """Checks values per corner or face [n, columns] and returns them.

    Colours of uint8 (sRGB) are unchanged; all other values become float64.
    """
    if value is None:
        return None
    if isinstance(value, np.ndarray) and value.dtype == np.uint8 and name.endswith("colors"):
        if value.ndim != 2 or value.shape[1] != columns:
            raise WorldError(
                f"{name} must have the shape [n, {columns}], not {list(value.shape)}", code="wrong_shape"
            )
        return value
    array = floats(name, value, ("n", columns), error=WorldError)
    if (
        name.endswith("colors")
        and array.size
        and array.max() > 1
        and array.min() >= 0
        and (array % 1 == 0).all()
    ):
        raise WorldError(
            f"{name}: colours are linear numbers from 0 to 1, got values up to {array.max():g}; pass bytes in sRGB as"
            f" numpy.uint8({name})",
            code="out_of_range",
        )
    return array


def indices(name: str, value: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Returns vertex indices of triangles [m, 3], m >= 1; raises `WorldError` for other values."""
    refuse_mask(name, value, WorldError)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as fault:
        raise WorldError(f"{name} must be whole numbers [m, 3]: {fault}", code="wrong_type") from None
    if array.size and array.dtype.kind not in "iu":
        raise WorldError(
            f"{name} must be whole numbers [m, 3], not of dtype {array.dtype}", code="wrong_type"
        )
    if array.size == 0:
        raise WorldError(f"{name} is empty; a mesh requires at least one triangle", code="missing_value")
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "; cut polygons into triangles first" if array.ndim == 2 else ""
        raise WorldError(
            f"{name} must have the shape [m, 3], not {list(array.shape)}{hint}", code="wrong_shape"
        )
    return np.asarray(array, dtype=np.int64)
