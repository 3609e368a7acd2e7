"""Options of a render, from the core's table."""

from __future__ import annotations

import argparse
from typing import Any

from ...errors import SettingsError
from ...render import INTEGRATORS, RENDER_OPTIONS, RenderOption
from ...render.options import check_option
from ...render.studio import STUDIO_OPTIONS
from .command import parse_seconds

__all__ = ["HDRI_OPTIONS", "add_render_options", "given_render_options"]

PRESETS: dict[str, dict[str, Any]] = {
    "draft": {"samples": 4},
    "good": {"integrator": "path", "samples": 128},
    "best": {"integrator": "path", "noise_threshold": 0.004, "samples": 4096},
}
"""Render options by the names of `--preset`; options that are given take precedence."""
HDRI_OPTIONS = {"integrator": "path", "max_depth": 4, "samples": 32, "view": "pbr_neutral"}
"""Defaults of render options with `--hdri`."""
METAVARS = {
    "name": "NAME",
    "whole number": "N",
    "radiance": "RADIANCE",
    "seconds": "SECONDS",
    "stops": "STOPS",
    "switch or distance": "METRES",
}
TYPES: dict[str, Any] = {"whole number": int, "radiance": float, "seconds": parse_seconds, "stops": float}
CALL_ARGUMENTS = ("denoise", "transparent_background")
"""Arguments of `raycam.render` that are switches here."""


def add_render_options(command: argparse.ArgumentParser) -> None:
    """Adds `--preset`, all `RENDER_OPTIONS`, `--denoise` and `--transparent-background`."""
    group = command.add_argument_group(
        "rendering",
        "omitted options take their values from the world file's [render] section, or their defaults",
    )
    group.add_argument(
        "--preset",
        choices=tuple(PRESETS),
        help="draft: 4 samples per pixel; good: path tracing, 128 samples; best: path tracing until noise is invisible",
    )
    for option in RENDER_OPTIONS.values():
        _add_render_option(group, option)
    group.add_argument(
        "--denoise",
        action="store_true",
        default=None,
        help="denoise with Open Image Denoise (requires raycam[denoise])",
    )
    group.add_argument(
        "--transparent-background",
        action="store_true",
        default=None,
        help="hide the background: images and videos with an alpha channel, for compositing",
    )


def given_render_options(options: argparse.Namespace) -> dict[str, Any]:
    """Returns the options of `--preset` and all given options, as arguments of `raycam.render`.

    Raises `SettingsError` for invalid values.
    """
    preset = getattr(options, "preset", None)
    chosen = {} if preset is None else dict(PRESETS[preset])
    for name in (*RENDER_OPTIONS, *CALL_ARGUMENTS):
        value = getattr(options, name)
        if value is not None:
            _check(name, value)
            chosen[name] = value
    return chosen


def _check(name: str, value: Any) -> None:
    """Raises `SettingsError` with the option as typed for an invalid value."""
    if name in CALL_ARGUMENTS or (name == "integrator" and value == "reference"):
        return
    try:
        check_option(name, value)
    except SettingsError as error:
        expected = (
            f"one of {', '.join(INTEGRATORS)}" if name == "integrator" else RENDER_OPTIONS[name].expected
        )
        raise SettingsError(f"{_typed(name)} {value}: expected {expected}", code="invalid_value") from error


def _add_render_option(group: argparse._ArgumentGroup, option: RenderOption) -> None:
    name, text = _typed(option.name), _help(option)
    metavar = METAVARS[option.kind]
    if option.kind == "switch or distance":
        group.add_argument(name, metavar=metavar, type=float, nargs="?", const=True, help=text)
        group.add_argument(
            f"--no-{option.name.replace('_', '-')}",
            dest=option.name,
            action="store_const",
            const=False,
            help=f"no {option.name.replace('_', ' ')}, even if the world file specifies it",
        )
        return
    group.add_argument(name, metavar=metavar, type=TYPES.get(option.kind, str), help=text)


def _help(option: RenderOption) -> str:
    """Returns an option's help: the table's description with option names, and the defaults."""
    text = option.help.replace("true, false, or the distance", "the distance")
    if option.name == "integrator":
        text += ' "reference": the image of "flat", computed by a slow NumPy program.'
    for name in RENDER_OPTIONS:
        text = text.replace(f"`{name}`", _typed(name))
    defaults = [f"default: {option.default}"] if option.default not in (None, False) else []
    for where, values in {"in the studio": STUDIO_OPTIONS, "with --hdri": HDRI_OPTIONS}.items():
        if option.name in values:
            defaults.append(f"{where}: {values[option.name]}")
    text = f"{text[0].lower()}{text[1:].removesuffix('.')}".replace("%", "%%")
    return text + (f" ({'; '.join(defaults)})" if defaults else "")


def _typed(name: str) -> str:
    """The name of an option on the command line."""
    return f"--{name.replace('_', '-')}"
