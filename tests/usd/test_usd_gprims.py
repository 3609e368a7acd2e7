"""Solid primitives of USD, compared with OpenUSD and closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Usd, UsdGeom


def stage(path: Path) -> Any:
    made = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(made, "Z")
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    return made


def cap_volume(radius: float, depth: float) -> float:
    """The volume of a spherical cap of this height."""
    return math.pi * depth**2 * (3 * radius - depth) / 3


FRUSTUM = math.pi * 2 * (1 + 0.5 + 0.25) / 3
STRETCH = math.hypot(1, 0.25)
CAPSULE_VOLUME = cap_volume(STRETCH, STRETCH + 0.25) + FRUSTUM + cap_volume(STRETCH / 2, STRETCH / 2 - 0.125)

SOLIDS: dict[str, tuple[dict[str, Any], float, list[float]]] = {
    "Cube": ({"size": 3.0}, 27.0, [3, 3, 3]),
    "Sphere": ({"radius": 1.5}, 4 / 3 * math.pi * 1.5**3, [3, 3, 3]),
    "Cylinder": ({"radius": 0.5, "height": 3.0, "axis": "X"}, math.pi * 0.5**2 * 3, [3, 1, 1]),
    "Cylinder_1": ({"radiusBottom": 0.5, "radiusTop": 1.0, "height": 3.0}, 1.75 * math.pi, [2, 2, 3]),
    "Cone": ({"radius": 0.5, "height": 3.0, "axis": "Y"}, math.pi * 0.5**2, [1, 3, 1]),
    "Capsule": (
        {"radius": 0.5, "height": 2.0, "axis": "Y"},
        math.pi * 0.5**2 * (2 + 4 / 3 * 0.5),
        [1, 3, 1],
    ),
    # A frustum, and the caps of two spheres that touch its side at the rims.
    "Capsule_1": (
        {"radiusBottom": 1.0, "radiusTop": 0.5, "height": 2.0},
        CAPSULE_VOLUME,
        [2 * STRETCH, 2 * STRETCH, 2 + 0.25 - 0.125 + 1.5 * STRETCH],
    ),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_solid_primitives_are_closed_with_exact_bounds_and_volume(tmp_path: Path, kind: str) -> None:
    """The meshes are closed and face outwards, and their volumes equal closed forms.

    Their bounds equal those of OpenUSD.
    """
    values, volume, size = SOLIDS[kind]
    made = stage(tmp_path / "a.usda")
    prim = made.DefinePrim("/solid", kind)
    for name, value in values.items():
        prim.GetAttribute(name).Set(value)
    UsdGeom.Gprim(prim).CreateDisplayColorAttr([(1, 0, 0)])
    UsdGeom.XformCommonAPI(prim).SetTranslate((4, 5, 6))
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert not world.notices
    triangles = world.triangles() - [4, 5, 6]
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    np.testing.assert_allclose(np.linalg.det(triangles).sum() / 6, volume, rtol=5e-3)
    # Every edge occurs once in each direction.
    edges = [
        tuple(np.concatenate(edge)) for ends in ((a, b), (b, c), (c, a)) for edge in zip(*ends, strict=True)
    ]
    assert len(set(edges)) == len(edges)
    assert {edge[3:] + edge[:3] for edge in edges} == set(edges)
    bounds = (
        UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(prim).ComputeAlignedRange()
    )
    np.testing.assert_allclose(world.bounds, [bounds.GetMin(), bounds.GetMax()], atol=1e-6)
    np.testing.assert_allclose(np.ptp(world.bounds, axis=0), size, atol=1e-6)
    # Normals of curved surfaces are smooth: a sphere's normal equals the direction, also between facets.
    camera = raycam.Camera.look_at([14, -13, 8], [4, 5, 6], [0, 0, 1], size=(64, 48), fov=15)
    frame = raycam.render(world, camera, channels=["position", "shading_normal", "normal", "albedo"])
    seen = np.isfinite(frame["position"][..., 0])
    away = frame["position"][seen] - [4, 5, 6]
    if kind == "Sphere":
        expected = away / np.linalg.norm(away, axis=1)[:, None]
        np.testing.assert_allclose(frame["shading_normal"][seen], expected, atol=2e-3)
    assert (np.sum(frame["normal"][seen] * frame["shading_normal"][seen], axis=1) > 0.99).all()
    np.testing.assert_allclose(frame["albedo"][seen], [[1, 0, 0]] * seen.sum(), atol=1e-6)


@pytest.mark.parametrize(("axis", "size"), [("X", [0, 5, 2]), ("Y", [2, 0, 5]), ("Z", [2, 5, 0])])
def test_plane_primitive_has_its_size_and_axis(tmp_path: Path, axis: str, size: list[float]) -> None:
    made = stage(tmp_path / "a.usda")
    plane = UsdGeom.Plane.Define(made, "/plane")
    plane.CreateWidthAttr(2)
    plane.CreateLengthAttr(5)
    plane.CreateAxisAttr(axis)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    np.testing.assert_allclose(np.ptp(world.bounds, axis=0), size)
    a, b, c = world.triangles()[0]
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(normal / np.linalg.norm(normal), np.eye(3)["XYZ".index(axis)])
