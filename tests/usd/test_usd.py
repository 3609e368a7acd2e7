"""USD files, written by OpenUSD and read by raycam."""

from __future__ import annotations

import json
import math
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdShade, UsdUtils, Vt
from raycam import usd
from support.raises import fault, has_notice, raises

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def stage(path: Path, up: str = "Z") -> Any:
    made = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(made, up)
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    return made


def square(made: Any, name: str = "/world/square", points: Any = SQUARE) -> Any:
    mesh = UsdGeom.Mesh.Define(made, name)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([len(points)])
    mesh.CreateFaceVertexIndicesAttr(list(range(len(points))))
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def png(path: Path, color: tuple[int, int, int]) -> None:
    """An image of one pixel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    data = zlib.compress(b"\0" + bytes(color))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )


def surface(made: Any, name: str = "/world/paint", **inputs: Any) -> Any:
    material = UsdShade.Material.Define(made, name)
    shader = UsdShade.Shader.Define(made, f"{name}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for key, value in inputs.items():
        kind = Sdf.ValueTypeNames.Color3f if isinstance(value, tuple) else Sdf.ValueTypeNames.Float
        shader.CreateInput(key, kind).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material


def bind(mesh: Any, material: Any) -> None:
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def texture(made: Any, material: Any, file: str) -> None:
    name = material.GetPath().pathString
    image = UsdShade.Shader.Define(made, f"{name}/image")
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    reader = UsdShade.Shader.Define(made, f"{name}/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("map1")
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    shader = UsdShade.Shader(made.GetPrimAtPath(f"{name}/surface"))
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(
        image.ConnectableAPI(), "rgb"
    )


def uvs(mesh: Any) -> None:
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "map1", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray([(0, 0), (1, 0), (1, 1), (0, 1)]))


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_mesh_positions_equal_those_of_openusd(tmp_path: Path, suffix: str) -> None:
    made = stage(tmp_path / f"a{suffix}", "Y")
    arrow = [(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)]
    mesh = square(made, points=arrow)
    UsdGeom.Xformable(made.GetPrimAtPath("/world") or UsdGeom.Xform.Define(made, "/world"))
    parent = UsdGeom.Xform.Define(made, "/world")
    parent.AddTranslateOp().Set((1, 2, 3))
    parent.AddRotateXYZOp().Set((10, 20, 30))
    mesh.AddScaleOp().Set((1, 2, -0.5))
    made.Save()
    world = raycam.load(tmp_path / f"a{suffix}")
    assert world.up == "y"
    assert [thing.name for thing in world.objects] == ["square"]
    to_world = UsdGeom.XformCache().GetLocalToWorldTransform(mesh.GetPrim())
    expected = np.array([to_world.Transform(Gf.Vec3d(*point)) for point in arrow])
    triangles = world.triangles()
    assert len(triangles) == 2
    found = np.unique(np.round(triangles.reshape(-1, 3), 9), axis=0)
    np.testing.assert_allclose(found, np.unique(np.round(expected, 9), axis=0), atol=1e-9)
    # The arrow's area is 2.5 minus its notch: concave polygons keep their shape.
    edges = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2
    closed = np.vstack([expected, expected[:1]])
    assert area == pytest.approx(np.linalg.norm(np.cross(closed[:-1], closed[1:]).sum(0)) / 2)


def test_material_colors_and_images_are_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    red = surface(
        made, "/world/red", diffuseColor=(0.5, 0.1, 0.2), metallic=0.25, roughness=0.75, opacity=0.5
    )
    bind(square(made, "/world/one"), red)
    painted = square(made, "/world/two")
    painted.AddTranslateOp().Set((0, 0, 1))
    uvs(painted)
    image = surface(made, "/world/image")
    texture(made, image, "pictures/green.png")
    bind(painted, image)
    (tmp_path / "pictures").mkdir()
    png(tmp_path / "pictures" / "green.png", (0, 255, 0))
    plain = square(made, "/world/three")
    plain.CreateDisplayColorAttr([(0.25, 0.5, 0.75)])
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    colors = world.triangle_colors()
    np.testing.assert_allclose(colors[0], [0.5, 0.1, 0.2], atol=1e-6)
    np.testing.assert_allclose(colors[-1], [0.25, 0.5, 0.75], atol=1e-6)
    assert len(world.textures) == 1
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(16, 16), fov=10)
    lit = raycam.render(world, camera, channels=["albedo"])["albedo"]
    np.testing.assert_allclose(lit[8, 8], [0, 1, 0], atol=1e-6)


def test_usdz_package_with_images_is_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    uvs(mesh)
    paint = surface(made)
    texture(made, paint, "./blue.png")
    bind(mesh, paint)
    png(tmp_path / "blue.png", (0, 0, 255))
    made.Save()
    package = tmp_path / "apart" / "a.usdz"
    package.parent.mkdir()
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usda"), str(package))
    world = raycam.load(package)
    assert not world.notices
    np.testing.assert_allclose(world.triangle_colors(), [[0, 0, 1]] * 2)


def test_subset_materials_orientation_and_holes_are_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(made, "/world/cells")
    mesh.CreatePointsAttr([(x, y, 0) for y in range(2) for x in range(4)])
    mesh.CreateFaceVertexCountsAttr([4, 4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6])
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateOrientationAttr("leftHanded")
    mesh.CreateHoleIndicesAttr([2])
    bind(mesh, surface(made, "/world/red", diffuseColor=(1.0, 0.0, 0.0)))
    part = UsdShade.MaterialBindingAPI(mesh).CreateMaterialBindSubset("part", Vt.IntArray([1]))
    UsdShade.MaterialBindingAPI.Apply(part.GetPrim()).Bind(
        surface(made, "/world/blue", diffuseColor=(0.0, 0.0, 1.0))
    )
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    triangles = world.triangles()
    assert len(triangles) == 4
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert (normals[:, 2] < 0).all()
    blue = triangles[world.triangle_colors()[:, 2] > 0.5]
    assert (blue[..., 0].min(), blue[..., 0].max()) == (1, 2)


def test_instances_share_their_mesh(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made, "/models/tile/shape")
    made.GetPrimAtPath("/models").SetSpecifier(Sdf.SpecifierClass)
    for i in range(5):
        place = UsdGeom.Xform.Define(made, f"/world/tile{i}")
        place.AddTranslateOp().Set((3 * i, 0, 0))
        place.GetPrim().GetReferences().AddInternalReference("/models/tile")
        place.GetPrim().SetInstanceable(True)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert len(world.objects) == 5
    assert world.counts["meshes"] == 1
    assert sorted(set(world.triangles()[..., 0].reshape(-1).tolist())) == [
        3 * i + side for i in range(5) for side in (-1, 1)
    ]


def test_equal_prims_share_their_mesh(tmp_path: Path) -> None:
    # the scene simpleAssetScene of usd-wg/assets contains 539 spheres, and no sphere is an instance
    made = stage(tmp_path / "a.usda")
    for i, radius in enumerate([1.0, 1.0, 2.0, 1.0]):
        ball = UsdGeom.Sphere.Define(made, f"/world/ball{i}")
        ball.CreateRadiusAttr(radius)
        ball.AddTranslateOp().Set((5 * i, 0, 0))
        if i == 3:
            ball.CreateDisplayColorAttr([(1, 0, 0)])
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert world.counts["meshes"] == 2
    assert [item.matrix[0, 3] for item in world.objects] == [0, 5, 10, 15]
    assert [item.mesh for item in world.objects] == [0, 0, 1, 0]


def test_instanced_prototypes_have_the_transforms_of_openusd(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    UsdGeom.Xform.Define(made, "/world").AddRotateXYZOp().Set((10, 20, 30))
    source = UsdGeom.PointInstancer.Define(made, "/world/many")
    source.AddScaleOp().Set((2, 2, 2))
    shape = square(made, "/world/many/tile/shape")
    shape.AddRotateXOp().Set(45)
    UsdGeom.Xform(made.GetPrimAtPath("/world/many/tile")).AddTranslateOp().Set((0, 1, 0))
    square(made, "/world/many/other")
    source.CreatePrototypesRel().SetTargets(["/world/many/tile", "/world/many/other"])
    source.CreateProtoIndicesAttr([0, 1, 0, 0])
    source.CreatePositionsAttr([(0, 0, 0), (5, 0, 0), (1, 2, 3), (9, 9, 9)])
    source.CreateScalesAttr([(1, 1, 1), (1, 2, 3), (1, 1, -1), (1, 1, 1)])
    source.CreateInvisibleIdsAttr([3])
    made.Save()
    now = Usd.TimeCode.Default()
    copies = source.ComputeInstanceTransformsAtTime(now, now, source.IncludeProtoXform, source.IgnoreMask)
    world_from = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(source.GetPrim()))
    turn = np.array(shape.GetLocalTransformation())
    world = raycam.load(tmp_path / "a.usda")
    assert (world.counts["objects"], world.counts["meshes"]) == (3, 1)  # equal prototypes share a mesh
    corners = np.hstack([np.array(shape.GetPointsAttr().Get()), np.ones((4, 1))])
    shown = world.triangles().reshape(3, -1, 3)
    for copy, own, found in zip(np.array(copies)[:3], (turn, np.eye(4), turn), shown, strict=True):
        expected = (corners @ own @ copy @ world_from)[:, :3]
        near = np.linalg.norm(found[:, None] - expected, axis=2)
        assert near.min(axis=0).max() < 1e-4
        assert near.min(axis=1).max() < 1e-4


@pytest.mark.parametrize("interpolation", ["constant", "uniform", "vertex", "faceVarying"])
def test_display_colors_with_any_interpolation_are_read(tmp_path: Path, interpolation: str) -> None:
    made = stage(tmp_path / "a.usda")
    root = UsdGeom.Xform.Define(made, "/world/above")
    mesh = square(made, "/world/above/mesh")
    mesh.GetFaceVertexCountsAttr().Set([3, 3])
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2, 0, 2, 3])
    red, blue = (1.0, 0.25, 0.0), (0.0, 0.5, 1.0)
    held = UsdGeom.PrimvarsAPI(root if interpolation == "constant" else mesh)
    colors = held.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation)
    colors.Set([red, blue] if interpolation != "constant" else [red])
    if interpolation in ("vertex", "faceVarying"):
        colors.SetIndices([0, 0, 0, 1] if interpolation == "vertex" else [0, 0, 0, 1, 1, 1])
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert not world.notices
    last = {"constant": red, "vertex": (2 * np.array(red) + blue) / 3}.get(interpolation, blue)
    np.testing.assert_allclose(world.triangle_colors(), [red, last], atol=1e-6)


def test_display_opacity_is_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made).CreateDisplayOpacityAttr([0.25])
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    world.add_light(type="sky", radiance=[1, 1, 1])
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(2, 2), fov=1)
    alpha = raycam.render(world, camera, integrator="path", samples=256, max_depth=1)["color"]
    assert alpha == pytest.approx(0.75, abs=0.05)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_camera_frustum_equals_that_of_openusd(projection: str, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    source = UsdGeom.Camera.Define(made, "/world/eye")
    source.CreateHorizontalApertureAttr(36.0)
    source.CreateVerticalApertureAttr(24.0)
    source.CreateHorizontalApertureOffsetAttr(2.0)
    source.CreateVerticalApertureOffsetAttr(-1.5)
    source.CreateFocalLengthAttr(40.0)
    source.CreateProjectionAttr(projection)
    source.AddTranslateOp().Set((3, -4, 5))
    source.AddRotateXYZOp().Set((40, 15, 70))
    made.Save()
    camera = raycam.load(tmp_path / "a.usda").camera("eye")
    assert camera.size == (960, 640)
    assert camera.is_parallel == (projection == "orthographic")
    frustum = source.GetCamera(Usd.TimeCode.Default()).frustum
    to_film = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
    points = np.random.default_rng(1).uniform(-2, 2, (50, 3))
    film = np.array([to_film.Transform(Gf.Vec3d(*point)) for point in points.tolist()])[:, :2]
    expected = (film * [1, -1] + 1) / 2 * camera.size
    pixels, _ = camera.project(points)
    np.testing.assert_allclose(pixels, expected, atol=1e-3)


def test_lights_have_the_radiometric_values_of_usdlux(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    sun = UsdLux.DistantLight.Define(made, "/lights/sun")
    sun.CreateIntensityAttr(2.0)
    sun.CreateNormalizeAttr(True)
    bulb = UsdLux.SphereLight.Define(made, "/lights/bulb")
    bulb.CreateRadiusAttr(0.25)
    bulb.CreateIntensityAttr(3.0)
    bulb.CreateExposureAttr(1.0)
    bulb.AddTranslateOp().Set((0, 0, 2))
    panel = UsdLux.RectLight.Define(made, "/lights/panel")
    panel.CreateWidthAttr(2.0)
    panel.CreateHeightAttr(4.0)
    disk = UsdLux.DiskLight.Define(made, "/lights/disk")
    disk.CreateNormalizeAttr(True)
    UsdLux.DomeLight.Define(made, "/lights/sky").CreateIntensityAttr(0.5)
    UsdLux.DistantLight.Define(made, "/lights/dark").CreateIntensityAttr(0.0)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    lights = {light["type"]: light for light in world.lights}
    assert set(lights) == {"sun", "point", "area", "disk", "sky"}
    np.testing.assert_allclose(lights["sun"]["irradiance"], [2, 2, 2])
    np.testing.assert_allclose(lights["sun"]["direction"], [0, 0, -1], atol=1e-12)
    # The power is pi times the radiance 6 times the area 4 pi r^2.
    np.testing.assert_allclose(lights["point"]["power"], 6 * math.pi * 4 * math.pi * 0.25**2, rtol=1e-6)
    np.testing.assert_allclose(np.cross(lights["area"]["u"], lights["area"]["v"]), [0, 0, -8])
    np.testing.assert_allclose(lights["disk"]["radiance"], 1 / (math.pi * 0.25), rtol=1e-6)
    np.testing.assert_allclose(lights["sky"]["radiance"], [0.5] * 3)
    assert has_notice(world.notices, "ignored_element", "/lights/dark")


def test_sphere_light_with_radius_zero_keeps_its_power(tmp_path: Path) -> None:
    """Blender writes a point light of 100 W as a sphere light of radius 0.

    In UsdLux, normalised power does not depend on the radius.
    """
    made = stage(tmp_path / "a.usda")
    square(made)
    for name, radius in {"bulb": 0.0, "ball": 0.5}.items():
        light = UsdLux.SphereLight.Define(made, f"/lights/{name}")
        light.CreateIntensityAttr(100 / math.pi)
        light.CreateNormalizeAttr(True)
        light.CreateRadiusAttr(radius)
        light.CreateTreatAsPointAttr(name == "ball")
    made.Save()
    lights = raycam.load(tmp_path / "a.usda").lights
    # This attribute is a hint for other programs, which raycam does not read.
    assert [light["radius"] for light in lights] == [0.0, 0.0]
    np.testing.assert_allclose([light["power"] for light in lights], np.full((2, 3), 100.0), rtol=1e-6)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_lights_with_invalid_sizes_are_omitted(tmp_path: Path, value: float) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    UsdLux.DomeLight.Define(made, "/lights/sky")
    UsdLux.SphereLight.Define(made, "/lights/bulb").CreateRadiusAttr(value)
    UsdLux.RectLight.Define(made, "/lights/panel").CreateHeightAttr(value)
    UsdLux.DiskLight.Define(made, "/lights/disk").CreateRadiusAttr(value)
    UsdLux.DistantLight.Define(made, "/lights/sun").CreateAngleAttr(value or 181.0)
    for prim in made.GetPrimAtPath("/lights").GetChildren():
        if prim.GetTypeName() != "DomeLight":
            UsdLux.LightAPI(prim).CreateNormalizeAttr(prim.GetTypeName() != "SphereLight")
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert [light["type"] for light in world.lights] == ["sky"]
    for name, key in {"bulb": "radius", "panel": "height", "disk": "radius", "sun": "angle"}.items():
        assert has_notice(world.notices, "ignored_element", f"/lights/{name}:", f" {key} "), name


def test_unsupported_prims_give_notices(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made).CreateSubdivisionSchemeAttr("catmullClark")
    UsdGeom.Points.Define(made, "/world/dust")
    UsdGeom.SetStageMetersPerUnit(made, 0.01)
    hidden = square(made, "/world/hidden")
    hidden.MakeInvisible()
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert len(world.objects) == 1
    assert has_notice(world.notices, "ignored_element", "Points"), world.notices
    assert has_notice(world.notices, "approximated_value", "/world/square"), world.notices
    assert has_notice(world.notices, "assumed_convention", "0.01 m"), world.notices
    # If no object is left, the error contains the cause.
    other = stage(tmp_path / "b.usda")
    UsdGeom.Points.Define(other, "/dust")
    other.Save()
    with raises(raycam.FormatError, code="nothing_visible", mentions=["b.usda"]):
        raycam.load(tmp_path / "b.usda")


def test_meters_per_unit_in_single_precision_is_read(tmp_path: Path) -> None:
    """Blender 2.8 wrote the unit this way."""
    path = tmp_path / "a.usdc"
    made = stage(path)
    square(made)
    UsdGeom.SetStageMetersPerUnit(made, 0.5)
    made.Save()
    # Change the stored value to float32: the type code that follows it is 9 for double and 8 for float.
    half, data = struct.pack("<f", 0.5) + b"\0\0", path.read_bytes()
    assert data.count(half + b"\x09\x40") == 1
    path = tmp_path / "b.usdc"
    path.write_bytes(data.replace(half + b"\x09\x40", half + b"\x08\x40"))
    with pytest.raises(Tf.ErrorException):
        UsdGeom.GetStageMetersPerUnit(Usd.Stage.Open(str(path)))
    world = raycam.load(path)
    assert has_notice(world.notices, "assumed_convention", "0.5 m")


@pytest.mark.parametrize("left", [None, 30], ids=["no image", "cut off"])
def test_notices_name_images_as_in_the_file(tmp_path: Path, left: int | None) -> None:
    made = stage(tmp_path / "a.usda")
    painted, paint = square(made), surface(made)
    uvs(painted)
    texture(made, paint, "./wood.png")
    bind(painted, paint)
    made.Save()
    image = tmp_path / "wood.png"
    if left is None:
        image.write_text("no image")
    else:
        png(image, (0, 255, 0))
        image.write_bytes(image.read_bytes()[:left])
    said = str(raycam.load(tmp_path / "a.usda").notices[0])
    assert said.startswith(f"{tmp_path / 'a.usda'}: ")
    assert "./wood.png: " in said
    assert "raycam-usd" not in said


def test_separate_opacity_image_is_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    painted, paint = square(made), surface(made)
    uvs(painted)
    texture(made, paint, "green.png")
    mask = UsdShade.Shader.Define(made, "/world/paint/mask")
    mask.CreateIdAttr("UsdUVTexture")
    mask.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("mask.png")
    reader = UsdShade.Shader(made.GetPrimAtPath("/world/paint/reader"))
    mask.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    shader = UsdShade.Shader(made.GetPrimAtPath("/world/paint/surface"))
    opacity = shader.CreateInput("opacity", Sdf.ValueTypeNames.Float)
    opacity.ConnectToSource(mask.ConnectableAPI(), "r")
    bind(painted, paint)
    made.Save()
    png(tmp_path / "green.png", (0, 255, 0))
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(16, 16), fov=10)
    seen = {}
    for grey in (0, 255):
        png(tmp_path / "mask.png", (grey, grey, grey))
        frame = raycam.render(raycam.load(tmp_path / "a.usda"), camera, samples=1)
        seen[grey] = frame["color"][8, 8]
    assert seen[255][0] < 0.1 < seen[0][0], "green, and the grey behind it"


def test_damaged_stages_raise(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text('#usda 1.0\ndef Mesh "a" { }\ndef Mesh "b" { int }\n')
    with raises(raycam.FormatError, code="syntax", mentions=["a.usda", "a.usda:3"]):
        raycam.load(path)
    for text, code in (
        (b"", "empty_file"),
        (b"#usda 1.0\n(", "syntax"),
        (b"#usda 1.0\n", "nothing_visible"),
        (b"\x00" * 100, "syntax"),
    ):
        path.write_bytes(text)
        with raises(raycam.FormatError, code=code, mentions=["a.usda"]):
            raycam.load(path)
    with pytest.raises(FileNotFoundError):
        raycam.load(tmp_path / "none.usdc")
    made = stage(tmp_path / "b.usdc")
    square(made)
    made.Save()
    whole = (tmp_path / "b.usdc").read_bytes()
    (tmp_path / "b.usdc").write_bytes(whole[: len(whole) // 2])
    with raises(raycam.FormatError, code="syntax", mentions=["b.usdc"]):
        raycam.load(tmp_path / "b.usdc")


def test_files_outside_of_the_folder_are_not_read(tmp_path: Path) -> None:
    made = stage(tmp_path / "outside.usda")
    square(made, "/shape")
    made.Save()
    inside = tmp_path / "inside"
    inside.mkdir()
    for asset in ("../outside.usda", str(tmp_path / "outside.usda"), "http://example.org/a.usda"):
        other = stage(inside / "a.usda")
        other.OverridePrim("/world").GetReferences().AddReference(asset, "/shape")
        other.Save()
        with raises(raycam.FormatError, code="nothing_visible", mentions=["a.usda"]):
            raycam.load(inside / "a.usda")
        (inside / "a.usda").unlink()
        del other


def test_memory_budget_is_enforced(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    made.Save()
    for budget, reason in (
        (usd.UsdLimits(bytes=100), fault("budget_exceeded", "100")),
        (usd.UsdLimits(seconds=0.0), fault("budget_exceeded", "a.usda")),
        (usd.UsdLimits(corners=3), fault("budget_exceeded", "a.usda")),
    ):
        with raises(raycam.FormatError, **reason):
            usd.read(tmp_path / "a.usda", tmp_path, budget)


def test_missing_usd_package_is_reported_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with raises(raycam.Error, code="missing_dependency", mentions=["'raycam[usd]'"]):
        raycam.load(tmp_path / "a.usda")


def test_worker_exits_without_unloading_the_library(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    limits = {"memory": 1 << 33, "bytes": 1 << 20, "seconds": 60, "corners": 9, "folder": str(tmp_path)}
    limits |= {"time": None, "single": False, "up": None}
    program = (
        "import atexit, runpy, sys; atexit.register(print, 'taken down'); "
        "runpy.run_module('raycam.usd.worker', run_name='__main__', alter_sys=True)"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "a.usda"), str(tmp_path), json.dumps(limits)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "taken down" not in done.stdout
    assert (tmp_path / "world.json").is_file()
