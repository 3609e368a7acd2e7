"""Lights of SDF worlds: strengths by closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam import FormatError
from support.raises import raises, warns

PLATE = (
    '<model name="m"><static>1</static><link name="l"><visual name="v"><geometry><box><size>40 40 0.2</size></box>'
    "</geometry><material><diffuse>1 1 1 1</diffuse></material></visual></link></model>"
)
BLACK = "<scene><ambient>0 0 0 1</ambient></scene>"


def load(folder: Path, lights: str, scene: str = BLACK) -> raycam.World:
    path = folder / "world.sdf"
    path.write_text(f'<sdf version="1.9"><world name="w">{scene}{PLATE}{lights}</world></sdf>')
    return raycam.load(path, packages=[folder])


def radiance(world: raycam.World, x: float = 0.0, samples: int = 16) -> np.ndarray:
    """The light of the plate's upper side at (x, 0), seen from 1 m above it."""
    K = [[1000.0, 0, 1], [0, 1000.0, 1], [0, 0, 1]]
    camera = raycam.Camera(K, np.diag([1.0, -1, -1]), [x, 0, 1.1], (2, 2))
    frame = raycam.render(world, camera, integrator="direct", samples=samples, ambient_occlusion=False)
    return np.asarray(frame["color"][..., :3].mean(axis=(0, 1)))


def test_directional_light_shows_its_colour_on_a_facing_white_surface(tmp_path: Path) -> None:
    light = (
        '<light name="sun" type="directional"><pose>0 0 10 0 0.5 0</pose><cast_shadows>1</cast_shadows>'
        "<diffuse>0.5 0.25 0.125 1</diffuse><intensity>2</intensity><direction>0 0 -1</direction></light>"
    )
    with raycam.strict():
        world = load(tmp_path, light)
    # The pose rotates the direction by 0.5 radians about y, even if the light has no position.
    np.testing.assert_allclose(radiance(world), np.array([1, 0.5, 0.25]) * math.cos(0.5), rtol=2e-3)


@pytest.mark.parametrize("x", [0.0, 3.0])
def test_lamp_with_quadratic_attenuation_is_exact_at_every_distance(tmp_path: Path, x: float) -> None:
    light = (
        '<light name="lamp" type="point"><pose>0 0 4.1 0 0 0</pose><diffuse>1 1 1 1</diffuse><attenuation>'
        "<constant>0</constant><linear>0</linear><quadratic>0.5</quadratic></attenuation></light>"
    )
    with raycam.strict():
        world = load(tmp_path, light)
    squared = 16 + x**2
    expected = 4 / math.sqrt(squared) / (0.5 * squared)
    np.testing.assert_allclose(radiance(world, x), [expected] * 3, rtol=2e-3)


def test_lamp_without_quadratic_attenuation_is_exact_at_the_origin_with_a_notice(tmp_path: Path) -> None:
    light = '<light name="lamp" type="point"><pose>0 0 4.1 0 0 0</pose></light>'
    with warns(raycam.Notice, code="approximated_value", mentions=["'lamp'", "world.sdf:1"]):
        world = load(tmp_path, light)
    # By default the light is divided by 1 + distance.
    expected = 1 / (1 + 4.1) * (4.1 / 4) ** 2
    np.testing.assert_allclose(radiance(world), [expected] * 3, rtol=2e-3)


def test_spot_light_ends_at_half_its_outer_angle(tmp_path: Path) -> None:
    light = (
        '<light name="spot" type="spot"><pose>0 0 4.1 0 0 0</pose><direction>0 0 -1</direction><spot><inner_angle>0.6'
        "</inner_angle><outer_angle>0.8</outer_angle><falloff>1</falloff></spot><attenuation><constant>0</constant>"
        "<linear>0</linear><quadratic>1</quadratic></attenuation></light>"
    )
    world = load(tmp_path, light)
    inside, outside = 4 * math.tan(0.28), 4 * math.tan(0.42)
    assert radiance(world, inside).min() > 0.04
    assert radiance(world, outside).max() == 0


def test_ambient_light_is_an_even_sky(tmp_path: Path) -> None:
    light = '<light name="sun" type="directional"><direction>0 0 1</direction></light>'
    world = load(tmp_path, light, "<scene><ambient>0.25 0.5 0.75 1</ambient></scene>")
    np.testing.assert_allclose(radiance(world, samples=256), [0.25, 0.5, 0.75], rtol=2e-2)
    assert [one["type"] for one in load(tmp_path, light, "").lights] == ["sun", "sky"]


def test_included_lights_are_placed_and_dark_lights_omitted(tmp_path: Path) -> None:
    folder = tmp_path / "sun"
    folder.mkdir()
    (folder / "model.sdf").write_text(
        '<sdf version="1.9"><light name="sun" type="directional"><direction>0 0 -1</direction></light></sdf>'
    )
    off = '<light name="a" type="point"><light_on>false</light_on></light>'
    black = '<light name="b" type="point"><diffuse>0 0 0 1</diffuse></light>'
    include = "<include><uri>model://sun</uri><pose>0 0 9 0 0.3 0</pose></include>"
    world = load(tmp_path, off + black + include)
    assert [one["type"] for one in world.lights] == ["sun"]
    np.testing.assert_allclose(radiance(world), [math.cos(0.3)] * 3, rtol=2e-3)
    other = raycam.World()
    with warns(raycam.Notice, code="ignored_element", mentions=["world.sdf"]):
        other.add_robot(tmp_path / "world.sdf", packages=[tmp_path])
    assert other.lights == []


def test_sdf_world_without_lights_is_loaded_without_lights(tmp_path: Path) -> None:
    assert load(tmp_path, "", "").lights == []


@pytest.mark.parametrize(
    ("body", "facts"),
    [
        ('<light name="x" type="laser"/>', ["'laser'", "directional"]),
        ('<light name="x" type="point"><diffuse>-1 0 0 1</diffuse></light>', ["<diffuse>"]),
        ('<light name="x" type="point"><diffuse>1 1</diffuse></light>', ["<diffuse>", "2"]),
        ('<light name="x" type="point"><intensity>-2</intensity></light>', ["<intensity>"]),
        ('<light name="x" type="directional"><direction>0 0 0</direction></light>', ["<direction>"]),
        ('<light name="x" type="spot"/>', ["outer_angle"]),
        (
            '<light name="x" type="point"><attenuation><constant>0</constant><linear>0</linear></attenuation></light>',
            ["attenuation"],
        ),
    ],
)
def test_invalid_lights_are_refused_with_file_and_line(tmp_path: Path, body: str, facts: list[str]) -> None:
    with raises(FormatError, mentions=["world.sdf:1", *facts]):
        load(tmp_path, body)
