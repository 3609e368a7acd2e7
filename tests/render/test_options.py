"""The table of render options defines Python's keywords, documentation and validation."""

from __future__ import annotations

import inspect
import re
import typing

import numpy as np
import pytest
import raycam
from raycam.render import FILTERS, INTEGRATORS, RENDER_OPTIONS, VIEWS, RenderOptions
from raycam.render import options as module
from raycam.render.options import check_option, complete_options, given_options
from support.raises import raises

INVALID = {
    "integrator": ["falt", 3],
    "samples": [0, -1, 1.5, 16777217, "many", True],
    "noise_threshold": [0, -0.1, float("nan"), float("inf"), 1e39, 1e-60, "low"],
    "time_limit": [0, -1, float("inf"), "5m"],
    "max_depth": [0, 4294967296, 2.5],
    "clamp": [0, -3.0, 1e39],
    "filter": ["bx", None.__class__],
    "seed": [-1, 1 << 64, 0.5],
    "threads": [0, 1025, -1],
    "ambient_occlusion": [0, -2.0, "on", float("nan")],
    "exposure": [100.5, -101, float("nan"), "bright"],
    "view": ["agz", 7],
}


@pytest.fixture(scope="module")
def world() -> raycam.World:
    made = raycam.World()
    made.add_object(box={"size": 1})
    made.add_light("sky", radiance=1)
    return made


def test_python_keywords_equal_the_table_of_options() -> None:
    hints = typing.get_type_hints(RenderOptions)
    assert list(hints) == list(RENDER_OPTIONS)
    for name, choices in (("integrator", INTEGRATORS), ("filter", FILTERS), ("view", VIEWS)):
        literal = typing.get_args(hints[name])[0]
        assert sorted(typing.get_args(literal)) == sorted(choices)
    assert [*RENDER_OPTIONS["integrator"].choices, "reference"] == INTEGRATORS


def test_signature_and_docstring_of_render_name_every_argument() -> None:
    parameters = inspect.signature(raycam.render).parameters
    assert set(RENDER_OPTIONS) <= set(parameters)
    described = set(re.findall(r"`(\w+)", raycam.render.__doc__ or ""))
    assert not set(parameters) - described


@pytest.mark.parametrize("name", INVALID)
def test_invalid_values_are_refused_with_the_name_of_the_option(name: str, world: raycam.World) -> None:
    for value in INVALID[name]:
        for call in (
            lambda given: raycam.render(world, **given),
            lambda given: raycam.render_many(world, world.default_camera(), **given),
            lambda given: check_option(name, given[name]),
        ):
            with pytest.raises(raycam.SettingsError) as caught:
                call({name: value})
            assert name in str(caught.value), value


@pytest.mark.parametrize("name", INVALID)
def test_world_files_and_calls_refuse_the_same_values_with_the_same_message(name: str) -> None:
    for value in INVALID[name]:
        if isinstance(value, type):
            continue
        with pytest.raises(raycam.SettingsError) as by_call:
            check_option(name, value)
        with pytest.raises(raycam.WorldError) as by_file:
            raycam.World.from_dict({"render": {name: value}})
        assert str(by_call.value) in str(by_file.value)


def test_limits_are_accepted_and_numpy_scalars_count_as_numbers() -> None:
    for name, row in RENDER_OPTIONS.items():
        for value in (row.minimum, row.maximum):
            if value is not None:
                assert check_option(name, value) == value
    assert check_option("seed", (1 << 64) - 1) == (1 << 64) - 1
    assert check_option("samples", np.int64(3)) == 3
    assert check_option("clamp", np.float32(0.5)) == 0.5
    assert check_option("exposure", np.array(1.5)) == 1.5
    assert check_option("ambient_occlusion", True) is True


def test_calls_take_precedence_over_world_files_and_defaults(world: raycam.World) -> None:
    described = raycam.World.from_dict({"render": {"samples": 3, "seed": 7, "view": "agx"}})
    found = complete_options(described, {"samples": 5})
    assert (found["samples"], found["seed"], found["view"]) == (5, 7, "agx")
    defaults = complete_options(world, {})
    assert defaults == {name: row.default for name, row in RENDER_OPTIONS.items()}
    assert complete_options(world, {"noise_threshold": 0.5})["samples"] == module.ADAPTIVE_SAMPLES == 16384


def test_none_counts_as_not_given() -> None:
    assert given_options({"samples": None, "seed": 3}) == {"seed": 3}


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("sample", "samples"),
        ("spp", "samples"),
        ("bounces", "max_depth"),
        ("workers", "threads"),
    ],
)
def test_unknown_options_are_refused_with_the_nearest_name(
    given: str, meant: str, world: raycam.World
) -> None:
    for call in (raycam.render, raycam.render_many, raycam.Progressive):
        with raises(raycam.SettingsError, code="unknown_key", mentions=[given, repr(meant)]):
            call(world, **{given: 1})  # type: ignore[operator]


@pytest.mark.parametrize("name", ["size", "resolution", "lights", "output", "background_color"])
def test_options_of_other_programs_are_refused_with_raycams_option(name: str, world: raycam.World) -> None:
    hint = dict(raycam._core.foreign_terms("render"))[name]  # type: ignore[attr-defined]
    with raises(raycam.SettingsError, code="unknown_key", mentions=[hint]):
        raycam.render(world, **{name: 1})  # type: ignore[arg-type]


def test_every_option_is_described_in_sentences_with_its_range() -> None:
    for name, row in RENDER_OPTIONS.items():
        assert row.help.endswith("."), name
        assert row.expected, name
