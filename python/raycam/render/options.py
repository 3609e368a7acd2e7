"""Render options: names, types, defaults, ranges and descriptions, from the core's table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from .. import _core
from ..errors import SettingsError, nearest

if TYPE_CHECKING:
    from ..world import World

__all__ = [
    "FILTERS",
    "INTEGRATORS",
    "RENDER_OPTIONS",
    "VIEWS",
    "RenderOption",
    "RenderOptions",
    "check_option",
    "complete_options",
    "given_options",
]

Integrator = Literal["flat", "direct", "path", "ao", "reference"]
Filter = Literal["box", "blackman-harris"]
View = Literal["standard", "agx", "pbr_neutral"]


class RenderOptions(TypedDict, total=False):
    """The keyword arguments of `render` that a world file may also set in `[render]`.

    None counts as not given. The docstring of `render` describes each keyword.
    """

    integrator: Integrator | None
    samples: int | None
    noise_threshold: float | None
    time_limit: float | None
    max_depth: int | None
    clamp: float | None
    filter: Filter | None
    seed: int | None
    threads: int | None
    ambient_occlusion: bool | float | None
    exposure: float | None
    view: View | None


@dataclass(frozen=True)
class RenderOption:
    """A row of the table of render options."""

    name: str
    kind: str
    """The type of value: "name", "whole number", "radiance", "seconds", "stops" or "switch or distance"."""
    help: str
    """The description, in sentences."""
    expected: str
    """The valid values, for error messages."""
    default: Any
    """The default; None if the option is off by default."""
    choices: tuple[str, ...] = ()
    """The valid names of an option of the kind "name"."""
    minimum: int | None = None
    maximum: int | None = None


def _table() -> dict[str, RenderOption]:
    rows = [row | {"choices": tuple(row.get("choices", ()))} for row in _core.render_options()]
    return {row["name"]: RenderOption(**row) for row in rows}


RENDER_OPTIONS = _table()
"""The rows of the table by the option's name."""
INTEGRATORS = [*RENDER_OPTIONS["integrator"].choices, "reference"]
FILTERS = list(RENDER_OPTIONS["filter"].choices)
VIEWS = list(RENDER_OPTIONS["view"].choices)
MAX_SAMPLES = RENDER_OPTIONS["samples"].maximum or 0
"""Largest number of samples per pixel."""
ADAPTIVE_SAMPLES = _core.complete_render_options(None, {"time_limit": 1.0})["samples"]
"""Default maximum of samples per pixel with `noise_threshold` or `time_limit`."""


def given_options(options: Mapping[str, Any], arguments: Iterable[str] = ()) -> dict[str, Any]:
    """Returns the validated values of the given options, without options that are None.

    Raises `SettingsError` for an invalid value, and for an unknown name with the equivalent or nearest name;
    `arguments` are other names that the caller accepts.
    """
    for name in options:
        if name not in RENDER_OPTIONS:
            raise SettingsError(_unknown_option(name, [*arguments, *RENDER_OPTIONS]), code="unknown_key")
    given = {name: value for name, value in options.items() if value is not None}
    is_reference = isinstance(given.get("integrator"), str) and given["integrator"] == "reference"
    own = {"integrator": given.pop("integrator")} if is_reference else {}
    values = _core.complete_render_options(None, given)
    return own | {name: values[name] for name in given}


def _unknown_option(name: str, names: list[str]) -> str:
    hint = dict(_core.foreign_terms("render")).get(name)
    return (
        nearest("render option", name, names) if hint is None else f"unknown render option {name!r}; {hint}"
    )


def complete_options(world: World | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the values of all options.

    A value comes from `options`, or else from the world file, or else it is the default. The world file's values are in
    its section `[render]`. An option that is off has the value None.

    Raises `SettingsError` for invalid values.
    """
    values = _core.complete_render_options(None if world is None else world._core, dict(options))
    return {name: values.get(name) for name in RENDER_OPTIONS}


def check_option(name: str, value: Any) -> Any:
    """Returns the value of an option in the type that the core expects.

    Raises `SettingsError` for an invalid value.
    """
    return complete_options(None, {name: value})[name]
