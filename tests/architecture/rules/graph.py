"""Import graphs: cycles of files, and folders that import later folders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from pathlib import PurePosixPath

Arrows = Mapping[str, Set[str]]


def circles(arrows: Arrows) -> list[list[str]]:
    """Cycles: groups of files that import each other, largest first.

    The groups are Tarjan's strongly connected components.
    """
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    on_stack: set[str] = set()
    found: list[list[str]] = []
    for start in sorted(arrows):
        if start in index:
            continue
        work = [(start, iter(sorted(arrows[start])))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, targets = work[-1]
            for target in targets:
                if target not in index:
                    index[target] = low[target] = len(index)
                    stack.append(target)
                    on_stack.add(target)
                    work.append((target, iter(sorted(arrows.get(target, ())))))
                    break
                if target in on_stack:
                    low[node] = min(low[node], index[target])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = stack[stack.index(node) :]
                    del stack[len(stack) - len(group) :]
                    on_stack -= set(group)
                    if len(group) > 1:
                        found.append(sorted(group))
    return sorted(found, key=lambda group: (-len(group), group))


def place_of(name: str, order: Sequence[str]) -> int | None:
    """Index of the longest entry of `order` that equals the file or a parent folder.

    `name` is the file without its extension. An entry `scene` means a folder with its `mod.rs`; an entry
    `scene/mod` means that file alone.
    """
    path = PurePosixPath(name).with_suffix("")
    for candidate in (path, *path.parents):
        if candidate.as_posix() in order:
            return order.index(candidate.as_posix())
    return None


def upward_arrows(arrows: Arrows, order: Sequence[str]) -> list[str]:
    """Violations of `order`: files without an entry, and files that import from a later entry."""
    offences = [
        f"{name} has no place in the order of folders"
        for name in sorted(arrows)
        if place_of(name, order) is None
    ]
    for name in sorted(arrows):
        here = place_of(name, order)
        for target in sorted(arrows[name]):
            there = place_of(target, order)
            if here is not None and there is not None and there > here:
                offences.append(f"{name} imports {target}: {order[here]} stands below {order[there]}")
    return offences
