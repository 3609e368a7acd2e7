"""Tetrahedra, cylinder and dome lights, cones, subdivision colours, reader fallbacks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Gf, Sdf, UsdGeom, UsdLux, UsdShade, Vt
from support.raises import has_notice, notice_codes
from support.usd_stages import bind, material, square, stage, write_image

CORNERS = [(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 4), (2, 3, 4)]


def load(made: Any) -> raycam.World:
    made.Save()
    return raycam.load(made.GetRootLayer().realPath)


@pytest.mark.parametrize("surface", ["computed", "stored"])
@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
def test_surface_of_a_tetrahedral_mesh_is_closed_and_faces_outwards(
    tmp_path: Path, surface: str, orientation: str
) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.TetMesh.Define(made, "/tets")
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, corner)) for corner in CORNERS])
    tets = [(0, 1, 2, 3), (1, 2, 3, 4)] if orientation == "rightHanded" else [(1, 0, 2, 3), (2, 1, 3, 4)]
    points = np.array(CORNERS, float)
    mesh.CreateTetVertexIndicesAttr([Gf.Vec4i(*tet) for tet in tets])
    mesh.CreateOrientationAttr(orientation)
    faces = UsdGeom.TetMesh.ComputeSurfaceFaces(mesh, 0)
    if surface == "stored":
        mesh.CreateSurfaceFaceVertexIndicesAttr(faces)
    world = load(made)
    assert not world.notices
    assert world.objects[0].triangles == len(faces) == 6
    volume = sum(abs(np.linalg.det(points[list(tet[1:])] - points[tet[0]])) / 6 for tet in tets)
    assert abs(np.linalg.det(world.triangles()).sum() / 6) == pytest.approx(volume)
    signs = [np.linalg.det(points[list(tet[1:])] - points[tet[0]]) for tet in tets]
    expected = np.sign(signs[0]) * (1 if orientation == "rightHanded" else -1)
    assert np.sign(np.linalg.det(world.triangles()).sum()) == expected


@pytest.mark.parametrize("normalize", [False, True])
def test_cylinder_light_emits_from_its_side(tmp_path: Path, normalize: bool) -> None:
    """The power of a surface of radiance L is pi L times its area.

    With `normalize`, L is divided by the area.
    """
    made = stage(tmp_path / "a.usda")
    light = UsdLux.CylinderLight.Define(made, "/tube")
    light.CreateLengthAttr(4.0)
    light.CreateRadiusAttr(0.25)
    light.CreateIntensityAttr(6.0)
    light.CreateNormalizeAttr(normalize)
    light.AddTranslateOp().Set((0, 0, 3))
    world = load(made)
    assert [thing.name for thing in world.objects] == ["tube"]
    triangles = world.triangles()
    crosses = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(crosses, axis=1).sum() / 2
    assert area == pytest.approx(2 * math.pi * 0.25 * 4, rel=1e-6)
    outwards = triangles.mean(axis=1) - [0, 0, 3]
    assert (np.einsum("ni,ni->n", crosses[:, 1:], outwards[:, 1:]) > 0).all()
    camera = raycam.Camera.look_at((0, -5, 3), (0, 0, 3), (0, 0, 1), size=(3, 3), fov=1)
    seen = raycam.render(world, camera, samples=4)["color"]
    np.testing.assert_allclose(seen, 6 / (2 * math.pi * 0.25 * 4 if normalize else 1), rtol=1e-4)


@pytest.mark.parametrize(
    ("angle", "is_notice"), [(120.0, True), (179.0, True), (90.0, False), (180.0, False)]
)
def test_cone_angles_above_90_degrees_give_a_notice(tmp_path: Path, angle: float, is_notice: bool) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    light = UsdLux.SphereLight.Define(made, "/light")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingConeAngleAttr(angle)
    world = load(made)
    assert [own["type"] for own in world.lights] == ["spot" if angle == 90 else "point"]
    assert has_notice(world.notices, "ignored_key", "/light", f"{angle:g}") == is_notice


POLES = {
    ("Y", "scene"): ((0, 0, 1), (0, 1, 0)),
    ("Y", "Y"): ((0, 0, 1), (0, 1, 0)),
    ("Z", "scene"): ((0, -1, 0), (0, 0, 1)),
    ("Z", "Z"): ((0, -1, 0), (0, 0, 1)),
}


@pytest.mark.parametrize(("up", "pole"), [*POLES, ("Y", "Z"), ("Z", "Y")])
def test_dome_light_pole_axis_is_applied(tmp_path: Path, up: str, pole: str) -> None:
    """The directions of the image's centre and top, as defined by the schema `DomeLight_1`."""
    pixels = np.zeros((16, 32, 3), np.uint8)
    pixels[7:9, 15:17] = (255, 0, 0)  # the middle of the image is red
    pixels[:3] = (0, 255, 0)  # the top of the image is green
    write_image(tmp_path / "sky.png", pixels)
    made = stage(tmp_path / "a.usda", up=up)
    square(made)
    light = UsdLux.DomeLight_1.Define(made, "/sky")
    light.CreateTextureFileAttr("sky.png")
    light.CreatePoleAxisAttr(pole)
    world = load(made)
    if (up, pole) not in POLES:
        assert has_notice(world.notices, "approximated_value", "/sky")
        return
    assert not world.notices
    middle, top = POLES[up, pole]
    for direction, channel in ((middle, 0), (top, 1)):
        start = np.array([50.0, 50.0, 50.0])
        side = (1, 0, 0)
        camera = raycam.Camera.look_at(start, start + direction, side, size=(1, 1), fov=1)
        color = raycam.render(world, camera, samples=4)["color"][0, 0]
        assert np.argmax(color) == channel
        assert color[channel] > 0.9


