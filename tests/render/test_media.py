"""Media inside of closed meshes, compared with Beer's law, furnaces and fog."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import warns

Floats = npt.NDArray[np.float64]
ABSORPTION = np.array([0.1, 0.4, 1.0])


def wall(distance: float = 10, **material: Any) -> raycam.World:
    """A wall that emits light."""
    world = raycam.World()
    world.add_object(
        plane=400,
        location=[0, distance, 0],
        pitch=90,
        yaw=-90,
        **({"emission": [1, 2, 3], "color": 0} | material),
    )
    return world


def view(eye: tuple[float, float, float] = (0, 0, 0), size: tuple[int, int] = (9, 7)) -> raycam.Camera:
    return raycam.Camera.look_at(eye, [eye[0], eye[1] + 10, eye[2]], size=size, fov=40)


def cosines(camera: raycam.Camera) -> Floats:
    """The y component of each pixel's direction."""
    width, height = camera.size
    rows, columns = np.mgrid[:height, :width]
    directions = np.asarray(camera.rays(np.stack([columns, rows], -1).reshape(-1, 2).astype(float))[1])
    return directions[:, 1].reshape(height, width, 1)


@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_absorbing_medium_equals_beers_law(integrator: Any) -> None:
    world = wall()
    world.add_object(
        box=[100, 3, 100], location=[0, 5, 0], type="boundary", medium={"absorption": ABSORPTION}
    )
    camera = view()
    frame = raycam.render(
        world, camera, integrator=integrator, samples=1, channels=["color", "transmittance", "distance"]
    )
    passed = np.exp(-ABSORPTION * 3 / cosines(camera))
    np.testing.assert_allclose(frame["transmittance"], passed, rtol=1e-5)
    np.testing.assert_allclose(frame["color"], np.array([1, 2, 3]) * passed, rtol=1e-4)
    np.testing.assert_allclose(frame["distance"], 10 / cosines(camera)[..., 0], rtol=1e-6)


def test_medium_boundary_is_not_part_of_the_ground_truth() -> None:
    channels = ["depth", "position", "normal", "instance", "material", "albedo", "alpha", "coverage"]
    plain = wall()
    frames = []
    for has_medium in (False, True):
        if has_medium:
            plain.add_object(sphere=2, location=[0, 6, 0], type="boundary", medium="milk")
        frames.append(
            raycam.render(plain, view(), integrator="path", samples=4, max_depth=2, channels=channels)
        )
    for name in channels:
        np.testing.assert_array_equal(frames[0][name], frames[1][name])


def test_boundary_without_a_medium_changes_nothing() -> None:
    world = wall()
    world.add_light("sky", radiance=0.5)
    world.add_object(sphere=1, location=[0, 7, 0])
    before = raycam.render(world, view(), integrator="path", samples=8)["color"]
    world.add_object(sphere=2, location=[0, 6, 0], type="boundary")
    after = raycam.render(world, view(), integrator="path", samples=8)["color"]
    np.testing.assert_allclose(after, before, rtol=1e-5)


@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_camera_inside_a_medium_shows_an_attenuated_image(integrator: Any) -> None:
    world = wall()
    world.add_object(
        box=[100, 8, 100], location=[0, 1, 0], type="boundary", medium={"absorption": ABSORPTION}
    )
    camera = view()
    frame = raycam.render(
        world, camera, integrator=integrator, samples=1, channels=["color", "transmittance"]
    )
    passed = np.exp(-ABSORPTION * 5 / cosines(camera))
    np.testing.assert_allclose(frame["transmittance"], passed, rtol=1e-5)
    np.testing.assert_allclose(frame["color"], np.array([1, 2, 3]) * passed, rtol=1e-4)


@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_underwater_camera_shows_objects_through_the_water(integrator: Any) -> None:
    """The water's attenuation applies from the camera on."""
    world = wall()
    color, distance = np.array([0.9, 0.5, 0.2]), 4.0
    world.add_object(
        box=[100, 60, 100], type="glass", ior=1.33, attenuation_color=color, attenuation_distance=distance
    )
    camera = view()
    image = raycam.render(world, camera, integrator=integrator, samples=1, max_depth=3)["color"]
    passed = color ** (10 / cosines(camera) / distance)
    np.testing.assert_allclose(image, np.array([1, 2, 3]) * passed, rtol=1e-4)


