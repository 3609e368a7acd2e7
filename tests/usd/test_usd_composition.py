"""Composition of USD stages (errors, units of layers, variants), compared with OpenUSD."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Sdf, Usd, UsdGeom
from raycam import usd
from raycam.errors import SettingsError
from support.raises import raises
from support.usd_stages import square, stage


def read_notices(path: Path) -> list[tuple[str, str]]:
    """Codes and texts of a stage's notices."""
    own = path.parent / "own"
    own.mkdir()
    return usd.read(path, own).notices


ARCS = {
    "reference": lambda prim: prim.GetReferences().AddReference("b.usda", "/none"),
    "no default prim": lambda prim: prim.GetReferences().AddReference("b.usda"),
    "payload": lambda prim: prim.GetPayloads().AddPayload("b.usda", "/none"),
    "internal": lambda prim: prim.GetReferences().AddInternalReference("/none"),
    "inherits": lambda prim: prim.GetInherits().AddInherit("/none"),
    "specializes": lambda prim: prim.GetSpecializes().AddSpecialize("/none"),
    "cycle": lambda prim: prim.GetReferences().AddInternalReference("/world/odd"),
}


@pytest.mark.parametrize("arc", ARCS)
def test_composition_errors_give_notices_with_file_and_prim(tmp_path: Path, arc: str) -> None:
    other = stage(tmp_path / "b.usda")
    square(other, "/there")
    other.Save()
    made = stage(tmp_path / "a.usda")
    square(made, "/world/shown")
    ARCS[arc](made.DefinePrim("/world/odd", "Xform"))
    made.Save()
    errors = [text for code, text in read_notices(tmp_path / "a.usda") if code == "invalid_file"]
    assert len(errors) == 1
    assert errors[0].startswith("prim /world/odd: ")
    file = "b.usda" if arc in ("reference", "no default prim", "payload") else "a.usda"
    assert f"@{file}@" in errors[0]
    assert str(tmp_path) not in errors[0]
    assert len(raycam.load(tmp_path / "a.usda").objects) == 1


def test_stage_with_a_failed_reference_raises_with_the_cause(tmp_path: Path) -> None:
    other = stage(tmp_path / "b.usda")
    square(other, "/there")
    other.Save()
    made = stage(tmp_path / "a.usda")
    made.DefinePrim("/world", "Xform").GetReferences().AddReference("b.usda")
    made.Save()
    with raises(raycam.FormatError, code="nothing_visible", mentions=["/world", "b.usda"]):
        raycam.load(tmp_path / "a.usda")


@pytest.mark.parametrize("arc", ["reference", "payload", "sublayer"])
def test_different_units_and_axes_of_a_layer_give_notices(tmp_path: Path, arc: str) -> None:
    other = stage(tmp_path / "b.usda", "Y")
    UsdGeom.SetStageMetersPerUnit(other, 0.01)
    square(other, "/part")
    other.SetDefaultPrim(other.GetPrimAtPath("/part"))
    other.Save()
    made = stage(tmp_path / "a.usda", "Z")
    if arc == "sublayer":
        made.GetRootLayer().subLayerPaths.append("b.usda")
    else:
        prim = made.DefinePrim("/world")
        prim.GetReferences().AddReference("b.usda") if arc == "reference" else prim.GetPayloads().AddPayload(
            "b.usda"
        )
    made.Save()
    found = read_notices(tmp_path / "a.usda")
    assert [code for code, _ in found] == ["assumed_convention"] * 2
    unit, axis = (text for _, text in found)
    assert "b.usda" in unit
    assert "0.01" in unit.rpartition("multiply")[2]
    assert "b.usda" in axis
    np.testing.assert_allclose(np.ptp(raycam.load(tmp_path / "a.usda").bounds, axis=0), [2, 2, 0])


def test_equal_units_and_axes_give_no_notices(tmp_path: Path) -> None:
    other = stage(tmp_path / "b.usda")
    square(other, "/part")
    other.Save()
    made = stage(tmp_path / "a.usda")
    made.DefinePrim("/world").GetReferences().AddReference("b.usda", "/part")
    made.Save()
    assert not read_notices(tmp_path / "a.usda")


