"""Instances of USD, compared with OpenUSD.

The tests cover prototypes, primvars per instance and nested instancers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt
from raycam import usd
from support.raises import has_notice
from support.usd_stages import bind, material, square, stage

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def load(made: Any) -> raycam.World:
    made.Save()
    return raycam.load(made.GetRootLayer().realPath)


def read_codes(made: Any, folder: Path) -> list[str]:
    """The codes of a stage's notices."""
    made.Save()
    own = folder / "own"
    own.mkdir()
    return [code for code, _ in usd.read(made.GetRootLayer().realPath, own).notices]


def instancer(made: Any, prototypes: list[str], indices: list[int], name: str = "/many") -> Any:
    """A point instancer whose instances are 10 apart along x."""
    many = UsdGeom.PointInstancer.Define(made, name)
    many.CreatePrototypesRel().SetTargets([Sdf.Path(path) for path in prototypes])
    many.CreateProtoIndicesAttr(indices)
    many.CreatePositionsAttr([(10.0 * number, 0, 0) for number in range(len(indices))])
    return many


def places(world: raycam.World) -> list[float]:
    return sorted(float(thing.matrix[0, 3]) for thing in world.objects)


def colors_by_place(world: raycam.World) -> list[tuple[float, ...]]:
    """The colour of each object, ordered by its x coordinate."""
    colors = np.asarray(world.triangle_colors(), float)
    order = sorted(range(len(world.objects)), key=lambda number: world.objects[number].matrix[0, 3])
    starts = np.cumsum([0, *(thing.triangles for thing in world.objects)])
    return [tuple(np.round(colors[starts[number]], 5).tolist()) for number in order]


@pytest.mark.parametrize("above", ["over", "def", "nested over"])
def test_prototypes_below_an_over_are_shown(tmp_path: Path, above: str) -> None:
    made = stage(tmp_path / "a.usda")
    root = "/many/protos" if above != "nested over" else "/away/protos"
    many = instancer(made, [f"{root}/a", f"{root}/b"], [0, 1, 0])
    square(made, f"{root}/a/mesh")
    square(made, f"{root}/b/mesh", points=[(0, 0, 0), (2, 0, 0), (2, 3, 0)])
    for path in {root, root.rpartition("/")[0]} - {"/many"}:
        made.GetPrimAtPath(path).SetSpecifier(Sdf.SpecifierDef if above == "def" else Sdf.SpecifierOver)
    assert many
    world = load(made)
    assert len(world.objects) == 3
    # This is the schema's own example; `UsdGeom.BBoxCache` finds no prims below an `over`.
    np.testing.assert_allclose(world.bounds, [[-1, -1, 0], [21, 3, 0]])


@pytest.mark.parametrize("fault", ["missing", "class", "inactive", "over", "index", "lengths"])
def test_instances_without_a_prototype_are_reported(tmp_path: Path, fault: str) -> None:
    made = stage(tmp_path / "a.usda")
    many = instancer(made, ["/many/good", "/many/bad"], [0, 1, 1])
    square(made, "/many/good")
    bad = square(made, "/many/bad").GetPrim()
    if fault == "missing":
        made.RemovePrim("/many/bad")
    elif fault == "class":
        bad.SetSpecifier(Sdf.SpecifierClass)
    elif fault == "inactive":
        bad.SetActive(False)
    elif fault == "over":
        bad.SetSpecifier(Sdf.SpecifierOver)
    elif fault == "index":
        many.GetProtoIndicesAttr().Set([0, 7, -1])
    else:
        many.GetPositionsAttr().Set([(0, 0, 0)])
        square(made, "/shown")
    world = load(made)
    assert len(world.objects) == 1
    codes = read_codes(made, tmp_path)
    assert codes.count("ignored_element") == (2 if fault == "index" else 1)


def test_masked_instances_are_not_shown(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    many = instancer(made, ["/many/a"], [0, 0, 0, 0])
    square(made, "/many/a")
    many.CreateInvisibleIdsAttr([1])
    many.GetPrim().SetMetadata("inactiveIds", Sdf.Int64ListOp.CreateExplicit([2]))
    assert places(load(made)) == [0.0, 30.0]
    assert "hidden_part" in read_codes(made, tmp_path)


@pytest.mark.parametrize("interpolation", ["vertex", "varying", "faceVarying", "uniform", "constant"])
@pytest.mark.parametrize("indexed", [False, True])
def test_instances_have_their_own_colors(tmp_path: Path, interpolation: str, indexed: bool) -> None:
    """An instance's value applies to the whole instance (UsdGeomPointInstancer)."""
    made = stage(tmp_path / "a.usda")
    many = instancer(made, ["/many/a"], [0, 0, 0])
    square(made, "/many/a")
    color = UsdGeom.PrimvarsAPI(many).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation
    )
    is_single = interpolation in ("uniform", "constant")
    color.Set(Vt.Vec3fArray([GREEN] if is_single else [RED, GREEN] if indexed else [RED, GREEN, RED]))
    if indexed:
        color.SetIndices(Vt.IntArray([0] if is_single else [0, 1, 0]))
    expected = [GREEN] * 3 if is_single else [RED, GREEN, RED]
    world = load(made)
    assert colors_by_place(world) == expected
    assert {thing.mesh for thing in world.objects} == {0}


