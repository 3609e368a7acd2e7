"""Skeletons, blend shapes and time of USD, compared with OpenUSD's baked skinning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt
from support.raises import has_notice, raises
from support.usd_stages import stage


def strip(made: Any, name: str, quads: int = 6) -> Any:
    """A strip of quads along y."""
    mesh = UsdGeom.Mesh.Define(made, name)
    mesh.CreatePointsAttr([(x, y * 0.5, 0) for y in range(quads + 1) for x in (0, 1)])
    mesh.CreateFaceVertexCountsAttr([4] * quads)
    mesh.CreateFaceVertexIndicesAttr(
        [corner for q in range(quads) for corner in (2 * q, 2 * q + 1, 2 * q + 3, 2 * q + 2)]
    )
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def arm(path: Path, case: str) -> Any:
    """A strip with two rotating joints; `case` adds an unusual feature."""
    made = stage(path)
    made.SetStartTimeCode(1)
    made.SetEndTimeCode(25)
    made.SetTimeCodesPerSecond(24)
    root = UsdSkel.Root.Define(made, "/root")
    root.AddTranslateOp().Set((3, 1, 0))
    root.AddRotateZOp().Set(30)
    skeleton = UsdSkel.Skeleton.Define(made, "/root/skeleton")
    skeleton.AddScaleOp().Set((1, 2, 1))
    joints = ["low", "low/high"]
    low, high = Gf.Matrix4d(1), Gf.Matrix4d().SetTranslate((0, 1.5, 0))
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateBindTransformsAttr([low, high])
    skeleton.CreateRestTransformsAttr([low, high])
    animation = UsdSkel.Animation.Define(made, "/root/animation")
    animation.CreateJointsAttr(joints)
    for time, angle in ((1, 20), (13, 60), (25, -45)):
        turn = Gf.Quatf(Gf.Rotation((0.2, 0, 1), angle).GetQuat())
        animation.CreateRotationsAttr().Set([Gf.Quatf(1), turn], time)
    animation.CreateTranslationsAttr([(0, 0.25, 0), (0, 1.5, 0)])
    animation.CreateScalesAttr([(1, 1, 1), (1, 1.25, 1)])
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    mesh = strip(made, "/root/strip")
    mesh.AddTranslateOp().Set((0, 0, 0.5))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d().SetTranslate((0, 0, 0.5)))
    count = len(mesh.GetPointsAttr().Get())
    if case == "rigid":
        binding.CreateJointIndicesPrimvar(True, 1).Set([1])
        binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    elif case != "shapes":
        heights = np.array(mesh.GetPointsAttr().Get())[:, 1] / 3
        binding.CreateJointIndicesPrimvar(False, 2).Set(Vt.IntArray([0, 1] * count))
        weights = np.column_stack([1 - heights, heights]).ravel()
        binding.CreateJointWeightsPrimvar(False, 2).Set(Vt.FloatArray(weights.tolist()))
    if case == "own joints":
        binding.CreateJointsAttr(["low/high", "low"])
    if case == "dual quaternions":
        binding.CreateSkinningMethodAttr("dualQuaternion")
    if case in ("shapes", "shapes and joints"):
        shape = UsdSkel.BlendShape.Define(made, "/root/strip/bulge")
        shape.CreateOffsetsAttr([(0, 0, 1), (0.5, 0, 2)])
        shape.CreatePointIndicesAttr([3, 6])
        binding.CreateBlendShapesAttr(["bulge"])
        binding.CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
        animation.CreateBlendShapesAttr(["bulge"])
        animation.CreateBlendShapeWeightsAttr().Set([0.25], 1)
        animation.CreateBlendShapeWeightsAttr().Set([0.75], 13)
    if case == "mirrored":
        root.AddScaleOp().Set((-1, 1, 1))
    return made


def odd_arm(path: Path, case: str) -> Any:
    """The strip of `arm` with rarely used features."""
    made = arm(path, "shapes and joints" if case == "shapes between" else case)
    if case == "shapes between":
        between = UsdSkel.BlendShape(made.GetPrimAtPath("/root/strip/bulge")).CreateInbetween("half")
        between.SetWeight(0.5)
        between.SetOffsets([(1, 0, 0), (0, 1, 0)])
    if case == "one animated joint":
        made.RemovePrim("/root/animation")
        animation = UsdSkel.Animation.Define(made, "/root/animation")
        animation.CreateJointsAttr(["low/high"])
        for time, angle in ((1, 70), (13, 10)):
            turn = Gf.Quatf(Gf.Rotation((1, 1, 0), angle).GetQuat())
            animation.CreateRotationsAttr().Set([turn], time)
        animation.CreateTranslationsAttr([(0, 1.4, 0)])
        animation.CreateScalesAttr([(2, 1, 1)])
    if case == "bound above, sheared":
        UsdSkel.BindingAPI.Apply(made.GetPrimAtPath("/root")).CreateSkeletonRel().SetTargets(
            ["/root/skeleton"]
        )
        UsdGeom.Xform.Define(made, "/root/group").AddScaleOp().Set((1, 1, 2))
        mesh = strip(made, "/root/group/strip")
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        shear = Gf.Matrix4d(1, 0.3, 0, 0, 0, 1, 0, 0, 0.2, 0, 1, 0, 0.1, 0.2, 0.3, 1)
        binding.CreateGeomBindTransformAttr(shear)
        count = len(mesh.GetPointsAttr().Get())
        binding.CreateJointIndicesPrimvar(False, 3).Set(Vt.IntArray([0, 1, 1] * count))
        binding.CreateJointWeightsPrimvar(False, 3).Set(Vt.FloatArray([0.2, 0.5, 0.9] * count))
    return made


CASES = ["joints", "own joints", "rigid", "dual quaternions", "shapes", "shapes and joints", "mirrored"]
ODD_CASES = ["shapes between", "one animated joint", "bound above, sheared"]


def baked(path: Path, time: float) -> npt.NDArray[np.float64]:
    """The points of all meshes in world coordinates, as baked by OpenUSD."""
    opened = Usd.Stage.Open(str(path))
    for prim in opened.Traverse():
        if prim.IsA(UsdSkel.Root):
            assert UsdSkel.BakeSkinning(UsdSkel.Root(prim), Gf.Interval(time, time))
    places = UsdGeom.XformCache(time)
    found = []
    for prim in opened.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            matrix = places.GetLocalToWorldTransform(prim)
            points = UsdGeom.Mesh(prim).GetPointsAttr().Get(time)
            found.append(np.array([matrix.Transform(Gf.Vec3d(point)) for point in points]))
    return np.concatenate(found)


def same_points(world: raycam.World, expected: npt.NDArray[np.float64]) -> None:
    shown = world.triangles().reshape(-1, 3)
    distances = np.linalg.norm(shown[:, None] - expected, axis=2)
    assert distances.min(axis=0).max() < 1e-5
    assert distances.min(axis=1).max() < 1e-5


@pytest.mark.parametrize("case", CASES + ODD_CASES)
def test_skinned_meshes_equal_openusds_baked_skinning(tmp_path: Path, case: str) -> None:
    path = tmp_path / "a.usdc"
    (odd_arm if case in ODD_CASES else arm)(path, case).Save()
    world = raycam.load(path)
    same_points(world, baked(path, 1.0))
    (notice,) = world.notices
    assert has_notice([notice], "first_only", "time=SECONDS", "0.0416667", "1.04167 s")
    later = raycam.load(path, time=13 / 24)
    assert not later.notices
    same_points(later, baked(path, 13.0))
    assert np.abs(later.triangles() - world.triangles()).max() > 0.1


def test_instances_of_a_skinned_model_have_equal_shapes(tmp_path: Path) -> None:
    arm(tmp_path / "arm.usda", "joints").Save()
    made = stage(tmp_path / "a.usda")
    for number in range(2):
        place = made.DefinePrim(f"/copy{number}")
        place.GetReferences().AddReference("./arm.usda", "/root")
        place.SetInstanceable(True)
        UsdGeom.Xformable(place).AddTranslateOp(opSuffix="apart").Set((10 * number, 0, 0))
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    first, second = world.triangles(0), world.triangles(1)
    assert np.linalg.norm(second[0, 0] - first[0, 0]) == pytest.approx(10, abs=1e-5)
    np.testing.assert_allclose(
        second - first, np.broadcast_to(second[0, 0] - first[0, 0], first.shape), atol=1e-5
    )
    alone = raycam.load(tmp_path / "arm.usda")
    sides = [
        np.linalg.norm(found - np.roll(found, 1, axis=1), axis=2) for found in (first, alone.triangles())
    ]
    np.testing.assert_allclose(sides[0], sides[1], atol=1e-5)
    assert len(raycam.load(tmp_path / "a.usda", time=0.5).objects) == 2


def test_skinned_normals_rotate_with_the_joints(tmp_path: Path) -> None:
    """After a rigid rotation, the normals equal the face normals."""
    made = arm(tmp_path / "a.usda", "rigid")
    mesh = UsdGeom.Mesh(made.GetPrimAtPath("/root/strip"))
    mesh.CreateNormalsAttr([(0, 0, 1)] * 14)
    mesh.SetNormalsInterpolation("vertex")
    made.Save()
    world = raycam.load(tmp_path / "a.usda", time=0.5)
    middle = world.triangles().reshape(-1, 3).mean(axis=0)
    camera = raycam.Camera.look_at(middle + np.array([0, 0, 9]), middle, (0, 1, 0), size=(16, 16), fov=30)
    frame = raycam.render(world, camera, channels=["normal", "shading_normal", "instance"])
    seen = frame["instance"] >= 0
    assert seen.sum() > 10
    np.testing.assert_allclose(frame["shading_normal"][seen], frame["normal"][seen], atol=1e-4)


def test_weights_of_wrong_size_give_a_notice(tmp_path: Path) -> None:
    made = arm(tmp_path / "a.usda", "joints")
    binding = UsdSkel.BindingAPI(made.GetPrimAtPath("/root/strip"))
    binding.GetJointWeightsPrimvar().Set(Vt.FloatArray([1.0, 0.0]))
    binding.GetJointIndicesPrimvar().Set(Vt.IntArray([0, 1]))
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert len(world.objects) == 1
    assert has_notice(world.notices, "ignored_feature", "/root/strip:", "skeleton")


@pytest.mark.parametrize("time", [None, 0.0, 0.25, 2.0])
def test_time_argument_evaluates_transforms_and_points(tmp_path: Path, time: float | None) -> None:
    made = stage(tmp_path / "a.usda")
    made.SetTimeCodesPerSecond(30)
    mesh = strip(made, "/world/strip")
    points = np.array(mesh.GetPointsAttr().Get())
    for end, factor in ((0, 1.0), (60, 3.0)):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy((points * factor).astype(np.float32)), end)
    move = UsdGeom.Xformable(made.GetPrimAtPath("/world")) or UsdGeom.Xform.Define(made, "/world")
    UsdGeom.Xform.Define(made, "/world")
    operation = UsdGeom.Xformable(made.GetPrimAtPath("/world")).AddTranslateOp()
    operation.Set((100, 0, 0))
    operation.Set((0, 0, 0), 0)
    operation.Set((6, 0, 0), 60)
    assert move is not None
    camera = UsdGeom.Camera.Define(made, "/world/eye")
    camera.CreateFocalLengthAttr().Set(20.0, 0)
    camera.GetFocalLengthAttr().Set(40.0, 60)
    made.Save()
    world = raycam.load(tmp_path / "a.usda", time=time)
    code = 30 * (time or 0.0)
    matrix = UsdGeom.XformCache(code).GetLocalToWorldTransform(mesh.GetPrim())
    expected = np.array([matrix.Transform(Gf.Vec3d(point)) for point in mesh.GetPointsAttr().Get(code)])
    same_points(world, expected)
    focal = camera.GetFocalLengthAttr().Get(code)
    aperture = camera.GetHorizontalApertureAttr().Get()
    assert world.camera("eye").K[0][0] == pytest.approx(960 * focal / aperture)
    assert has_notice(world.notices, "first_only", "time=SECONDS") == (time is None)


def test_time_argument_is_refused_if_it_is_nan_or_the_file_is_not_usd(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    UsdGeom.Cube.Define(made, "/cube")
    made.Save()
    with raises(raycam.SettingsError, code="wrong_type", mentions=["nan"]):
        raycam.load(tmp_path / "a.usda", time=float("nan"))
    (tmp_path / "a.glb").write_bytes(b"glTF")
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["world.at"]):
        raycam.load(tmp_path / "a.glb", time=1.0)
    assert Sdf.Layer.FindOrOpen(str(tmp_path / "a.usda"))
