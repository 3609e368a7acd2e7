"""Edits of objects and lights: a world that is changed by numbers, undone and redone.

Each edit makes a world that shares what is built with the one before, so that undoing is going back to it.
"""

from __future__ import annotations

import math
import weakref
from typing import Any, Protocol

import numpy as np

from ...arrays import Floats
from ...errors import SettingsError, WorldError
from ...world import World
from ...world.keys import STRENGTHS

__all__ = ["Edits", "edited"]

MOST_STEPS = 100
"""Steps that can be undone."""


class Listener(Protocol):
    """Somebody who shows the world."""

    def rebase(self) -> None:
        """Shows the world as it is now."""


class Edits:
    """The world that all sessions share, and the ones before and after it."""

    def __init__(self, world: World, *, allowed: bool = True) -> None:
        self.world = world
        self.allowed = allowed
        self._before: list[World] = []
        self._after: list[World] = []
        self._listeners: weakref.WeakSet[Any] = weakref.WeakSet()

    def listen(self, listener: Listener) -> None:
        """Tells `listener` of each change, for as long as it lives."""
        self._listeners.add(listener)

    def edit(self, kind: str, number: int, key: str, value: Any) -> None:
        """Changes an object or a light. Raises `WorldError`; the world is then as before."""
        if not self.allowed:
            raise SettingsError("this view is for looking: it was started with edit=False")
        changed = edited(self.world, kind, number, key, value)
        self._before = [*self._before[-MOST_STEPS + 1 :], self.world]
        self._after = []
        self._show(changed)

    def replace(self, world: World) -> None:
        """Shows another world, as an edit that can be undone."""
        self._before = [*self._before[-MOST_STEPS + 1 :], self.world]
        self._after = []
        self._show(world)

    def undo(self) -> None:
        """Goes back by one edit; raises `WorldError` at the first world."""
        if not self._before:
            raise WorldError("there is nothing to undo")
        self._after.append(self.world)
        self._show(self._before.pop())

    def redo(self) -> None:
        """Takes back an `undo`; raises `WorldError` at the last world."""
        if not self._after:
            raise WorldError("there is nothing to redo")
        self._before.append(self.world)
        self._show(self._after.pop())

    def _show(self, world: World) -> None:
        self.world = world
        for listener in list(self._listeners):
            listener.rebase()

    def about(self) -> dict[str, Any]:
        """Contents that can be edited, as the message `contents` has it."""
        return {
            "type": "contents",
            "editable": self.allowed,
            "undo": len(self._before),
            "redo": len(self._after),
            "objects": [{"name": each.name, "visible": each.visible} for each in self.world.objects[:1000]],
            "lights": [_light_name(number, each) for number, each in enumerate(self.world.lights[:1000])],
        }


def _light_name(number: int, light: dict[str, Any]) -> str:
    return f"{light.get('type', 'light')} {number}"


def edited(world: World, kind: str, number: int, key: str, value: Any) -> World:
    """A copy of a world with an object or a light changed.

    Of objects: `visible` (bool), `color` (text), `move` (metres [3]), `turn` (degrees about up) and `scale` (a factor),
    around the middle of its mesh. Of lights: `strength` (a factor). Raises `WorldError` and `SettingsError`.
    """
    changed = world.copy()
    if kind == "light":
        lights = world.lights
        if number >= len(lights) or key != "strength":
            raise WorldError("there is no light of this number, or no such key of it")
        changed.set_light(number, **_stronger(lights[number], _factor(value)))
        return changed
    objects = world.objects
    if number >= len(objects):
        raise WorldError("there is no object of this number")
    if key == "visible" and isinstance(value, bool):
        changed.set_object(number, visible=value)
    elif key == "color" and isinstance(value, str):
        changed.set_object(number, color=value)
    elif key in ("move", "turn", "scale"):
        changed.set_object(number, matrix=_placed(world, number, key, value))
    else:
        raise SettingsError(f"objects have no {key} of this type")
    return changed


def _stronger(light: dict[str, Any], factor: float) -> dict[str, Any]:
    """The keys of a light that is brighter by a factor."""
    keys = (*STRENGTHS.get(str(light.get("type")), ((), ""))[0], "scale")
    own = next(([name] for name in keys if name in light), [])
    own = own or [name for name in ("zenith", "horizon", "ground") if name in light]
    if not own:
        own, light = ["scale"], {"scale": 1.0}
    return {name: (np.asarray(light[name], float) * factor).tolist() for name in own}


def _factor(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1e-6 <= value <= 1e6:
        raise SettingsError(f"expected a factor from 1e-6 to 1e6, not {value!r}")
    return float(value)


def _placed(world: World, number: int, key: str, value: Any) -> Floats:
    """The matrix of an object that is moved, turned or scaled."""
    matrix = world.objects[number].matrix
    step = np.eye(4)
    if key == "move":
        if not isinstance(value, list) or len(value) != 3:
            raise SettingsError("move is three numbers, in metres")
        step[:3, 3] = value
        return np.asarray(step @ matrix)
    if key == "scale":
        step[:3, :3] *= _factor(value)
    else:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SettingsError("turn is a number of degrees")
        c, s = math.cos(math.radians(value)), math.sin(math.radians(value))
        first, second = (0, 1) if world.up == "z" else (2, 0)
        step[first, first] = step[second, second] = c
        step[first, second], step[second, first] = -s, s
    middle = matrix[:3, 3]
    step[:3, 3] = middle - step[:3, :3] @ middle
    return np.asarray(step @ matrix)