@pytest.mark.parametrize("interpolation", ["uniform", "faceVarying"])
def test_subdivision_surface_keeps_its_face_colors(tmp_path: Path, interpolation: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(made, "/roof")
    mesh.CreatePointsAttr([(-1, -1, 0), (0, -1, 1), (1, -1, 0), (-1, 1, 0), (0, 1, 1), (1, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 4, 3, 1, 2, 5, 4])
    colors = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation
    )
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    colors.Set(Vt.Vec3fArray([red, blue] if interpolation == "uniform" else [red] * 4 + [blue] * 4))
    world = load(made)
    camera = raycam.Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), size=(32, 32), fov=14)
    frame = raycam.render(world, camera, channels=["albedo", "shading_normal", "position"])
    x = frame["position"][..., 0]
    for chosen, color in ((x < -0.1, red), (x > 0.1, blue)):
        assert chosen.sum() > 50
        np.testing.assert_allclose(frame["albedo"][chosen], [color] * chosen.sum(), atol=1e-5)
    # The ridge stays smooth: its normal, the mean of the normals of both sides, points up.
    ridge = np.abs(x) < 0.08
    assert ridge.any()
    np.testing.assert_allclose(frame["shading_normal"][ridge][:, 2], 1, atol=0.02)


@pytest.mark.parametrize("fallback", [None, (0.25, 0.5, 0.75)])
@pytest.mark.parametrize("key", ["diffuseColor", "roughness"])
def test_primvar_reader_fallback_is_used(tmp_path: Path, key: str, fallback: Any) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint", roughness=1.0)
    reader = UsdShade.Shader.Define(made, "/paint/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float3" if key == "diffuseColor" else "UsdPrimvarReader_float")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("missing")
    if fallback is not None and key == "diffuseColor":
        reader.CreateInput("fallback", Sdf.ValueTypeNames.Float3).Set(fallback)
    elif fallback is not None:
        reader.CreateInput("fallback", Sdf.ValueTypeNames.Float).Set(0.25)
    surface = UsdShade.Shader(made.GetPrimAtPath("/paint/surface"))
    kind = Sdf.ValueTypeNames.Color3f if key == "diffuseColor" else Sdf.ValueTypeNames.Float
    surface.CreateInput(key, kind).ConnectToSource(reader.ConnectableAPI(), "result")
    bind(mesh, paint)
    world = load(made)
    if key == "diffuseColor":
        np.testing.assert_allclose(world.triangle_colors(), [fallback or (0, 0, 0)] * 2, atol=1e-6)
        assert notice_codes(world.notices) == ["ignored_key"] * (fallback is None)
    else:
        assert has_notice(world.notices, "ignored_feature", "roughness")


@pytest.mark.parametrize("content", [b"\x01\x02\x03\x04", b"\x89PNG\r\n\x1a\n", b""])
def test_dome_light_with_an_unreadable_image_is_omitted(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "sky.tex").write_bytes(content)
    made = stage(tmp_path / "a.usda")
    square(made)
    UsdLux.DomeLight.Define(made, "/sky").CreateTextureFileAttr("sky.tex")
    world = load(made)
    assert len(world.objects) == 1
    assert not world.lights
    assert has_notice(world.notices, "unreadable_file", "sky.tex")
