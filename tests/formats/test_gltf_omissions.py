"""Invalid optional values of glTF documents: only the value is omitted, with a notice."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.gltf_document import Document, load
from support.raises import notice_codes, raises


def document(node: dict[str, Any], **root: Any) -> Document:
    """A square below a node with these values, next to a square at x = 5."""
    made = Document()
    mesh = made.square()
    made.node(**{"mesh": mesh, "name": "faulty", **node})
    made.node(mesh=mesh, name="valid", translation=[5.0, 0.0, 0.0])
    made.json.update(root)
    return made


def written(world: raycam.World, folder: Path) -> Any:
    """The JSON of the world as a glTF file."""
    world.to_gltf(folder / "written.glb")
    data = (folder / "written.glb").read_bytes()
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


FAULTY_NODES = {
    "translation": [[1, 2, 3, 4], [1, 2], [], 3, "a", [1, "2", 3], {"x": 1}, [[1, 2, 3]]],
    "rotation": [[0, 0, 0], [0, 0, 0, 1, 0], 1, [0, 0, None, 1], [0, 0, 0, 0]],
    "scale": [[2, 2], [2, 2, 2, 2], 2, "2"],
    "matrix": [[1.0] * 15, list(range(17)), [[1, 0], [0, 1]], "I", [*np.diag([1, 1, 1, 2.0]).ravel()]],
    "weights": ["a", [0.5, "b"], {}],
    "skin": ["a", -1, 1.5],
    "name": [3, ["a"]],
}


@pytest.mark.parametrize("key", FAULTY_NODES)
def test_invalid_value_of_a_node_is_omitted_and_its_other_values_are_used(tmp_path: Path, key: str) -> None:
    for value in FAULTY_NODES[key]:
        own = {"translation": [0, 7, 0]} if key in ("rotation", "scale") else {}
        world = load(document({**own, key: value}), tmp_path)
        assert len(world.objects) == 2, (key, value)
        assert "ignored_element" in notice_codes(world.notices), (key, value, world.notices)
        assert any(f"nodes[0].{key}" in str(notice) for notice in world.notices), (key, value, world.notices)
        first, second = (np.array(item.matrix) for item in world.objects)
        expected = np.eye(4)
        expected[:3, 3] = own.get("translation", [0, 0, 0])
        np.testing.assert_array_equal(first, expected)
        assert second[0, 3] == 5.0


FAULTY_MATERIALS: list[tuple[str, Any]] = [
    ("pbrMetallicRoughness.baseColorFactor", [1, 0, 0]),
    ("pbrMetallicRoughness.metallicFactor", "0.5"),
    ("pbrMetallicRoughness.roughnessFactor", [0.5]),
    ("pbrMetallicRoughness", 3),
    ("pbrMetallicRoughness.baseColorTexture", 0),
    ("normalTexture", {"index": "a"}),
    ("emissiveFactor", [1, 1, 1, 1]),
    ("emissiveFactor", 1),
    ("alphaMode", 2),
    ("alphaCutoff", "half"),
    ("doubleSided", "yes"),
    ("name", 5),
    ("extensions.KHR_materials_ior", {"ior": "1.5"}),
    ("extensions.KHR_materials_sheen", {"sheenColorFactor": [1, 1]}),
    ("extensions.KHR_materials_clearcoat", "coat"),
]


@pytest.mark.parametrize(("path", "value"), FAULTY_MATERIALS)
def test_invalid_value_of_a_material_is_omitted_and_its_other_values_are_used(
    tmp_path: Path, path: str, value: Any
) -> None:
    material: dict[str, Any] = {
        "pbrMetallicRoughness": {"metallicFactor": 0.0},
        "emissiveFactor": [0, 0, 0.25],
    }
    inner, *keys = material, *path.split(".")
    for key in keys[:-1]:
        inner = inner.setdefault(key, {})
    inner[keys[-1]] = value
    made = document({}, materials=[material])
    made.json["meshes"][0]["primitives"][0]["material"] = 0
    world = load(made, tmp_path)
    assert any(f"materials[0].{path}" in str(notice) for notice in world.notices), world.notices
    if "emissiveFactor" not in path:
        assert written(world, tmp_path)["materials"][0]["emissiveFactor"] == [0, 0, 0.25]


@pytest.mark.parametrize(
    ("list_name", "item"),
    [
        ("textures", {"source": "a"}),
        ("images", {"uri": 3}),
        ("samplers", {"wrapS": "REPEAT"}),
        ("textures", {"sampler": []}),
    ],
)
def test_invalid_value_of_a_texture_is_omitted(tmp_path: Path, list_name: str, item: dict[str, Any]) -> None:
    world = load(document({}, **{list_name: [item]}), tmp_path)
    key = next(iter(item))
    assert len(world.objects) == 2
    assert any(f"{list_name}[0].{key}" in str(notice) for notice in world.notices), world.notices


def test_material_that_does_not_exist_is_replaced_by_the_default_material(tmp_path: Path) -> None:
    made = document({})
    made.json["meshes"][0]["primitives"][0]["material"] = 7
    world = load(made, tmp_path)
    assert len(world.objects) == 2
    assert any("UNRESOLVED_REFERENCE" in str(notice) for notice in world.notices)


@pytest.mark.parametrize("node", [{"mesh": "a"}, {"children": [1.5]}, {"children": 3}])
def test_invalid_values_that_determine_the_geometry_are_refused(tmp_path: Path, node: dict[str, Any]) -> None:
    with raises(raycam.FormatError, mentions=["nodes[0]", "TYPE_MISMATCH"]):
        load(document({**node, "translation": [1, 2]}), tmp_path)


def test_thousands_of_invalid_values_are_omitted_with_one_notice(tmp_path: Path) -> None:
    made = Document()
    mesh = made.square()
    for _ in range(3000):
        made.node(mesh=mesh, translation=[1, 2, 3, 1])
    world = load(made, tmp_path)
    assert (len(world.objects), len(world.notices)) == (3000, 1)


def test_file_whose_values_exceed_its_memory_is_refused_instead_of_repaired(tmp_path: Path) -> None:
    """The tree of all values that a repair needs is limited in proportion to the file, like all other decoded data."""
    made = document({"translation": [1, 2]}, extras=[1] * 4_000_000)
    with raises(raycam.FormatError, mentions=["nodes[0].translation"]):
        load(made, tmp_path)
    made.json["extras"] = [1] * 1000
    assert len(load(made, tmp_path).objects) == 2