def test_colors_of_the_prototype_take_precedence_over_those_of_instances(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    many = instancer(made, ["/many/own", "/many/above", "/many/none"], [0, 1, 2, 2])
    square(made, "/many/own").CreateDisplayColorAttr([BLUE])
    above = UsdGeom.Xform.Define(made, "/many/above").GetPrim()
    square(made, "/many/above/mesh")
    UsdGeom.PrimvarsAPI(above).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant").Set(
        [GREEN]
    )
    square(made, "/many/none")
    UsdGeom.PrimvarsAPI(many).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex").Set(
        [RED, RED, RED, (0.5, 0.5, 0.5)]
    )
    assert colors_by_place(load(made)) == [BLUE, GREEN, RED, (0.5, 0.5, 0.5)]


def test_instances_have_their_own_opacity(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    many = instancer(made, ["/many/a"], [0, 0])
    square(made, "/many/a")
    UsdGeom.PrimvarsAPI(many).CreatePrimvar("displayOpacity", Sdf.ValueTypeNames.FloatArray, "vertex").Set(
        [1.0, 0.25]
    )
    world = load(made)
    world.add_light(type="sky", radiance=[1, 1, 1])
    for x, seen in ((0, 1.0), (10, 0.25)):
        camera = raycam.Camera.look_at((x, 0, 5), (x, 0, 0), (0, 1, 0), size=(2, 2), fov=1)
        alpha = raycam.render(world, camera, samples=256, max_depth=1, transparent_background=True)["alpha"]
        assert np.mean(alpha) == pytest.approx(seen, abs=0.06)


def test_native_instances_have_the_primvars_of_their_ancestors(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    made.OverridePrim("/model").SetSpecifier(Sdf.SpecifierClass)
    square(made, "/model/mesh")
    for number, color in enumerate([RED, GREEN, BLUE, None]):
        parent = UsdGeom.Xform.Define(made, f"/group{number}")
        parent.AddTranslateOp().Set((10.0 * number, 0, 0))
        prim = UsdGeom.Xform.Define(made, f"/group{number}/copy").GetPrim()
        prim.GetReferences().AddInternalReference("/model")
        prim.SetInstanceable(True)
        owner = prim if number == 0 else parent.GetPrim()
        if color:
            primvar = UsdGeom.PrimvarsAPI(owner).CreatePrimvar(
                "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
            )
            primvar.Set([color])
    world = load(made)
    assert colors_by_place(world) == [RED, GREEN, BLUE, (0.8, 0.8, 0.8)]
    assert {thing.mesh for thing in world.objects} == {0}


@pytest.mark.parametrize(
    "difference", ["none", "visibility", "purpose", "material", "collection", "primvar", "flat"]
)
def test_equal_native_instances_have_the_places_of_openusd(tmp_path: Path, difference: str) -> None:
    made = stage(tmp_path / "a.usda")
    made.OverridePrim("/model").SetSpecifier(Sdf.SpecifierClass)
    inner = UsdGeom.Xform.Define(made, "/model/inner")
    inner.AddScaleOp().Set((1, 2, 0.5))
    square(made, "/model/inner/low", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 1)])
    fixed = square(made, "/model/fixed")
    fixed.SetResetXformStack(True)
    fixed.AddTranslateOp().Set((0, 7, 0))
    many = instancer(made, ["/model/many/dot"], [0, 0], "/model/many")
    many.AddTranslateOp().Set((0, 0, 3))
    square(made, "/model/many/dot")
    copies = []
    for number in range(5):
        copy = UsdGeom.Xform.Define(made, f"/all/group{number // 3}/copy{number}")
        copy.AddTranslateOp().Set((3.0 * number, -number, 0))
        copy.AddRotateZOp().Set(17.0 * number)
        copy.GetPrim().GetReferences().AddInternalReference("/model")
        copy.GetPrim().SetInstanceable(True)
        copies.append(copy)
    odd = copies[1]
    if difference == "visibility":
        odd.MakeInvisible()
    elif difference == "purpose":
        odd.CreatePurposeAttr("guide")
    elif difference == "material":
        bind(odd, material(made, "/paint", diffuseColor=RED))
    elif difference == "collection":
        paint = material(made, "/paint", diffuseColor=RED)
        owner = made.GetPrimAtPath("/all")
        red = Usd.CollectionAPI.Apply(owner, "red")
        red.IncludePath(odd.GetPath())
        UsdShade.MaterialBindingAPI.Apply(owner).Bind(red, paint)
    elif difference == "primvar":
        UsdGeom.PrimvarsAPI(odd).CreatePrimvar(
            "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
        ).Set([RED])
    elif difference == "flat":
        odd.AddScaleOp().Set((1, 1, 0))
    world = load(made)
    is_hidden = difference in ("visibility", "purpose")
    # Instances with zero scale along an axis are shown if they are native instances, but not in a point instancer.
    lost = 4 if is_hidden else 2 if difference == "flat" else 0
    assert len(world.objects) == 5 * 4 - lost
    # The flat copy of "low" is a mesh of its own, in world coordinates; "fixed" ignores its parents.
    assert world.counts["meshes"] == (3 if difference == "flat" else 2)
    assert [thing.name.rstrip("0123456789_. ") for thing in world.objects][:4] == [
        "low",
        "fixed",
        "many",
        "many",
    ]
    colors = np.asarray(world.triangle_colors(), float)
    is_red = np.isclose(colors, RED).all(axis=1).sum()
    assert is_red == (8 if difference in ("material", "collection", "primvar") else 0)
    if difference == "flat":
        return  # OpenUSD inverts the flat instance's matrix
    cache = UsdGeom.BBoxCache(Usd.TimeCode(0), [UsdGeom.Tokens.default_])
    judged = cache.ComputeWorldBound(made.GetPrimAtPath("/all")).ComputeAlignedRange()
    np.testing.assert_allclose(world.bounds, [judged.GetMin(), judged.GetMax()], atol=1e-4)


