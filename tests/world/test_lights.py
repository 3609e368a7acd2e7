"""Names, photometric units and colour temperatures of lights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam

LUMINANCE = np.array([0.212639, 0.715169, 0.072192])
"""Weights of linear Rec. 709 (ITU-R BT.709)."""
XYZ_FROM_RGB = np.array(
    [[0.412391, 0.357584, 0.180481], [0.212639, 0.715169, 0.072192], [0.019331, 0.119195, 0.950532]]
)


def light(**keys: Any) -> dict[str, Any]:
    """The description of a light as the world stores it."""
    world = raycam.World()
    world.add_light(keys)
    return dict(world.lights[0])


def test_photometric_units_are_converted_with_683_lumen_per_watt() -> None:
    at = {"position": [0, 0, 1], "direction": [0, 0, -1]}
    cases = [
        (light(type="sun", direction=[0, 0, -1], lux=68300), "irradiance", 100),
        (light(type="bulb", position=[0, 0, 1], candela=683), "intensity", 1),
        (light(type="bulb", position=[0, 0, 1], lumen=1366), "power", 2),
        (light(type="spot", **at, candela=683), "intensity", 1),
        (light(type="spot", **at, lumen=683), "power", 1),
        (light(type="sky", nit=6830), "radiance", 10),
        (light(type="area", position=[0, 0, 1], u=[2, 0, 0], v=[0, 1, 0], nit=683), "radiance", 1),
        (
            light(type="area", position=[0, 0, 1], u=[2, 0, 0], v=[0, 1, 0], lumen=683),
            "radiance",
            1 / (2 * np.pi),
        ),
        (light(type="disk", **at, radius=2, lumen=683), "radiance", 1 / (4 * np.pi**2)),
        (light(type="disk", **at, radius=2, lumen=683, two_sided=True), "radiance", 1 / (8 * np.pi**2)),
    ]
    for stored, key, expected in cases:
        np.testing.assert_allclose(stored[key], [expected] * 3, rtol=1e-6)


def test_lux_is_the_illuminance_of_a_facing_surface() -> None:
    world = raycam.World()
    world.add_object(plane={"size": 4}, color=[1, 1, 1], diffuse=1)
    world.add_light(type="sun", direction=[0, 0, -1], lux=683 * np.pi)
    camera = raycam.Camera.look_at([0, -1, 3], [0, 0, 0], size=(8, 8), fov=10)
    frame = raycam.render(world, camera, integrator="direct")
    np.testing.assert_allclose(frame["color"], 1, rtol=1e-5)


@pytest.mark.parametrize(
    ("kelvin", "expected"),
    [
        (2856, (0.44757, 0.40745)),
        (4000, (0.3805, 0.3768)),
        (6500, (0.3135, 0.3237)),
        (10000, (0.2807, 0.2884)),
    ],
)
def test_temperatures_have_the_published_chromaticity(kelvin: float, expected: tuple[float, float]) -> None:
    # CIE standard illuminant A; Wyszecki and Stiles, "Color Science", table 1(3.11).
    color = np.array(light(type="sky", radiance=1, temperature=kelvin)["radiance"])
    assert LUMINANCE @ color == pytest.approx(1, rel=1e-5)
    xyz = XYZ_FROM_RGB @ color
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), expected, atol=3e-3)


def test_temperature_multiplies_colors_and_photometric_units() -> None:
    tint = np.array(light(type="sky", radiance=1, temperature=3000)["radiance"])
    red = light(type="sky", radiance=[1, 0.5, 0], temperature=3000)["radiance"]
    np.testing.assert_allclose(red, tint * [1, 0.5, 0], rtol=1e-6)
    lamp = light(type="bulb", position=[0, 0, 0], lumen=800, temperature=3000)["power"]
    np.testing.assert_allclose(lamp, tint * 800 / 683, rtol=1e-6)


@pytest.mark.parametrize(
    ("keys", "facts"),
    [
        ({"type": "sun", "direction": [0, 0, -1], "candela": 5}, ("candela", "sun", "point, spot")),
        ({"type": "bulb", "position": [0, 0, 0], "lux": 5}, ("lux", "sun")),
        ({"type": "bulb", "position": [0, 0, 0], "lumen": 5, "power": 1}, ("lumen", "power")),
        ({"type": "bulb", "position": [0, 0, 0], "lumen": 5, "candela": 1}, ("lumen", "candela")),
        ({"type": "sun", "direction": [0, 0, -1], "lux": -1}, ("lux", "-1")),
        ({"type": "sun", "direction": [0, 0, -1], "lux": float("inf")}, ("lux", "inf")),
        ({"type": "sky", "radiance": 1, "temperature": 0}, ("temperature", "1000", "40000")),
        ({"type": "daylight", "direction": [0, 0, -1], "temperature": 3000}, ("temperature", "daylight")),
        ({"type": "sun", "direction": [0, 0, -1]}, ("irradiance",)),
        ({"type": "sky", "radiance": 1, "name": ""}, ("name",)),
    ],
)
def test_invalid_units_and_temperatures_are_refused(keys: dict[str, Any], facts: tuple[str, ...]) -> None:
    with pytest.raises(raycam.WorldError) as caught:
        raycam.World().add_light(keys)
    for fact in facts:
        assert fact in str(caught.value)


def test_names_of_lights_are_unique() -> None:
    world = raycam.World()
    world.add_light(type="sky", radiance=1, name="key")
    for name in ("key", "surfaces"):
        with pytest.raises(raycam.WorldError, match=name):
            world.add_light(type="sky", radiance=1, name=name)
    assert len(world.lights) == 1
    world.set_light(0, name="fill")
    assert world.lights[0]["name"] == "fill"
    world.add_light(type="sky", radiance=1, name="key")
    world.remove_light(0)
    assert [each["name"] for each in world.lights] == ["key"]


def test_lights_of_gltf_have_the_names_of_their_nodes(tmp_path: Any) -> None:
    import json

    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}, {"type": "directional"}]}},
        "nodes": [
            {"name": "Lamp.001", "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"name": "Lamp.001", "extensions": {"KHR_lights_punctual": {"light": 1}}},
        ],
        "scenes": [{"nodes": [0, 1]}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    lights = raycam.load(tmp_path / "a.gltf").lights
    assert [each.get("name") for each in lights] == ["Lamp.001", None]


def test_radius_of_a_spot_softens_shadows_and_keeps_the_brightness() -> None:
    def floor(radius: float, edge: bool) -> np.ndarray:
        world = raycam.World()
        world.add_object(plane={"size": 8}, color=[1, 1, 1], diffuse=1)
        if edge:
            world.add_object(box={"size": [2, 4, 0.02]}, location=[1, 0, 1])
        world.add_light(
            type="spot",
            position=[0, 0, 2],
            direction=[0, 0, -1],
            intensity=4,
            inner=40,
            outer=60,
            radius=radius,
        )
        above = raycam.Camera.look_at([-0.5, 0, 0.9], [0, 0, 0], size=(64, 8), fov=8, up=[0, 1, 0])
        frame = raycam.render(world, above, integrator="path", samples=512, max_depth=2)
        return np.asarray(frame["color"][4, :, 0])

    hard, soft = floor(0, False), floor(0.2, False)
    np.testing.assert_allclose(soft, hard, rtol=0.05)
    edges = [np.abs(np.diff(floor(radius, True))).max() for radius in (0, 0.2)]
    assert edges[1] < 0.4 * edges[0]
