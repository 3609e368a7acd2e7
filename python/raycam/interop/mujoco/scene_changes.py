"""Differences between an `mjvScene` and its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .model import DECORATION, PREFIXES

__all__ = ["SceneChanges", "SceneSnapshot"]


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
        self._geoms = [_values(geom) for geom in geoms]
        self._lights = [_light_values(light) for light in lights]

    def changes(self, geoms: Sequence[Any], lights: Sequence[Any]) -> SceneChanges:
        """Returns decorations, and geoms and lights that were added, changed or removed.

        `geoms` and `lights` are the scene's current geoms and lights.
        """
        current, shown, removed = list(geoms), [], set()
        for number, values in enumerate(self._geoms):
            element, category = values[:2], values[2]
            is_element = element[0] in PREFIXES and category != DECORATION
            is_same = number < len(current) and _values(current[number]) == values
            if is_element and not is_same:
                removed.add(element)
            if number < len(current) and not (is_element and is_same):
                shown.append(current[number])
        is_lit_as_before = [_light_values(light) for light in lights] == self._lights
        return SceneChanges(
            shown + current[len(self._geoms) :], removed, None if is_lit_as_before else list(lights)
        )


def _values(geom: Any) -> tuple[Any, ...]:
    """Returns the values of an `mjvGeom` that an image depends on, beginning with the type and id of its element."""
    arrays = (geom.pos, geom.mat, geom.size, geom.rgba)
    looks = (geom.emission, geom.specular, geom.shininess, geom.matid, geom.texid, geom.dataid)
    return (
        geom.objtype,
        geom.objid,
        geom.category,
        geom.type,
        *(array.tobytes() for array in arrays),
        *looks,
    )


def _light_values(light: Any) -> tuple[Any, ...]:
    """Returns the values of an `mjvLight` that an image depends on."""
    arrays = (light.pos, light.dir, light.attenuation, light.ambient, light.diffuse, light.specular)
    return (
        light.type,
        light.headlight,
        light.castshadow,
        light.cutoff,
        light.exponent,
        *(array.tobytes() for array in arrays),
    )
