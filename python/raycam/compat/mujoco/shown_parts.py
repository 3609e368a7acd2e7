"""The parts of a model that an `mjvOption` shows."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from raycam import Notice

__all__ = ["ShownParts", "shown_parts", "warn_of_unused"]

TENDON_FLAG, TRANSPARENT_FLAG = 7, 18
"""Values of `mjtVisFlag` for tendons and for transparent bodies."""
UNUSED_FLAGS = (
    "CONVEXHULL",
    "TEXTURE",
    "ISLAND",
    "STATIC",
    "SKIN",
    "FLEXVERT",
    "FLEXEDGE",
    "FLEXFACE",
    "FLEXSKIN",
)
"""Flags of `mjtVisFlag` that are not supported; they change the appearance of the model's own geoms."""


@dataclass(frozen=True)
class ShownParts:
    """The parts of the model that are visible; if they change, a new scene is built."""

    geoms: tuple[int, ...] = (0, 1, 2)
    """The visible groups of geoms."""
    sites: tuple[int, ...] = (0, 1, 2)
    """The visible groups of sites."""
    tendons: tuple[int, ...] = (0, 1, 2)
    """The visible groups of tendons."""
    transparent: bool = False
    """True if everything that moves is transparent."""


def shown_parts(option: Any) -> ShownParts:
    """Returns the visible parts of the model according to an `mjvOption`."""
    geoms, sites, tendons = (
        tuple(number for number, shown in enumerate(groups) if shown)
        for groups in (option.geomgroup, option.sitegroup, option.tendongroup)
    )
    tendons = tendons if option.flags[TENDON_FLAG] else ()
    return ShownParts(geoms, sites, tendons, bool(option.flags[TRANSPARENT_FLAG]))


def warn_of_unused(option: Any) -> None:
    """Gives a notice that names the changed values of an `mjvOption` that have no effect."""
    import mujoco

    default = mujoco.MjvOption()
    flags = [mujoco.mjtVisFlag.__members__[f"mjVIS_{name}"] for name in UNUSED_FLAGS]
    names = [flag.name for flag in flags if option.flags[flag.value] != default.flags[flag.value]]
    values = ("label", "flexgroup", "skingroup")
    names += [name for name in values if np.any(getattr(option, name) != getattr(default, name))]
    if names:
        warnings.warn(
            Notice(f"scene_option: settings without effect in raycam: {', '.join(names)}", "ignored_element"),
            stacklevel=4,
        )