def chair(path: Path) -> Any:
    """Two prims with the variant set `shape`.

    The set's second variant contains the variant set `size`.
    """
    made = stage(path)
    for number, name in enumerate(("/a", "/b")):
        prim = UsdGeom.Xform.Define(made, name).GetPrim()
        UsdGeom.Xformable(prim).AddTranslateOp().Set((10.0 * number, 0, 0))
        shapes = prim.GetVariantSets().AddVariantSet("shape")
        for kind in ("Cube", "Sphere"):
            shapes.AddVariant(kind)
            shapes.SetVariantSelection(kind)
            with shapes.GetVariantEditContext():
                made.DefinePrim(f"{name}/solid", kind)
                if kind == "Sphere":
                    sizes = prim.GetVariantSets().AddVariantSet("size")
                    for size in ("small", "large"):
                        sizes.AddVariant(size)
                        sizes.SetVariantSelection(size)
                        with sizes.GetVariantEditContext():
                            sphere = UsdGeom.Sphere(made.GetPrimAtPath(f"{name}/solid"))
                            sphere.CreateRadiusAttr(5.0 if size == "large" else 0.25)
        shapes.SetVariantSelection("Cube")
    made.Save()
    return made


@pytest.mark.parametrize(
    ("variant", "selections"),
    [
        ("Sphere", {"/a": ["shape=Sphere"], "/b": ["shape=Sphere"]}),
        ("shape=Sphere", {"/a": ["shape=Sphere"], "/b": ["shape=Sphere"]}),
        ("/b{shape=Sphere}", {"/b": ["shape=Sphere"]}),
        ("/b{shape=Sphere}, /b{size=small}", {"/b": ["shape=Sphere", "size=small"]}),
        (
            "shape=Sphere,size=small",
            {"/a": ["shape=Sphere", "size=small"], "/b": ["shape=Sphere", "size=small"]},
        ),
        ("Cube", {}),
    ],
)
def test_variant_argument_selects_a_variant(
    tmp_path: Path, variant: str, selections: dict[str, list[str]]
) -> None:
    made = chair(tmp_path / "a.usda")
    world = raycam.load(tmp_path / "a.usda", variant=variant)
    for path, chosen in selections.items():
        for one in chosen:
            name, _, value = one.partition("=")
            made.GetPrimAtPath(path).GetVariantSet(name).SetVariantSelection(value)
    judged = UsdGeom.BBoxCache(Usd.TimeCode(0), [UsdGeom.Tokens.default_]).ComputeWorldBound(
        made.GetPseudoRoot()
    )
    box = judged.ComputeAlignedRange()
    np.testing.assert_allclose(world.bounds, [box.GetMin(), box.GetMax()], rtol=2e-3, atol=1e-6)


def test_variants_are_listed(tmp_path: Path) -> None:
    chair(tmp_path / "a.usda")
    world = raycam.load(tmp_path / "a.usda")
    assert world.variants == ["shape=Cube", "shape=Sphere"]
    with raises(raycam.WorldError, code="conflicting_values", mentions=["'shape=Sphere'"]):
        world.with_variant("shape=Sphere")
    codes = [code for code, _ in read_notices(tmp_path / "a.usda")]
    assert codes == ["first_only"]
    sphere = raycam.load(tmp_path / "a.usda", variant="Sphere")
    assert sphere.variants == ["shape=Cube", "shape=Sphere", "size=large", "size=small"]


@pytest.mark.parametrize("variant", ["Cone", "shape=Cone", "size=Cube", "/c{shape=Cube}", "{}", "=", ""])
def test_unknown_variant_raises_with_all_names(tmp_path: Path, variant: str) -> None:
    chair(tmp_path / "a.usda")
    with raises(raycam.WorldError, code="unknown_name", mentions=["shape=Cube", "shape=Sphere"]):
        raycam.load(tmp_path / "a.usda", variant=variant)
    assert Sdf.Layer.FindOrOpen(str(tmp_path / "a.usda"))


def test_variant_that_is_not_a_string_raises(tmp_path: Path) -> None:
    chair(tmp_path / "a.usda")
    with raises(SettingsError, code="wrong_type", mentions=["variant", "dict"]):
        raycam.load(tmp_path / "a.usda", variant={"shape": "Cube"})  # type: ignore[arg-type]
