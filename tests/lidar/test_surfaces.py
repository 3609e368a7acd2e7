"""Returned shares of surfaces, against the formulas of optics."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
import raycam
from raycam.lidar.surfaces import SurfaceTable, conductor_reflectance, dielectric_reflectance, read_surface


def test_dielectric_reflectance_at_special_angles_equals_the_fresnel_equations() -> None:
    one = np.ones(1)
    assert dielectric_reflectance(one, one / 1.5)[0] == pytest.approx(0.04)
    brewster = math.cos(math.atan(1.5))
    # Light that is polarised parallel to the plane of incidence is not reflected.
    across = ((1 - 1.5**2) / (1 + 1.5**2)) ** 2
    assert dielectric_reflectance(np.array([brewster]), one / 1.5)[0] == pytest.approx(across / 2)
    assert dielectric_reflectance(np.array([math.cos(math.asin(0.9))]), one * 1.5)[0] == 1


@pytest.mark.parametrize("cosine", [1.0, 0.7, 0.2, 0.02])
@pytest.mark.parametrize("index", [0.15 + 3.5j, 1.4 + 7.6j, 2.9 + 3.1j])
def test_conductor_reflectance_equals_the_complex_fresnel_equations(cosine: float, index: complex) -> None:
    inner = cmath.sqrt(1 - (1 - cosine**2) / index**2)
    s = abs((cosine - index * inner) / (cosine + index * inner)) ** 2
    p = abs((index * cosine - inner) / (index * cosine + inner)) ** 2
    found = conductor_reflectance(np.array([cosine]), np.array([index.real]), np.array([index.imag]))
    assert found[0] == pytest.approx((s + p) / 2, rel=1e-9)


def test_unlit_surfaces_are_diffuse() -> None:
    surface = read_surface({"model": "Unlit", "opacity": 0.25, "alpha": "Blend"})
    assert (surface.kind, surface.diffuse, surface.opacity) == ("solid", 1.0, 0.25)


def test_surface_table_does_not_depend_on_the_order_of_reading() -> None:
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]}, name="mirror", type="metal", metal="gold", roughness=0)
    world.add_object(box={"size": [1, 1, 1]}, name="pane", type="glass")
    world.add_object(box={"size": [1, 1, 1]}, name="sign", lidar={"reflectance": 0.8, "retroreflection": 300})
    world.add_object(instance_of="sign", name="copy", lidar={"reflectance": 0.3})
    triangle = np.zeros(5, np.int32)
    ids = dict(zip([item.name for item in world.objects], range(4), strict=True))
    instance = np.array([-1, *(ids[name] for name in ("copy", "pane", "sign", "mirror"))], np.int32)
    material = np.array([-1, *(material_of(world, int(i)) for i in instance[1:])], np.int32)
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 2, 0, 4, 1]):
        table = SurfaceTable(world)
        for step in (order[:2], order[2:], order):
            number = table.read(material[step], instance[step], triangle[step])
        expected = {0: "solid", 1: "solid", 2: "glass", 3: "solid", 4: "mirror"}
        assert table.column(number, "kind").tolist() == [expected[i] for i in order]
        reflectance = {0: math.nan, 1: 0.3, 2: math.nan, 3: 0.8, 4: math.nan}
        np.testing.assert_array_equal(table.column(number, "reflectance"), [reflectance[i] for i in order])


def material_of(world: raycam.World, instance: int) -> int:
    """The number of an object's material, from a ray that can hit only this object."""
    corner = world.triangles(instance)[0].mean(axis=0)
    hit = world.cast_rays([9 * corner], [-corner], fields=("material", "instance"), objects=instance)
    assert hit["instance"][0] == instance
    return int(hit["material"][0])


@pytest.mark.parametrize("angle", [0.0, 5.0, 20.0, 40.0, 60.0])
def test_table_of_retroreflection_is_linear_between_its_angles(angle: float) -> None:
    """The returned share is pi R_A(theta) / cos(theta) (ASTM E808).

    Above the last angle, the share decreases with cos^4.
    """
    pairs = [[5, 300.0], [30, 150.0], [40, 50.0]]
    world = raycam.World()
    sign = {"reflectance": 0.0, "retroreflection_table": pairs}
    world.add_object(
        box={"size": [0.1, 90, 90]}, name="sign", location=[20, 0, 0], yaw=angle, color=[0.5] * 3, lidar=sign
    )
    scan = raycam.scan(world, raycam.Lidar.of([[1, 0, 0]], noise=False))
    coefficient = {
        0.0: 300,
        5.0: 300,
        20.0: 210,
        40.0: 50,
        60.0: 50 * (0.5 / math.cos(math.radians(40))) ** 4,
    }
    expected = math.pi * coefficient[angle] / math.cos(math.radians(angle))
    assert scan["incidence"][0] == pytest.approx(angle, abs=1e-3)
    assert scan["reflectivity"][0] == pytest.approx(expected, rel=1e-4)
