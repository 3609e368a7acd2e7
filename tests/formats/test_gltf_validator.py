"""Files that glTF-Validator reports, and how raycam handles them.

The cases equal the table in `docs/gltf.md`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.gltf_document import SQUARE, Document, animated, load
from support.raises import raises


def _float(d: Document) -> None:
    bad = SQUARE.copy()
    bad[1, 1] = np.nan
    start = d.json["bufferViews"][0]["byteOffset"]
    d.binary[start : start + bad.nbytes] = bad.tobytes()


REFUSED: dict[str, Any] = {
    "ACCESSOR_TOO_LONG": lambda d: d.json["accessors"][0].update(count=5000),
    "ACCESSOR_INDEX_OOB": lambda d: d.binary.__setitem__(
        slice(d.json["bufferViews"][2]["byteOffset"], None), b"\x09\0" * 6
    ),
    "ACCESSOR_INDEX_PRIMITIVE_RESTART": lambda d: d.binary.__setitem__(
        slice(d.json["bufferViews"][2]["byteOffset"], None), b"\xff\xff" * 6
    ),
    "UNRESOLVED_REFERENCE": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].update(POSITION=77),
    "BUFFER_VIEW_TOO_LONG": lambda d: d.json["bufferViews"][0].update(byteLength=1 << 20),
    "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT": lambda d: d.json["accessors"][1].update(count=3),
    "NODE_LOOP": lambda d: d.json["nodes"][0].update(children=[0]),
    "UNKNOWN_ASSET_MAJOR_VERSION": lambda d: d.json["asset"].update(version="1.0"),
    "ASSET_MIN_VERSION_GREATER_THAN_VERSION": lambda d: d.json["asset"].update(minVersion="2.1"),
    "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT": lambda d: d.json["accessors"][0].update(type="VEC2"),
    "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT": lambda d: d.json["accessors"][2].update(
        normalized=True
    ),
    "TYPE_MISMATCH": lambda d: d.json["nodes"][0].update(mesh="zero"),
    "EMPTY_ENTITY": lambda d: d.json["meshes"][0].update(primitives=[]),
}


@pytest.mark.parametrize("code", REFUSED)
def test_faults_that_affect_the_image_are_refused_with_their_code(tmp_path: Path, code: str) -> None:
    document = Document()
    document.node(mesh=document.square())
    REFUSED[code](document)
    with raises(raycam.FormatError, mentions=[code]):
        load(document, tmp_path)


SPOT = {"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.25}}
NOTICED: dict[str, Any] = {
    "ACCESSOR_INVALID_FLOAT": _float,
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS": lambda d: d.json["accessors"][0].pop("max"),
    "VALUE_NOT_IN_RANGE": lambda d: d.json["materials"][0].update(emissiveFactor=[2, 0, 0]),
    "SCENE_NON_ROOT_NODE": lambda d: d.json.update(scenes=[{"nodes": [0, d.node(children=[0])]}]),
    "MESH_PRIMITIVE_NO_POSITION": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].pop(
        "POSITION"
    ),
    "MESH_PRIMITIVE_INCOMPATIBLE_MODE": lambda d: d.json["accessors"][2].update(count=5),
    "UNSUPPORTED_EXTENSION": lambda d: d.use("EXT_of_tomorrow"),
    "MESH_PRIMITIVE_INVALID_ATTRIBUTE": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].update(
        COLOR=0, _OWN=0
    ),
    "NODE_MATRIX_TRS": lambda d: d.json["nodes"][0].update(
        matrix=np.eye(4).ravel().tolist(), translation=[1, 0, 0]
    ),
    "ROTATION_NON_UNIT": lambda d: d.json["nodes"][0].update(rotation=[0, 0, 0, 2]),
    "KHR_LIGHTS_PUNCTUAL_LIGHT_SPOT_ANGLES": lambda d: (
        d.use("KHR_lights_punctual")
        or d.json.update(extensions={"KHR_lights_punctual": {"lights": [SPOT]}})
        or d.json["nodes"][0].update(extensions={"KHR_lights_punctual": {"light": 0}})
    ),
    "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT": lambda d: animated(
        d, "translation", [[0, 0], [1, 1]], [[0, 0, 0], [1, 0, 0]], node=0
    ),
    "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT": lambda d: animated(
        d, "translation", [0, 1], [[0, 0, 0]], node=0
    ),
    "ACCESSOR_ANIMATION_INPUT_NEGATIVE": lambda d: animated(
        d, "translation", [-1, 0], [[0, 0, 0], [1, 0, 0]], node=0
    ),
    "ACCESSOR_ANIMATION_INPUT_NON_INCREASING": lambda d: animated(
        d, "translation", [1, 0], [[0, 0, 0], [1, 0, 0]], node=0
    ),
}


@pytest.mark.parametrize("code", NOTICED)
def test_faults_without_effect_on_the_image_give_a_notice_with_their_code(tmp_path: Path, code: str) -> None:
    document = Document()
    document.node(mesh=document.square(name="red"))
    NOTICED[code](document)
    world = load(document, tmp_path)
    assert any(f"({code})" in str(notice) for notice in world.notices), world.notices


def _joints(d: Document) -> None:
    """Adds joints to the vertices, so that the node's skin applies."""
    d.json["meshes"][0]["primitives"][0]["attributes"] |= {
        "JOINTS_0": d.accessor(np.zeros((4, 4), np.uint8)),
        "WEIGHTS_0": d.accessor(np.tile(np.array([1, 0, 0, 0], np.float32), (4, 1))),
    }


def _skin(**skin: Any) -> Callable[[Document], Any]:
    return lambda d: (_joints(d), d.json["nodes"][0].update(skin=d.add("skins", **skin)))


OMITTED: dict[str, tuple[Callable[[Document], Any], str]] = {
    "alphaMode": (
        lambda d: (
            d.json.update(materials=[{"alphaMode": "GLASS"}]),
            d.json["meshes"][0]["primitives"][0].update(material=0),
        ),
        "VALUE_NOT_IN_LIST",
    ),
    "mode": (
        lambda d: d.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 9}),
        "VALUE_NOT_IN_RANGE",
    ),
    "joint": (_skin(joints=[99]), "UNRESOLVED_REFERENCE"),
    "skin": (lambda d: (_joints(d), d.json["nodes"][0].update(skin=7)), "UNRESOLVED_REFERENCE"),
    "bind": (
        lambda d: _skin(joints=[0], inverseBindMatrices=d.accessor(np.zeros((1, 4), np.float32)))(d),
        "SKIN_IBM_INVALID_FORMAT",
    ),
}


@pytest.mark.parametrize("fault", OMITTED)
def test_faults_of_one_part_leave_the_rest_of_the_model(tmp_path: Path, fault: str) -> None:
    document = Document()
    document.node(mesh=document.square(), translation=[1, 2, 3])
    expected = load(document, tmp_path).triangles(0)
    damage, code = OMITTED[fault]
    damage(document)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        world = load(document, tmp_path)
    np.testing.assert_array_equal(world.triangles(0), expected)
    assert any(code in str(notice) for notice in world.notices)
