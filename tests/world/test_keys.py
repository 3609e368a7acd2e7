"""The typed keys of objects and lights equal the JSON Schema of world files."""

from __future__ import annotations

import json
from typing import Any, get_args, get_type_hints

import pytest
from raycam import _core
from raycam.world.keys import SHAPES, FogKeys, LightKeys, ObjectKeys

SCHEMA: dict[str, Any] = json.loads(_core.json_schema())["$defs"]
AIM_KEYS = {"target", "size"}
"""Keys of lights from which `World.add_light` computes others."""


def choices(name: str) -> set[str]:
    """The names of a closed set in the schema."""
    members = SCHEMA[name].get("oneOf", [SCHEMA[name]])
    return {name for member in members for name in member.get("enum", [member.get("const")])}


def test_object_keys_equal_the_schema_and_the_shapes() -> None:
    shape_keys = {key for keys in SHAPES.values() for key in keys}
    described = set(SCHEMA["ObjectSpec"]["properties"])
    assert set(get_type_hints(ObjectKeys)) == described | shape_keys
    assert set(SHAPES) <= described


def test_light_keys_equal_the_schema() -> None:
    described = {key for light in SCHEMA["Light"]["oneOf"] for key in light["properties"]}
    assert set(get_type_hints(LightKeys)) == described | AIM_KEYS


def test_fog_keys_equal_the_schema() -> None:
    assert set(get_type_hints(FogKeys)) == set(SCHEMA["FogSpec"]["properties"])


@pytest.mark.parametrize(("key", "schema"), [("type", "MaterialType"), ("alpha", "AlphaMode")])
def test_object_choices_equal_the_schema(key: str, schema: str) -> None:
    assert set(get_args(get_type_hints(ObjectKeys)[key])) == choices(schema)
