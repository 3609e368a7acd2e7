"""Differences between an `mjvScene` and its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .model import DECORATION, PREFIXES

__all__ = ["SceneChanges", "SceneSnapshot"]

GEOM_VALUES = (
    *("objtype", "objid", "category", "type"),
    *("emission", "specular", "shininess", "matid", "texid", "dataid"),
)
"""The values of an `mjvGeom` on which an image depends, beginning with the type and id of its element.

Some versions of MuJoCo have no `texid`.
"""
GEOM_ARRAYS = ("pos", "mat", "size", "rgba")
LIGHT_VALUES = ("type", "headlight", "castshadow", "cutoff", "exponent")
"""The values of an `mjvLight` on which an image depends."""
LIGHT_ARRAYS = ("pos", "dir", "attenuation", "ambient", "diffuse", "specular")


@dataclass(frozen=True)
class SceneChanges:
    """The differences between the image of an `mjvScene` and the image of its model."""

    geoms: list[Any]
    """The `mjvGeom`s to show in addition to the model's elements."""
    removed: set[tuple[int, int]]
    """The types (`mjtObj`) and ids of the model's elements that are removed, or replaced by one of `geoms`."""
    lights: list[Any] | None
    """The scene's `mjvLight`s if the program has added, changed or removed lights; otherwise None."""


class SceneSnapshot:
    """Geoms and lights of an `mjvScene` after `mjv_updateScene`, for comparison with what a program changes later.

    The model's geoms, sites, flexes, skins and tendons are its elements; all other geoms are decorations.
    """

    def __init__(self, geoms: Sequence[Any], lights: Sequence[Any]) -> None:
        self._geoms = [_values(geom, GEOM_VALUES, GEOM_ARRAYS) for geom in geoms]
        self._lights = [_values(light, LIGHT_VALUES, LIGHT_ARRAYS) for light in lights]

    def changes(self, geoms: Sequence[Any], lights: Sequence[Any]) -> SceneChanges:
        """Returns decorations, and geoms and lights that were added, changed or removed.

        `geoms` and `lights` are the scene's current geoms and lights.
        """
        current, shown, removed = list(geoms), [], set()
        for number, values in enumerate(self._geoms):
            element, category = values[:2], values[2]
            is_element = element[0] in PREFIXES and category != DECORATION
            is_same = number < len(current) and _values(current[number], GEOM_VALUES, GEOM_ARRAYS) == values
            if is_element and not is_same:
                removed.add(element)
            if number < len(current) and not (is_element and is_same):
                shown.append(current[number])
        is_lit_as_before = [_values(light, LIGHT_VALUES, LIGHT_ARRAYS) for light in lights] == self._lights
        return SceneChanges(
            shown + current[len(self._geoms) :], removed, None if is_lit_as_before else list(lights)
        )


def _values(item: Any, names: Sequence[str], arrays: Sequence[str]) -> tuple[Any, ...]:
    """Returns the values and the bytes of arrays of an `mjvGeom` or `mjvLight`."""
    return (
        *(getattr(item, name, None) for name in names),
        *(getattr(item, name).tobytes() for name in arrays),
    )