def test_priority_determines_the_medium_where_media_overlap() -> None:
    world = wall()
    for center, absorption, priority in ((4, 0.2, 0), (5, 0.5, 1), (6, 1.1, 0)):
        world.add_object(
            box=[100, 3, 100],
            location=[0, center, 0],
            type="boundary",
            priority=priority,
            medium={"absorption": absorption},
        )
    frame = raycam.render(world, view(), channels=["transmittance"])
    depth = 0.2 * 1 + 0.5 * 3 + 1.1 * 1
    np.testing.assert_allclose(
        frame["transmittance"], np.exp(-depth / cosines(view())).repeat(3, 2), rtol=1e-5
    )


def test_body_displaces_the_fog_around_it() -> None:
    world = wall()
    world.set_fog(extinction=0.2, albedo=0)
    world.add_object(box=[100, 4, 100], location=[0, 5, 0], type="boundary")
    frame = raycam.render(world, view(), channels=["transmittance"])
    np.testing.assert_allclose(
        frame["transmittance"], np.exp(-0.2 * 6 / cosines(view())).repeat(3, 2), rtol=1e-5
    )


@pytest.mark.parametrize(
    "body",
    [
        {"type": "boundary", "medium": {"scattering": 2}},
        {"type": "boundary", "medium": {"scattering": [0.5, 2, 5], "g": 0.8}},
        {"type": "glass", "ior": 1.5, "medium": {"scattering": 1.5}},
        {
            "type": "principled",
            "color": 1,
            "transmission": 1,
            "roughness": 0.3,
            "medium": {"scattering": [1, 2, 3], "g": -0.5},
        },
    ],
)
def test_white_furnace_with_a_medium_returns_the_sky(body: dict[str, Any]) -> None:
    world = raycam.World()
    world.add_light("sky", radiance=1)
    world.add_object(sphere={"radius": 1, "level": 5}, location=[0, 4, 0], **body)
    world.add_object(sphere={"radius": 0.3, "level": 3}, location=[0, 4, 0.2], color=1)
    camera = raycam.Camera.look_at([0, 0, 0], [0, 4, 0], size=(16, 16), fov=40)
    image = raycam.render(world, camera, integrator="path", samples=1024)["color"]
    np.testing.assert_allclose(image.mean(axis=(0, 1)), 1.0, atol=3e-3)


def test_medium_in_a_large_box_equals_fog() -> None:
    """Fog gives the same image as a medium in a box around everything.

    The camera and the lamp are inside the box, too.
    """
    images = []
    for boxed in (False, True):
        world = raycam.World()
        world.add_object(plane=30, location=[0, 0, -1], color=0.7)
        world.add_object(sphere=0.5, location=[0, 4, 0], color=[0.2, 0.5, 0.9])
        world.add_light("point", position=[1, 3, 1], intensity=3)
        if boxed:
            medium = {"absorption": [0.05, 0.1, 0.02], "scattering": [0.2, 0.1, 0.3], "g": 0.5}
            world.add_object(box=200, type="boundary", medium=medium)
        else:
            extinction = np.array([0.25, 0.2, 0.32])
            world.set_fog(extinction=extinction, albedo=np.array([0.2, 0.1, 0.3]) / extinction, g=0.5)
        image = raycam.render(world, view(size=(24, 18)), integrator="path", samples=1024, max_depth=8)[
            "color"
        ]
        images.append(image.astype(float).mean(axis=(0, 1)))
    np.testing.assert_allclose(images[0], images[1], rtol=1e-2)


def test_open_mesh_with_a_medium_gives_a_notice_with_its_edges() -> None:
    world = raycam.World()
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    medium = {"type": "boundary", "medium": {"absorption": 1}}
    world.add_mesh(corners, faces, name="closed", material=medium)
    assert "open_medium" not in [notice.code for notice in world.notices]
    with warns(raycam.Notice, code="open_medium", mentions=["tent", 3]):
        world.add_mesh(corners, faces[:3], name="tent", material=medium)
    assert [notice.code for notice in world.notices].count("open_medium") == 1


