"""Simulation of objects that fall and come to rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import as_number, real, whole
from ..errors import Notice, SettingsError, WorldError, nearest
from ..notices import warn_all
from .world import World

__all__ = ["PHYSICS", "Settled", "find_overlaps", "settle"]

PHYSICS = {"density": 1000.0, "friction": 0.5, "restitution": 0.1, "parts": 32}
"""Physical properties of an object and their defaults."""
OVERLAP_M = 2e-4
"""Depth in metres from which an overlap is reported."""
STEP_S = 1 / 240


@dataclass(frozen=True)
class Settled:
    """The result of `settle`: how the objects came to rest."""

    objects: tuple[str, ...]
    """The names of the objects that fell."""
    attempts: int
    """The number of random draws, 1 to 20: first of all objects, then again of objects that failed a check."""
    seconds: float
    """Simulated time since the poses of all objects were drawn."""
    penetration: float
    """The greatest penetration depth of two meshes, in metres."""
    motion: float
    """The largest motion of any point of the objects during one more second, in metres."""


def settle(
    world: World,
    objects: str | int | Iterable[str | int],
    *,
    into: str | int | Iterable[str | int] | None = None,
    on: str | int | Iterable[str | int] | None = None,
    seed: int = 0,
    seconds: float = 5.0,
    gravity: float = 9.81,
    physics: Mapping[str, Mapping[str, Any]] | None = None,
) -> Settled:
    """Lets `objects` of a world fall until they are at rest, and moves them there.

    Returns how the objects came to rest.

    With `into` (a bin) or `on` (a table), the `objects` are thrown from above the bin or the table, one every 0.1 s,
    with random poses that depend on `seed` and their names. Without both, they fall from where they are. Objects are
    given by name or number; the name of a robot, or "shelf" for "shelf/left" and "shelf/right", means all of its
    parts. The other visible objects do not move. Gravity points against the world's up axis.

    `seconds` limits the simulated time after the last throw, `gravity` is in m/s². `physics` has a table for each
    object by name, with the keys `density` (1,000 kg/m³), `friction` (0.5), `restitution` (0.1) and `parts` (32).
    Friction and restitution are averaged over two surfaces. `parts` is the greatest number of convex parts that
    represent the mesh; 1 means its convex hull.

    Convex parts of the meshes (V-HACD) move in rapier's solver in steps of 1/240 s. From 1 s after the last throw, a
    growing drag slows all motion; it is off during the final check of motion. Then the real meshes are checked.
    No mesh penetrates another by more than 0.2 mm (0.2 % of the size for objects below 0.1 m). Each object touches
    something if it is lowered by 0.5 mm (2 % of the size for objects of several parts). No object moves by more than
    0.1 mm in another second. Each object is within its target: completely for `into`, with its centre for `on`.
    Penetrating objects are lifted and fall again. Objects that fail another check, for example because they fell next
    to the bin, are thrown again while the others stay. After 10 attempts, all objects are thrown again, and after 20
    attempts, settling fails. The poses become matrices of the objects. The same arguments return the same bytes on any
    number of threads. A notice reports robots that overlap other objects.

    Raises `WorldError` with the code "not_settled" and the check that failed if no attempt succeeds (the world is then
    unchanged), "no_volume" for a flat object, "unknown_name", and "conflicting_values" for links of robots.
    """
    moving = _numbers(world, "objects", objects)
    names = [item.name for item in world.objects]
    robots = [name for name in world.robots if any(names[i].startswith(f"{name}/") for i in moving)]
    if robots:
        raise WorldError(
            f"robot {robots[0]!r}: links of robots cannot fall; set_joints moves them",
            code="conflicting_values",
        )
    if into is not None and on is not None:
        raise SettingsError("into and on cannot be combined; use only one of them", code="conflicting_values")
    target = None
    if into is not None or on is not None:
        which = "on" if into is None else "into"
        found = _numbers(world, which, on if into is None else into)
        if set(found) & set(moving):
            raise WorldError(f"{which}: an object cannot fall {which} itself", code="conflicting_values")
        target = found, into is not None
    settled, fault = _core.world_settle(
        world._core,
        moving,
        _properties(world, moving, physics or {}),
        target,
        whole("seed", seed, 0, (1 << 64) - 1),
        real("seconds", seconds, what="a time in seconds"),
        real("gravity", gravity, what="an acceleration in m/s²"),
    )
    if fault is not None:
        raise WorldError(fault[1], code=fault[0])
    assert settled is not None  # for mypy: one of the two is always present
    (attempts, steps, penetration, motion), transforms = settled
    for number, matrix in zip(moving, transforms, strict=True):
        world.set_object(number, matrix=np.array(matrix))
    warn_all(
        Notice(
            f"these objects overlap by {1e3 * depth:.1f} mm",
            "overlapping_objects",
            [f"{a!r} and {b!r}"],
        )
        for a, b, depth in find_overlaps(world)
    )
    return Settled(tuple(names[i] for i in moving), attempts, steps * STEP_S, penetration, motion)


def find_overlaps(world: World) -> list[tuple[str, str, float]]:
    """Returns the names of objects that overlap the links of a robot, with the depth in metres.

    Overlaps between links of the same robot are ignored. Overlaps of 0.2 mm and less are ignored.
    """
    names = [item.name for item in world.objects]
    owners = [next((name for name in world.robots if one.startswith(f"{name}/")), None) for one in names]
    if not any(owners):
        return []
    # Objects of the same group are not compared: links of one robot, and all objects outside of robots.
    groups = sorted({owner or "" for owner in owners})
    if len(groups) == 1:
        return []
    found = _core.world_overlaps(world._core, [groups.index(owner or "") for owner in owners], OVERLAP_M)
    return [(names[a], names[b], depth) for a, b, depth in found]


def _numbers(world: World, argument: str, which: Any) -> list[int]:
    """The numbers of objects that are given by name, number or the first part of their names."""
    alone = isinstance(which, str) or as_number(which) is not None
    items: Sequence[Any] = [which] if alone else list(which)
    names = [item.name for item in world.objects]
    found: list[int] = []
    for item in items:
        if isinstance(item, str):
            same = [i for i, name in enumerate(names) if name == item]
            found += same or [i for i, name in enumerate(names) if name.startswith(f"{item}/")]
            if not same and not any(name.startswith(f"{item}/") for name in names):
                raise WorldError(f"{argument}: {nearest('object', item, names)}", code="unknown_name")
        else:
            found.append(whole(argument, item, 0, len(names) - 1, error=WorldError))
    if not found:
        raise WorldError(f"{argument}: no objects are given", code="missing_value")
    if len(set(found)) != len(found):
        twice = next(names[number] for number in found if found.count(number) > 1)
        raise WorldError(f"{argument}: object {twice!r} is given twice", code="duplicate_name")
    return found


def _properties(
    world: World, moving: list[int], physics: Mapping[str, Mapping[str, Any]]
) -> list[tuple[int, tuple[float, float, float, int]]]:
    """The properties of objects by number."""
    found = []
    for name, table in physics.items():
        for number in _numbers(world, "physics", name):
            for key in table:
                if key not in PHYSICS:
                    raise WorldError(
                        f"physics of {name!r}: {nearest('property', key, list(PHYSICS))}", code="unknown_key"
                    )
                if number not in moving and key in ("density", "parts"):
                    raise WorldError(
                        f"physics of {name!r}: {key} has no effect, because the object does not fall",
                        code="conflicting_values",
                    )
            values = {**PHYSICS, **table}
            density, friction, restitution = (
                real(f"physics of {name!r}: {key}", values[key], what="a number", error=WorldError)
                for key in ("density", "friction", "restitution")
            )
            parts = whole(f"physics of {name!r}: parts", values["parts"], 1, 128, error=WorldError)
            found.append((number, (density, friction, restitution, parts)))
    return found
