"""Writes one data set for each world of a recipe, for formats that store only one world.

The folder of each data set is named after the world's number, with six digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from .plan import Format, Index, Made, Plan, Record, View

__all__ = ["each_index", "each_make", "folder", "in_world", "part", "world_count"]


def folder(world: int) -> str:
    """Returns the folder of a world."""
    return f"{world:06d}"


def world_count(plan: Plan) -> int:
    """Returns the number of worlds."""
    return 1 if plan.recipe is None else len(plan.shots) // views_of(plan)


def in_world(plan: Plan, number: int) -> tuple[int, int]:
    """Returns the world of a view, and the view's index among the views of that world."""
    return (0, number) if plan.recipe is None else divmod(number, views_of(plan))


def views_of(plan: Plan) -> int:
    """The number of views of each world."""
    return sum(view.world == 0 for view in plan.shots)


def part(plan: Plan, world: int) -> Plan:
    """The plan for one world of the recipe."""
    count = views_of(plan)
    shots = plan.shots[world * count : (world + 1) * count]
    made = plan.world_of(shots[0])
    cameras = [view.camera if view.name is None else made.camera(view.name) for view in shots]
    alone = Plan(
        made,
        [View(camera, None) for camera in cameras],
        plan.rendering,
        plan.options,
        plan.threads,
        known=plan,
    )
    alone.watch = plan.watch
    return alone


def each_make(kind: Format, plan: Plan, number: int) -> Made:
    """Creates the files of a view with `kind.make`, in the folder of its world."""
    world, place = in_world(plan, number)
    files, record = kind.make(part(plan, world), place)
    return {f"{folder(world)}/{name}": data for name, data in files.items()}, record


def each_index(kind: Format, plan: Plan, records: Callable[..., Iterator[Record]]) -> Index:
    """Creates the index files of every world from that world's records."""
    count = views_of(plan)
    for world in range(world_count(plan)):

        def own(first: int = world * count) -> Iterator[Record]:
            return records(first, first + count)

        for name, pieces in kind.index(part(plan, world), own):
            yield f"{folder(world)}/{name}", pieces