@pytest.mark.parametrize(
    "row", [("jerlov_I", 0.063, 0.305), ("jerlov_III", 0.12, 0.375), ("jerlov_9C", 0.63, 0.65)]
)
def test_water_presets_equal_jerlovs_water_types(row: tuple[str, float, float]) -> None:
    """Jerlov's table has a row at 550 nm, close to the green primary's wavelength.

    Its row at 625 nm is beyond the red primary, so it is an upper limit for red.
    """
    name, green, red = row
    world = wall()
    world.add_object(box=[100, 2, 100], location=[0, 5, 0], type="boundary", medium=name)
    passed = raycam.render(world, view(size=(1, 1)), channels=["transmittance"])["transmittance"][0, 0]
    found = -np.log(passed.astype(float)) / 2
    np.testing.assert_allclose(found[1], green, rtol=0.03)
    assert found[0] < red


def test_smoke_preset_has_the_absorption_of_soot_and_a_visibility_of_3_m() -> None:
    """Bond and Bergstrom (2006): 7.5 m²/g at 550 nm, and an albedo of 0.25.

    The absorption is inversely proportional to the wavelength.
    """
    world = wall()
    world.add_object(box=[100, 3, 100], location=[0, 5, 0], type="boundary", medium="smoke")
    passed = raycam.render(world, view(size=(1, 1)), channels=["transmittance"])["transmittance"][0, 0]
    extinction = 0.1 * 7.5 / (1 - 0.25) * 550 / np.array([611.4, 549.1, 464.2])
    np.testing.assert_allclose(passed, np.exp(-3 * extinction), rtol=1e-3)
    assert passed[1] == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize(
    ("keys", "key", "code"),
    [
        ({"type": "boundary", "medium": {"absorption": -1}}, "medium.absorption", "out_of_range"),
        ({"type": "boundary", "medium": {"scattering": math.inf}}, "medium.scattering", "out_of_range"),
        (
            {"type": "boundary", "medium": {"scattering": [1, math.nan, 1]}},
            "medium.scattering",
            "out_of_range",
        ),
        ({"type": "boundary", "medium": {"scattering": 1, "g": 1}}, "medium.g", "out_of_range"),
        ({"type": "boundary", "medium": "mlik"}, "milk", "unknown_name"),
        ({"type": "boundary", "medium": {"density": 1}}, "density", "unknown_key"),
        ({"type": "boundary", "roughness": 0.2}, "roughness", "conflicting_values"),
        ({"type": "matte", "medium": "milk"}, "medium", "conflicting_values"),
        ({"type": "glass", "medium": "milk", "thin": True}, "medium", "conflicting_values"),
        (
            {"type": "glass", "medium": "milk", "attenuation_distance": 1},
            "attenuation_distance",
            "conflicting_values",
        ),
    ],
)
def test_invalid_media_are_refused(keys: dict[str, Any], key: str, code: str) -> None:
    world = raycam.World()
    with pytest.raises(raycam.WorldError, match=key) as caught:
        world.add_object(sphere=1, **keys)
    assert caught.value.code == code
    assert not world.objects


def test_media_are_kept_by_world_files_and_bytes(tmp_path: Path) -> None:
    path = tmp_path / "tank.toml"
    path.write_text(
        '[[object]]\nbox = { size = [100, 2, 100] }\nlocation = [0, 5, 0]\ntype = "boundary"\n'
        "medium = { absorption = [0.1, 0.2, 0.3], scattering = 0.5, g = 0.7 }\n"
    )
    world = raycam.load(path)
    kept = [
        raycam.render(each, view(), channels=["transmittance"])["transmittance"]
        for each in (world, raycam.World.from_bytes(world.to_bytes()))
    ]
    np.testing.assert_array_equal(kept[0], kept[1])
    np.testing.assert_allclose(kept[0][3, 4], np.exp(-2 * np.array([0.6, 0.7, 0.8])), rtol=1e-4)