def test_instanceable_meshes_keep_their_names(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made, "/model")
    for number in range(3):
        copy = UsdGeom.Mesh.Define(made, f"/copy{number}").GetPrim()
        copy.GetReferences().AddInternalReference("/model")
        copy.SetInstanceable(True)
    world = load(made)
    assert [thing.name for thing in world.objects] == ["model", "copy0", "copy1", "copy2"]
    assert world.counts["meshes"] == 1


@pytest.mark.parametrize("hidden", ["parent", "prototype"])
def test_invisible_parents_of_a_prototype_have_no_effect(tmp_path: Path, hidden: str) -> None:
    """Prototypes are often in an invisible scope.

    An example is OpenUSD's testUsdImagingGLInstancePrimvars.
    """
    made = stage(tmp_path / "a.usda")
    instancer(made, ["/many/protos/a", "/many/protos/b"], [0, 1, 0])
    square(made, "/many/protos/a/mesh")
    square(made, "/many/protos/b/mesh")
    owner = made.GetPrimAtPath("/many/protos" if hidden == "parent" else "/many/protos/b")
    owner.SetTypeName("Scope")
    UsdGeom.Imageable(owner).MakeInvisible()
    assert places(load(made)) == ([0, 10, 20] if hidden == "parent" else [0, 20])
    assert ("hidden_part" in read_codes(made, tmp_path)) == (hidden == "prototype")


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_nested_instancers_have_the_transforms_of_openusd(tmp_path: Path, depth: int) -> None:
    made = stage(tmp_path / "a.usda")
    path = "/many"
    for level in range(depth):
        many = instancer(made, [f"{path}/inner"], [0, 0, 0], path)
        many.GetPositionsAttr().Set([(3.0**level * 10 * n, level, n) for n in range(3)])
        many.CreateOrientationsAttr([Gf.Quath(0.5, 0.5, -0.5, 0.5)] * 3)
        many.CreateScalesAttr([(1, 2, 0.5)] * 3)
        path = f"{path}/inner"
    mesh = square(made, path)
    mesh.AddTranslateOp().Set((0.5, 1, 2))
    world = load(made)
    assert len(world.objects) == 3**depth
    instance = UsdGeom.PointInstancer(made.GetPrimAtPath("/many"))
    if depth == 1:
        matrices = instance.ComputeInstanceTransformsAtTime(Usd.TimeCode(0), Usd.TimeCode(0))
        expected = np.array(matrices).transpose(0, 2, 1)[:, :3]
        np.testing.assert_allclose([thing.matrix[:3] for thing in world.objects], expected, atol=1e-5)
    inside = UsdGeom.BBoxCache(Usd.TimeCode(0), [UsdGeom.Tokens.default_]).ComputeWorldBound(
        made.GetPrimAtPath("/many")
    )
    judged = inside.ComputeAlignedRange()
    np.testing.assert_allclose(world.bounds, [judged.GetMin(), judged.GetMax()], atol=1e-4)


