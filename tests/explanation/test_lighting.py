"""The light of a pixel.

The terms are compared with closed forms, and their sum with the renderer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.explanation.lighting import material_of

EYE = np.array([4.0, -3.0, 2.0])
LIGHTS: dict[str, list[dict[str, Any]]] = {
    "sun": [{"type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 2, 1]}],
    "bulb": [{"type": "point", "position": [2, -2, 2], "power": [60, 50, 40]}],
    "spot": [
        {
            "type": "spot",
            "position": [2, -2, 3],
            "direction": [-1, 1, -2],
            "intensity": [9, 8, 7],
            "inner": 10,
            "outer": 40,
        }
    ],
}
LIGHTS["all"] = [light for lights in list(LIGHTS.values()) for light in lights]


def made_world(lights: list[dict[str, Any]], **material: Any) -> raycam.World:
    world = raycam.World()
    keys = material or {"diffuse": 0.7, "specular": 0.25, "shininess": 20}
    if "metal" not in keys:
        keys["color"] = [0.6, 0.3, 0.1]
    world.add_object(box={"size": 1}, name="box", **keys)
    world.add_object(plane={"size": [9, 9]}, location=[0, 0, -0.5], color=[0.4, 0.5, 0.6], name="floor")
    for light in lights:
        world.add_light(light)
    return world


def camera() -> raycam.Camera:
    return raycam.Camera.look_at(EYE, [0, 0, 0], size=(48, 32), focal=50)


def by_hand(
    light: dict[str, Any], point: Any, normal: Any, color: Any, shine: tuple[float, float, float]
) -> Any:
    """The radiance of a lit point towards the camera, by the lecture's formulas."""
    if light["type"] == "sun":
        way, irradiance = -np.array(light["direction"], float), np.array(light["irradiance"], float)
    else:
        way = np.array(light["position"]) - point
        intensity = np.array(light.get("intensity", np.array(light.get("power", 0)) / (4 * np.pi)), float)
        irradiance = intensity / (way @ way)
    way = way / np.linalg.norm(way)
    if light["type"] == "spot":
        axis = np.array(light["direction"]) / np.linalg.norm(light["direction"])
        inner, outer = np.cos(np.radians([light["inner"], light["outer"]]))
        irradiance = irradiance * np.clip((-way @ axis - outer) / (inner - outer), 0, 1) ** 2
    eye = (EYE - point) / np.linalg.norm(EYE - point)
    mirror = 2 * (normal @ eye) * normal - eye
    kd, ks, s = shine
    lobe = ks * (s + 2) / (2 * np.pi) * max(mirror @ way, 0) ** s
    return (kd * np.array(color) / np.pi + lobe) * irradiance * max(normal @ way, 0)


@pytest.mark.parametrize("name", LIGHTS)
def test_lighting_terms_equal_closed_forms(name: str) -> None:
    world = made_world(LIGHTS[name])
    found = raycam.explain(world, camera(), (24, 12)).lighting()
    surface = found.surface
    assert surface is not None
    assert surface.object_name == "box"
    shine = (0.7, 0.25, 20)
    wanted = [by_hand(each, surface.point, surface.normal, [0.6, 0.3, 0.1], shine) for each in LIGHTS[name]]
    for term, value in zip(found.terms, wanted, strict=True):
        assert np.allclose(term.diffuse + term.specular, value, rtol=1e-5), term.name
        assert np.allclose(term.radiance, value, rtol=1e-3, atol=1e-6), term.name
    assert np.allclose(found.total, np.sum(wanted, axis=0), rtol=1e-3)


@pytest.mark.parametrize("pixel", [(24, 12), (24, 20), (8, 25), (40, 28), (30, 10)])
def test_sum_of_lighting_terms_equals_the_pixel(pixel: tuple[int, int]) -> None:
    world = made_world(LIGHTS["all"])
    seen = raycam.render(world, camera(), integrator="direct", samples=1)["color"][pixel[1], pixel[0]]
    found = raycam.explain(world, camera(), pixel).lighting()
    assert np.allclose(found.total, seen, rtol=2e-3, atol=1e-5)
    assert np.allclose(found.rendered.value, seen, rtol=2e-3, atol=1e-5)
    assert found.rendered.error == 0


def test_shadowed_light_names_the_blocking_object() -> None:
    world = made_world([{"type": "sun", "direction": [1, -0.2, -1], "irradiance": 3}])
    frame = raycam.render(world, camera(), integrator="direct", samples=1, channels=["color", "instance"])
    in_shadow = (frame["instance"] == 1) & (frame["color"].max(axis=2) < 1e-6)
    dark = [(int(column), int(row)) for row, column in np.argwhere(in_shadow)]
    assert dark
    (term,) = raycam.explain(world, camera(), dark[len(dark) // 2]).lighting().terms
    assert term.blocker == "box"
    assert 0 < term.reach < np.inf
    assert not term.diffuse.any()
    assert not term.radiance.any()
    text = str(raycam.explain(world, camera(), dark[0]).lighting())
    assert "meets box: in shadow" in text


def test_uniform_sky_contributes_its_radiance_times_the_albedo() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [9, 9]}, color=[0.4, 0.5, 0.6])
    world.add_light({"type": "sky", "radiance": [0.5, 1, 2]})
    found = raycam.explain(world, camera(), (24, 16)).lighting()
    assert np.allclose(found.terms[0].radiance, [0.2, 0.5, 1.2], rtol=1e-3)
    assert found.terms[0].to_light is None
    assert not found.terms[0].is_exact
    missed = raycam.explain(
        world, raycam.Camera.look_at(EYE, EYE + np.array([1, 0, 1]), size=(9, 9), fov=30), (4, 4)
    )
    assert np.allclose(missed.lighting().emission, [0.5, 1, 2], rtol=1e-5)
    assert missed.lighting().surface is None


def test_emissive_object_emits_light_and_lights_other_objects() -> None:
    world = made_world([], emission=[2, 1, 0.5])
    shines = raycam.explain(world, camera(), (24, 12)).lighting()
    assert np.allclose(shines.emission, [2, 1, 0.5])
    lit = raycam.explain(world, camera(), (8, 25)).lighting(samples=1024)
    assert [term.name for term in lit.terms] == ["emissive objects"]
    assert lit.total == pytest.approx(lit.rendered.value, abs=5 * lit.rendered.error + 1e-6)


OTHERS: list[dict[str, Any]] = [
    {"type": "metal", "metal": "gold", "roughness": 0.4},
    {"type": "principled"},
    {"type": "unlit"},
]


@pytest.mark.parametrize("material", OTHERS)
def test_lighting_terms_of_materials_other_than_phong_equal_the_renderer(material: dict[str, Any]) -> None:
    world = made_world(LIGHTS["all"], **material)
    found = raycam.explain(world, camera(), (24, 12)).lighting()
    assert found.surface is not None
    assert found.surface.model == material["type"]
    assert np.isnan(found.surface.diffuse)
    assert np.allclose(found.total, found.rendered.value, rtol=2e-3, atol=1e-5)


def test_material_is_found_by_triangle() -> None:
    world = made_world([], type="principled", roughness=0.3, metallic=0.5)
    assert material_of(world, 0, 11)["values"]["roughness"]["value"] == pytest.approx(0.3)
    assert material_of(world, 1, 1)["model"] == "phong"
