"""Worlds given by the caller: a sequence, an iterator, or a function of the world's number."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from inspect import isgeneratorfunction
from typing import Any, Protocol, cast

from ..arguments import whole
from ..camera import Background
from ..errors import SettingsError, WorldError
from ..one_line import counted
from ..world import World

__all__ = ["MAX_WORLDS", "WorldSequence", "Worlds"]

MAX_WORLDS = 10_000_000
"""Maximum number of worlds in a data set."""
MAX_CACHED_WORLDS = 8
"""Number of an iterator's worlds that are kept, because several views of a world may be rendered at the same time."""


class IndexedWorlds(Protocol):
    """Worlds by index from 0, such as a list or a PyTorch data set."""

    def __len__(self) -> int:
        """The number of worlds."""
        ...

    def __getitem__(self, number: int, /) -> World:
        """Returns a world."""
        ...


Worlds = Iterable[World] | IndexedWorlds | Callable[[int], World]


class WorldSequence:
    """The worlds of `raycam.dataset.write(worlds=)`, by number.

    `worlds` is a sequence of worlds (any object with a length and indices from 0), an iterable of worlds, or a function
    that returns world i. `count` is the number of worlds; it is omitted if `worlds` has a length. `categories` are the
    names of all categories, or a mapping from ids to names; the default is all categories of the worlds of a list or
    tuple, or else the categories of the first world.

    Raises `SettingsError` if the count is missing or wrong.
    """

    backgrounds = None
    """None, because the caller's cameras have their own backgrounds."""
    seed = None
    """None, because the caller draws random numbers."""

    def __init__(
        self, worlds: Worlds, count: int | None, categories: Sequence[str] | Mapping[int, str] | None
    ) -> None:
        if isgeneratorfunction(worlds):
            raise SettingsError(
                f"worlds is the generator function {worlds.__name__}; call it: worlds={worlds.__name__}(), count=n",
                code="wrong_type",
            )
        self._function = worlds if callable(worlds) else None
        self._sequence = _as_sequence(worlds)
        self._iterator: Iterator[World] | None = None
        if self._function is None and self._sequence is None:
            if not isinstance(worlds, Iterable) or isinstance(worlds, str | Mapping):
                raise SettingsError(
                    f"worlds must be an iterable of worlds, or a function that returns the world with a given "
                    f"number, got {type(worlds).__name__}",
                    code="wrong_type",
                )
            self._iterator = iter(worlds)
        if isinstance(worlds, Sized):
            if count is not None and count != len(worlds):
                raise SettingsError(
                    f"count is {count}, but worlds contains {counted(len(worlds), 'world')}; omit count",
                    code="conflicting_values",
                )
            count = len(worlds)
            if count == 0:
                raise SettingsError("worlds is empty; pass at least one world", code="missing_value")
        if count is None:
            raise SettingsError(
                "count is missing; pass count=, the number of worlds that the function or iterator returns",
                code="missing_value",
            )
        self.count = whole("count", count, 1, MAX_WORLDS)
        """The number of worlds."""
        self._next = 0
        self._failure: Exception | None = None
        self._cached: OrderedDict[int, World] = OrderedDict()
        self._lock = threading.Lock()
        self.categories = self._find_categories(categories)
        """The categories of the data set, by id."""

    @property
    def is_iterator(self) -> bool:
        """True if the worlds can be requested only in order, and each world only once."""
        return self._iterator is not None

    def _find_categories(self, given: Sequence[str] | Mapping[int, str] | None) -> dict[int, str]:
        if isinstance(given, Mapping):
            return {whole("category id", key, 0): str(name) for key, name in given.items()}
        names = [str(name) for name in given] if given is not None else self._known_names()
        found = {int(name): name for name in names if name.isdigit()}
        number = 0
        for name in dict.fromkeys(names):
            if not name.isdigit():
                number += 1
                while number in found:
                    number += 1
                found[number] = name
        return dict(sorted(found.items()))

    def _known_names(self) -> list[str]:
        is_in_memory = isinstance(self._sequence, list | tuple)
        worlds = [self.world(number) for number in range(self.count if is_in_memory else 1)]
        return [name for world in worlds for _, name in sorted(world.categories.items())]

    def world(self, number: int) -> World:
        """Returns world `number`, from 0.

        Raises `WorldError` if the caller's value is not a world, if an iterator ends early, or if the world has a
        category that the data set does not contain.
        """
        if self._function is not None:
            return self._checked(self._function(number), number)
        if self._sequence is not None:
            return self._checked(self._sequence[number], number)
        with self._lock:
            return self._from_iterator(number)

    def _from_iterator(self, number: int) -> World:
        assert self._iterator is not None
        if self._failure is not None:
            raise self._failure
        while number >= self._next:
            try:
                world = next(self._iterator, None)
            except Exception as error:
                self._failure = error  # a failed generator only ends when it is called again
                raise
            if world is None:
                raise WorldError(
                    f"the iterator ended after {counted(self._next, 'world')}, but count is {self.count}",
                    code="conflicting_values",
                )
            self._cached[self._next] = self._checked(world, self._next)
            self._next += 1
            while len(self._cached) > MAX_CACHED_WORLDS:
                self._cached.popitem(last=False)
        if number not in self._cached:
            raise WorldError(
                f"world {number} is needed again, but an iterator returns each world only once; "
                "pass a function or a list of worlds",
                code="conflicting_values",
            )
        return self._cached[number]

    def _checked(self, world: World, number: int) -> World:
        if not isinstance(world, World):
            remedy = (
                "; call the generator function: worlds=f(), count=n" if isinstance(world, Iterator) else ""
            )
            raise WorldError(
                f"world {number} must be a World, got {type(world).__name__}{remedy}", code="wrong_type"
            )
        known = getattr(self, "categories", None)
        for name in world.categories.values():
            if known is not None and name not in known.values():
                raise WorldError(
                    f"world {number} has the category {name!r}, which the data set does not contain; list all "
                    "categories with categories=[...]",
                    code="unknown_name",
                )
        return world

    def check_camera_counts(self) -> None:
        """Does nothing, because missing cameras are detected later.

        A camera that is missing in a world raises an error when its view is rendered.
        """

    def background(self, number: int, camera: str) -> Background | None:
        """None: cameras have their own backgrounds."""
        return None

    def background_name(self, number: int, camera: str) -> str | None:
        """None: cameras have their own backgrounds."""
        return None


def _as_sequence(worlds: Any) -> IndexedWorlds | None:
    """The worlds, if they have a length and indices."""
    is_indexed = hasattr(worlds, "__len__") and hasattr(worlds, "__getitem__")
    if not is_indexed or callable(worlds) or isinstance(worlds, str | Mapping):
        return None
    return cast(IndexedWorlds, worlds)