def test_many_instances_are_objects_of_one_mesh(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usdc")
    count = 20_000
    many = instancer(made, ["/many/a"], [0])
    square(made, "/many/a")
    positions = np.random.default_rng(3).uniform(-100, 100, (count, 3)).astype(np.float32)
    many.GetProtoIndicesAttr().Set(Vt.IntArray(count, 0))
    many.GetPositionsAttr().Set(Vt.Vec3fArray.FromNumpy(positions))
    colors = np.random.default_rng(4).uniform(0, 1, (count, 3)).astype(np.float32)
    UsdGeom.PrimvarsAPI(many).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex").Set(
        Vt.Vec3fArray.FromNumpy(colors)
    )
    world = load(made)
    assert world.counts["meshes"] == 1
    assert len(world.objects) == count
    np.testing.assert_allclose(world.objects[777].matrix[:3, 3], positions[777])
    assert world.objects[777].name == "many.777"
    np.testing.assert_allclose(np.asarray(world.triangle_colors())[2 * 777], colors[777], atol=1e-6)


@pytest.mark.parametrize("kind", ["SphereLight", "NurbsPatch"])
def test_prims_of_a_prototype_that_cannot_be_shown_are_reported(tmp_path: Path, kind: str) -> None:
    made = stage(tmp_path / "a.usda")
    instancer(made, ["/many/a"], [0, 0])
    square(made, "/many/a/mesh")
    made.DefinePrim("/many/a/other", kind)
    assert len(load(made).objects) == 2
    assert "ignored_feature" in read_codes(made, tmp_path)


def test_instances_without_prototype_numbers_are_reported(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    many = UsdGeom.PointInstancer.Define(made, "/many")
    many.CreatePositionsAttr([(0, 0, 0), (1, 0, 0)])
    many.CreateExtentAttr([(0, 0, 0), (1, 1, 1)])
    world = load(made)
    assert len(world.objects) == 1
    assert has_notice(world.notices, "ignored_element", "/many", "2 instances", "protoIndices")


def test_bounds_are_those_of_the_points_not_of_authored_extents(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    ball = UsdGeom.Sphere.Define(made, "/ball")
    ball.CreateRadiusAttr(2.0)
    ball.CreateExtentAttr([(-9, -9, -9), (9, 9, 9)])
    world = load(made)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    judged = cache.ComputeWorldBound(made.GetPseudoRoot()).ComputeAlignedRange()
    assert list(judged.GetMax()) == [9, 9, 9]
    exact = UsdGeom.Boundable.ComputeExtentFromPlugins(ball, Usd.TimeCode.Default())
    np.testing.assert_allclose(world.bounds, np.array(exact), atol=1e-6)


@pytest.mark.parametrize("moved", ["positions", "orientations"])
def test_instances_with_velocities_are_shown_at_the_first_time(tmp_path: Path, moved: str) -> None:
    made = stage(tmp_path / "a.usda")
    square(made, "/proto")
    many = instancer(made, ["/proto"], [0, 0])
    half = Gf.Quath(0.5**0.5, 0, 0, 0.5**0.5)
    if moved == "positions":
        many.GetPositionsAttr().Clear()
        for time in (3.0, 5.0):
            many.GetPositionsAttr().Set([(0, 0, time), (10, 0, time)], time)
        many.CreateVelocitiesAttr([(0, 0, 24.0), (0, 0, 24.0)])
        many.GetVelocitiesAttr().Set([(0, 0, 24.0), (0, 0, 24.0)], 3.0)
    else:
        many.CreateOrientationsAttr().Set([half, half], 3.0)
        many.CreateAngularVelocitiesAttr().Set([(0, 0, 90.0), (0, 0, 90.0)], 3.0)
    world = load(made)
    assert len(world.objects) == 3
    assert not has_notice(world.notices, "ignored_element")
    time = Usd.TimeCode(3.0)
    expected = many.ComputeInstanceTransformsAtTime(time, time)
    found = [np.array(thing.matrix) for thing in world.objects if thing.name != "proto"][-2:]
    for matrix, judged in zip(found, expected, strict=True):
        np.testing.assert_allclose(matrix, np.array(judged).T, atol=1e-6)
