"""Objects of a recipe that are dropped into or onto other objects, and come to rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..arguments import real
from ..errors import WorldError
from ..world import World
from ..world.settle import settle
from .draws import RandomStream, RejectedSample, check_known_keys

__all__ = ["Drop", "settle_drops"]

DROP_KEYS = ("into", "on", "seconds")
MAX_SECONDS = 60.0


class Drop:
    """The target of a dropped object, and its physical properties.

    `drop` contains one of the keys `into` and `on`, whose value is the name of an object, and optionally `seconds` (5).
    Raises `WorldError` with a message that begins with `what`.
    """

    def __init__(self, drop: Any, physics: Any, what: str) -> None:
        for key, table in (("drop", drop), ("physics", physics)):
            if not isinstance(table, Mapping):
                raise WorldError(f"{what}: {key} must be a table, not {table!r}", code="wrong_type")
        check_known_keys(f"drop of {what}", drop, DROP_KEYS)
        where = [key for key in ("into", "on") if key in drop]
        if len(where) != 1:
            raise WorldError(
                f'{what}: drop requires exactly one of the keys "into" and "on"', code="missing_value"
            )
        if not isinstance(drop[where[0]], str):
            raise WorldError(
                f'{what}: "{where[0]}" must be the name of an object, not {drop[where[0]]!r}',
                code="wrong_type",
            )
        seconds = real(
            f"{what}: seconds", drop.get("seconds", 5.0), 0.1, MAX_SECONDS, what="a time in seconds"
        )
        self.target = (where[0], str(drop[where[0]]), seconds)
        """Key, target name and time limit; objects for which all three are equal fall together."""
        self.physics = dict(physics)
        """The object's properties, as in `raycam.settle`."""


def settle_drops(
    world: World,
    dropped: list[tuple[str, Drop]],
    fixed: Mapping[str, Mapping[str, Any]],
    draw: RandomStream,
) -> None:
    """Lets objects fall until they are at rest.

    `dropped` are the names of the objects with their drops. All objects with the same target fall together; targets
    are processed in order of appearance. `fixed` are the properties of objects that do not move. Raises
    `RejectedSample` if objects do not settle, and the other errors of `raycam.settle`.
    """
    for target in dict.fromkeys(drop.target for _, drop in dropped):
        key, name, seconds = target
        falling = {one: drop.physics for one, drop in dropped if drop.target == target}
        others = [one for one, drop in dropped if drop.target != target]
        hidden = [one for one in others if _is_waiting(one, dropped, target)]
        for one in hidden:
            world.set_object(one, visible=False)
        seed = draw.substream("drop", key, name).bits()
        known: dict[str, Mapping[str, Any]] = {**fixed, **falling}
        try:
            if key == "into":
                settle(world, falling, into=name, seed=seed, seconds=seconds, physics=known)
            else:
                settle(world, falling, on=name, seed=seed, seconds=seconds, physics=known)
        except WorldError as fault:
            if fault.code == "not_settled":
                raise RejectedSample(str(fault), code=fault.code) from None
            raise
        finally:
            for one in hidden:
                world.set_object(one, visible=True)


def _is_waiting(name: str, dropped: list[tuple[str, Drop]], target: tuple[str, str, float]) -> bool:
    """True for an object that falls after the objects of `target`."""
    order = list(dict.fromkeys(drop.target for _, drop in dropped))
    own = next(drop.target for one, drop in dropped if one == name)
    return order.index(own) > order.index(target)
