"""Prims of USD that cannot be shown, and the materials that are bound to prims."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt
from support.raises import Fault, fault, has_notice, raises
from support.usd_stages import bind, image, material, square, stage


def load(made: Any) -> raycam.World:
    made.Save()
    return raycam.load(made.GetRootLayer().realPath)


def scale(*factors: float) -> Any:
    def change(mesh: Any) -> None:
        mesh.AddScaleOp().Set(factors)

    return change


def nested_scale(mesh: Any) -> None:
    mesh.AddRotateXYZOp().Set((10, 20, 30))
    mesh.AddScaleOp(opSuffix="zero").Set((0, 0, 0))


def typed(name: str, kind: str, value: Any) -> Any:
    def change(mesh: Any) -> None:
        layer = mesh.GetPrim().GetStage().GetRootLayer()
        prim = layer.GetPrimAtPath(mesh.GetPath())
        prim.RemoveProperty(prim.properties[name])
        attribute = Sdf.AttributeSpec(prim, name, getattr(Sdf.ValueTypeNames, kind))
        attribute.default = value

    return change


def holes(mesh: Any) -> None:
    mesh.CreateHoleIndicesAttr([0])


def no_points(mesh: Any) -> None:
    mesh.GetPointsAttr().Clear()


def bad_corner(mesh: Any) -> None:
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 77])


def infinite_place(mesh: Any) -> None:
    mesh.AddTranslateOp().Set((float("inf"), 0, 0))


UNUSABLE = {
    "scale 0": (scale(0, 0, 0), []),
    "scale 0 twice": (scale(1, 0, 0), []),
    "scale 0 after a turn": (nested_scale, []),
    "holes": (holes, []),
    "points of floats": (typed("points", "FloatArray", [1.0, 2.0, 3.0]), ["points", "float[]"]),
    "points of double3 alone": (typed("points", "Double3", (1, 2, 3)), ["points", "double3", "point3f[]"]),
    "points of doubles": (
        typed("points", "Double3Array", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]),
        ["points", "double3[]", "point3f[]"],
    ),
    "points of strings": (typed("points", "StringArray", ["a", "b"]), ["points", "string[]"]),
    "indices of float3": (
        typed("faceVertexIndices", "Float3Array", [(0, 1, 2)]),
        ["faceVertexIndices", "float3[]"],
    ),
    "no points": (no_points, ["points"]),
    "a bad corner": (bad_corner, ["faceVertexIndices", 3]),
    "an infinite place": (infinite_place, []),
}


@pytest.mark.parametrize("case", UNUSABLE)
def test_invalid_mesh_prim_is_omitted_with_a_notice(tmp_path: Path, case: str) -> None:
    change, facts = UNUSABLE[case]
    made = stage(tmp_path / "a.usda")
    square(made, "/world/shown")
    change(square(made, "/world/odd"))
    world = load(made)
    assert [thing.name for thing in world.objects] == ["shown"]
    (notice,) = world.notices
    assert has_notice([notice], "ignored_element", "/world/odd", *facts)


@pytest.mark.parametrize("axes", [(1, 1, 0), (0, 2, 1), (2, 0, -1)])
def test_prim_with_zero_scale_along_one_axis_is_shown_flat(
    tmp_path: Path, axes: tuple[float, float, float]
) -> None:
    made = stage(tmp_path / "a.usda")
    cube = UsdGeom.Cube.Define(made, "/cube")
    cube.CreateDisplayColorAttr([(1, 0, 0)])
    cube.AddTranslateOp().Set((1, 2, 3))
    cube.AddScaleOp().Set(axes)
    world = load(made)
    bounds = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(cube.GetPrim())
    box = bounds.ComputeAlignedRange()
    assert world.bounds is not None
    np.testing.assert_allclose(world.bounds, [box.GetMin(), box.GetMax()], atol=1e-6)
    assert not world.notices


def test_hole_faces_are_omitted(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    mesh.GetFaceVertexCountsAttr().Set([3, 3])
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 0, 2, 3])
    mesh.CreateHoleIndicesAttr([1])
    assert len(load(made).triangles()) == 1


COLORS = {"full": (1.0, 0.0, 0.0), "preview": (0.0, 1.0, 0.0), "": (0.0, 0.0, 1.0)}


@pytest.mark.parametrize(
    ("purposes", "where"),
    [
        (["full"], "own"),
        (["preview"], "own"),
        (["full", "preview", ""], "own"),
        (["preview", ""], "own"),
        (["full"], "above"),
        (["preview", ""], "above"),
        (["preview"], "collection"),
        (["full", ""], "collection"),
    ],
)
def test_material_bindings_of_every_purpose_are_read(tmp_path: Path, purposes: list[str], where: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made, "/world/mesh")
    world_prim = made.GetPrimAtPath("/world")
    for purpose in purposes:
        paint = material(made, f"/paint_{purpose or 'all'}", diffuseColor=COLORS[purpose])
        if where == "collection":
            named = Usd.CollectionAPI.Apply(world_prim, f"things{purpose}")
            named.IncludePath("/world/mesh")
            UsdShade.MaterialBindingAPI.Apply(world_prim).Bind(
                named, paint, f"bound{purpose}", materialPurpose=purpose or UsdShade.Tokens.allPurpose
            )
        else:
            bind(UsdGeom.Imageable(world_prim) if where == "above" else mesh, paint, purpose)
    world = load(made)
    assert not world.notices
    first = purposes[0]
    computed, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial(first or UsdShade.Tokens.allPurpose)
    assert computed.GetPath() == f"/paint_{first or 'all'}"
    np.testing.assert_allclose(world.triangle_colors(), [COLORS[first]] * 2)


def other_shader(made: Any, name: str) -> Any:
    """A material of another renderer."""
    found = UsdShade.Material.Define(made, name)
    shader = UsdShade.Shader.Define(made, f"{name}/surface")
    shader.CreateIdAttr("ND_standard_surface_surfaceshader")
    found.CreateSurfaceOutput("mtlx").ConnectToSource(shader.ConnectableAPI(), "out")
    return found


def test_binding_with_a_supported_material_is_preferred(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    bind(mesh, other_shader(made, "/fine"), "full")
    bind(mesh, material(made, "/plain", diffuseColor=(1.0, 0.5, 0.0)))
    world = load(made)
    assert not world.notices
    np.testing.assert_allclose(world.triangle_colors(), [(1, 0.5, 0)] * 2)


@pytest.mark.parametrize("color", [None, (0.0, 1.0, 0.0)])
def test_unsupported_material_is_replaced_by_display_colors(tmp_path: Path, color: Any) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    bind(mesh, other_shader(made, "/fine"))
    if color:
        mesh.CreateDisplayColorAttr([color])
    world = load(made)
    np.testing.assert_allclose(world.triangle_colors(), [color or (0.8, 0.8, 0.8)] * 2, atol=1e-6)
    assert has_notice(world.notices, "ignored_feature", "/fine", "UsdPreviewSurface")


@pytest.mark.parametrize("how", ["gone", "unknown purpose", "above"])
def test_binding_to_a_missing_material_gives_a_notice(tmp_path: Path, how: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    prim = mesh.GetPrim() if how != "above" else made.GetPrimAtPath("/world")
    UsdShade.MaterialBindingAPI.Apply(prim)
    name = "material:binding:render" if how == "unknown purpose" else "material:binding"
    target = "/paint" if how == "unknown purpose" else "/gone"
    prim.CreateRelationship(name).SetTargets([target])
    material(made, "/paint", diffuseColor=(1.0, 0.0, 0.0))
    world = load(made)
    (notice,) = world.notices
    assert has_notice([notice], "ignored_feature", "Mesh /world/square:", "binding")


@pytest.mark.parametrize("family", ["", "materialBind", "other"])
def test_subsets_without_a_family_name_keep_their_material(tmp_path: Path, family: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    mesh.GetFaceVertexCountsAttr().Set([3, 3])
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 0, 2, 3])
    mesh.CreateDisplayColorAttr([(0, 0, 1)])
    subset = UsdGeom.Subset.Define(made, "/world/square/part")
    subset.CreateElementTypeAttr("face")
    subset.CreateIndicesAttr([1])
    if family:
        subset.CreateFamilyNameAttr(family)
    bind(subset, material(made, "/red", diffuseColor=(1.0, 0.0, 0.0)), "preview")
    world = load(made)
    used = len(UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets()) or not family
    expected = [(1, 0, 0), (0, 0, 1)] if used else [(0, 0, 1), (0, 0, 1)]
    assert sorted(map(tuple, world.triangle_colors().tolist())) == sorted(expected)
    assert bool(world.notices) == (family == "")
    if not family:
        assert has_notice(world.notices[:1], "invalid_file", "/world/square/part", "familyName")


def odd_camera(made: Any, case: str) -> None:
    camera = UsdGeom.Camera.Define(made, "/odd")
    if case == "focal length":
        camera.CreateFocalLengthAttr(0.0)
    elif case == "aperture":
        camera.CreateHorizontalApertureAttr(0.0)
    else:
        camera.AddScaleOp().Set((0, 0, 0))


def odd_light(made: Any, case: str) -> None:
    light = UsdLux.RectLight.Define(made, "/odd")
    if case == "intensity":
        light.CreateIntensityAttr(float("inf"))
    elif case == "colour":
        light.CreateColorAttr((float("nan"), 1, 1))
    else:
        light.AddScaleOp().Set((1, 0, 1))


@pytest.mark.parametrize(
    ("make", "case"),
    [
        *((odd_camera, case) for case in ("focal length", "aperture", "scale")),
        *((odd_light, case) for case in ("intensity", "colour", "scale")),
    ],
)
def test_invalid_camera_or_light_is_omitted_with_a_notice(tmp_path: Path, make: Any, case: str) -> None:
    made = stage(tmp_path / "a.usda")
    square(made, "/shown")
    make(made, case)
    UsdGeom.Camera.Define(made, "/eye")
    world = load(made)
    assert len(world.objects) == 1
    assert list(world.cameras) == ["eye"]
    assert not world.lights
    (notice,) = world.notices
    assert has_notice([notice], "ignored_element", "/odd")


def guide(prim: Any) -> None:
    UsdGeom.Imageable(prim).CreatePurposeAttr("guide")


def proxy(prim: Any) -> None:
    UsdGeom.Imageable(prim.GetParent()).CreatePurposeAttr("proxy")


def invisible(prim: Any) -> None:
    UsdGeom.Imageable(prim).MakeInvisible()


@pytest.mark.parametrize(("hide", "word"), [(guide, "guide"), (proxy, "proxy"), (invisible, "invisible")])
def test_stage_with_only_hidden_prims_raises_with_their_count(tmp_path: Path, hide: Any, word: str) -> None:
    made = stage(tmp_path / "a.usda")
    made.DefinePrim("/world", "Xform")
    for name in ("a", "b"):
        hide(square(made, f"/world/{name}").GetPrim())
    with raises(raycam.FormatError, code="nothing_visible", mentions=[2, word]):
        load(made)
    other = stage(tmp_path / "b.usda")
    other.DefinePrim("/world", "Xform")
    hide(square(other, "/world/a").GetPrim())
    square(other, "/shown")
    assert has_notice(load(other).notices, "ignored_element", 1, word)


@pytest.mark.parametrize("kind", ["materials", "camera", "xform", "look"])
def test_stage_without_geometry_is_read_as_an_empty_world(tmp_path: Path, kind: str) -> None:
    made = stage(tmp_path / "a.usda")
    if kind == "materials":
        material(made, "/red", diffuseColor=(1.0, 0.0, 0.0))
    elif kind == "look":
        # the asset OpenChessSet of usd-wg/assets contains only MaterialX materials and a missing image
        made.DefinePrim("/look").GetReferences().AddReference("./a.mtlx", "/MaterialX")
        image(made, material(made, "/red"), "gone.png", {"diffuseColor": "rgb"})
    elif kind == "camera":
        UsdGeom.Camera.Define(made, "/eye")
    else:
        UsdGeom.Xform.Define(made, "/place")
    world = load(made)
    assert world.bounds is None
    assert list(world.cameras) == (["eye"] if kind == "camera" else [])
    assert has_notice(world.notices, "empty_file")


@pytest.mark.parametrize("interpolation", ["uniform", "vertex", "faceVarying"])
def test_face_opacities_are_read(tmp_path: Path, interpolation: str) -> None:
    """Faces with different opacities; the expected value is their share of the image."""
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(made, "/world/cells")
    mesh.CreatePointsAttr([(x, y, 0) for y in (-1, 1) for x in (-2, 0, 0, 2)])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 5, 4, 2, 3, 7, 6])
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDisplayColorAttr([(1, 1, 1)])
    opacity = mesh.CreateDisplayOpacityPrimvar(interpolation)
    values = {"uniform": [0.25, 1], "vertex": [0.25, 0.25, 1, 1] * 2, "faceVarying": [0.25] * 4 + [1] * 4}
    opacity.Set(Vt.FloatArray(values[interpolation]))
    world = load(made)
    assert not world.notices
    world.add_light(type="sky", radiance=[1, 1, 1])
    for x, expected in ((-1, 0.75), (1, 0.0)):
        camera = raycam.Camera.look_at((x, 0, 5), (x, 0, 0), (0, 1, 0), size=(2, 2), fov=1)
        color = raycam.render(world, camera, integrator="path", samples=256, max_depth=1)["color"]
        assert color == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize("interpolation", ["constant", "vertex"])
def test_primvar_colors_of_a_material_are_read(tmp_path: Path, interpolation: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint", roughness=0.25)
    colors = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("tint", Sdf.ValueTypeNames.Color3fArray, interpolation)
    colors.Set([(1.0, 0.5, 0.25)] * (4 if interpolation == "vertex" else 1))
    reader = UsdShade.Shader.Define(made, "/paint/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("tint")
    surface = UsdShade.Shader(made.GetPrimAtPath("/paint/surface"))
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(
        reader.ConnectableAPI(), "result"
    )
    bind(mesh, paint)
    world = load(made)
    assert not world.notices
    np.testing.assert_allclose(world.triangle_colors(), [(1, 0.5, 0.25)] * 2, atol=1e-6)


def test_degenerate_faces_are_omitted_with_a_notice(tmp_path: Path) -> None:
    """Faces with one or two vertices, and faces with a point that is not finite."""
    made = stage(tmp_path / "a.usda")
    points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (float("nan"), 0, 0)]
    mesh = square(made, points=points)
    mesh.GetFaceVertexCountsAttr().Set([4, 2, 1, 3])
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 3, 0, 1, 2, 0, 1, 4])
    world = load(made)
    assert has_notice(world.notices, "dropped_geometry", "3 of 4"), world.notices
    corners = np.asarray(world.triangles(0)).reshape(-1, 3, 3)
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(np.linalg.norm(sides, axis=1).sum() / 2, 2.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x1f\x8b\x08\0", fault("wrong_format", "a.usda")),
        (b"PK\x03\x04\0\0", fault("wrong_format", "ZIP")),
        (b"glTF\x02\0\0\0", fault("wrong_format", "GLB")),
        (b"<?xml version='1.0'?><Error/>", fault("wrong_format", "XML")),
        (b"/annex/objects/MD5E-s1--a.usd", fault("placeholder_file", "a.usda")),
        (b"404: Not Found", fault("placeholder_file", "a.usda")),
    ],
)
def test_files_that_are_not_usd_are_refused_with_their_kind(
    tmp_path: Path, content: bytes, words: Fault
) -> None:
    (tmp_path / "a.usda").write_bytes(content)
    with raises(raycam.FormatError, **words):
        raycam.load(tmp_path / "a.usda")
