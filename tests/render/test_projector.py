"""Projectors: images that shine through the lens of a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam

SIZE = (64, 48)
LENSES: dict[str, dict[str, Any]] = {
    "pinhole": {"fov": 35},
    "opencv": {
        "K": [[70, 0, 31], [0, 72, 23], [0, 0, 1]],
        "distortion": [-0.25, 0.08, 0.002, -0.001, 0.01],
    },
    "rational": {
        "K": [[70, 0, 31], [0, 72, 23], [0, 0, 1]],
        "distortion": [0.1, -0.05, 0.001, 0.001, 0.01, 0.2, 0.02, 0.001],
    },
    "fisheye": {
        "K": [[40, 0, 32], [0, 40, 24], [0, 0, 1]],
        "model": "fisheye",
        "distortion": [0.05, -0.01, 0.002, -0.001],
    },
}


def projector_camera(lens: str) -> raycam.Camera:
    return raycam.Camera.look_at([0.5, -2.5, 1.5], [0, 0, 0.3], size=SIZE, **LENSES[lens])


def pattern(seed: int = 0) -> np.ndarray:
    """Random linear values at the projector's pixels."""
    return np.random.default_rng(seed).uniform(0.1, 1, (*SIZE[::-1], 3)).astype(np.float32)


def scene(lens: str = "pinhole", image: np.ndarray | None = None, **light: Any) -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": 20}, color=[1, 1, 1], diffuse=1, name="floor")
    world.add_object(box={"size": [0.6, 0.4, 0.8]}, location=[0.2, 0.1, 0.4], color=[1, 1, 1], diffuse=1)
    strength = {} if {"irradiance", "lumen", "lux"} & set(light) else {"power": 10}
    keys: dict[str, Any] = {"image": pattern() if image is None else image, "camera": projector_camera(lens)}
    world.add_light("projector", **(keys | strength | light))
    return world


def camera() -> raycam.Camera:
    return raycam.Camera.look_at([-0.8, -3, 1.8], [0, 0, 0.3], size=(96, 72), fov=40)


def opencv_pixels(lens: str, points: np.ndarray) -> np.ndarray:
    """Pixels of world points by OpenCV."""
    device = projector_camera(lens)
    rotation = cv2.Rodrigues(np.asarray(device.R))[0]
    translation = np.asarray(device.t).reshape(3)
    points = points.reshape(-1, 1, 3)
    if lens == "fisheye":
        coefficients = np.array(LENSES[lens]["distortion"], np.float64)
        found = cv2.fisheye.projectPoints(
            points, rotation.reshape(3), translation, np.asarray(device.K), coefficients
        )
    else:
        coefficients = np.array(LENSES[lens].get("distortion", [0.0] * 4))
        found = cv2.projectPoints(points, rotation, translation, np.asarray(device.K), coefficients)
    return np.asarray(found[0]).reshape(-1, 2)


@pytest.mark.parametrize("lens", LENSES)
def test_projector_pixels_equal_opencvs_projection(lens: str) -> None:
    frame = raycam.render(scene(lens), camera(), channels=["projector_uv", "position"])
    lit = np.isfinite(frame["projector_uv"]).all(axis=2)
    assert lit.sum() > 500
    expected = opencv_pixels(lens, frame["position"][lit])
    np.testing.assert_allclose(frame["projector_uv"][lit], expected, atol=2e-5)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_the_image_is_projected_on_surfaces(lens: str, integrator: str) -> None:
    options: dict[str, Any] = {"integrator": integrator, "samples": 1}
    options |= {"max_depth": 2} if integrator == "path" else {}
    channels = ["color", "projector_uv", "instance"]
    frame = raycam.render(scene(lens), camera(), channels=channels, **options)
    white = raycam.render(scene(lens, np.ones((*SIZE[::-1], 3), np.float32)), camera(), **options)
    uv = frame["projector_uv"]
    lit = np.isfinite(uv).all(axis=2)
    # Rays whose float32 and float64 shadow rays differ are at the edges of the image and of shadows.
    inner = cv2.erode(lit.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    u, v = uv[inner].T
    expected = cv2.remap(
        pattern(), u.reshape(1, -1), v.reshape(1, -1), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )[0]
    ratio = frame["color"][inner] / white["color"][inner]
    # OpenCV rounds the weights of its interpolation to 1/32.
    np.testing.assert_allclose(ratio, expected, atol=0.04)
    np.testing.assert_allclose(ratio.mean(axis=0), expected.mean(axis=0), rtol=2e-3)
    dark = cv2.dilate(lit.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0
    assert (frame["color"][dark] == 0).all()


def test_shadows_of_the_projector_have_no_projector_pixel() -> None:
    frame = raycam.render(scene(), camera(), channels=["projector_uv", "position", "normal", "instance"])
    lit = np.isfinite(frame["projector_uv"]).all(axis=2)
    floor = frame["instance"] == 0
    pixels = opencv_pixels("pinhole", frame["position"][floor])
    inside = ((pixels > -0.4) & (pixels < np.array(SIZE) - 0.6)).all(axis=1)
    # The box shades a part of the floor that is inside the projector's image.
    shaded = inside & ~lit[floor]
    assert shaded.sum() > 30
    start = np.asarray(projector_camera("pinhole").location)
    hit = scene().cast_rays(
        np.broadcast_to(start, (inside.sum(), 3)), frame["position"][floor][inside] - start
    )
    np.testing.assert_array_equal(hit["instance"] == 0, lit[floor][inside])
    away = (frame["normal"] * (start - np.nan_to_num(frame["position"]))).sum(axis=2) < 0
    assert not lit[away].any()


def test_a_pinhole_illuminates_a_facing_plane_evenly() -> None:
    world = raycam.World()
    world.add_object(plane={"size": 20}, color=[1, 1, 1], diffuse=1)
    device = raycam.Camera.look_at([0, 0, 2], [0, 0, 0], size=SIZE, fov=60, up=[0, 1, 0])
    world.add_light("projector", image=np.ones((1, 1, 3), np.float32), camera=device, irradiance=4 * np.pi)
    view = raycam.Camera.look_at([0, 0, 1.9], [0, 0, 0], size=(40, 30), fov=50, up=[0, 1, 0])
    frame = raycam.render(world, view, integrator="direct")
    np.testing.assert_allclose(frame["color"], 1, rtol=2e-4)


@pytest.mark.parametrize("lens", LENSES)
def test_power_is_the_total_light_that_a_white_image_emits(lens: str) -> None:
    """The light that arrives on the walls of a box around the projector is added up."""
    world = raycam.World()
    world.add_object(box={"size": 4}, color=[1, 1, 1], diffuse=1)
    device = raycam.Camera.look_at([0.1, 0.2, 0.1], [1, 0.3, 0.2], size=SIZE, **LENSES[lens])
    world.add_light("projector", image=np.ones((1, 1, 3), np.float32), camera=device, power=[1, 2, 3])
    around = raycam.Camera.equirectangular(size=(1024, 512), location=device.location)
    frame = raycam.render(
        world, around, integrator="direct", samples=1, channels=["color", "position", "normal"]
    )
    offset = frame["position"] - np.asarray(device.location)
    distance = np.linalg.norm(offset, axis=2, keepdims=True)
    cosine = np.abs((offset * frame["normal"]).sum(axis=2, keepdims=True)) / distance
    # A pixel in row v of a panorama covers dphi dtheta cos(elevation).
    elevation = np.pi * (0.5 - (np.arange(512) + 0.5) / 512)
    solid_angle = (np.pi / 512) ** 2 * np.cos(elevation).reshape(-1, 1, 1)
    area = distance**2 / cosine * solid_angle
    total = (np.pi * frame["color"] * area).sum(axis=(0, 1))
    np.testing.assert_allclose(total, [1, 2, 3], rtol=0.01)


def test_photometric_units_apply_to_projectors() -> None:
    def mean(**light: Any) -> float:
        return float(raycam.render(scene(**light), camera(), integrator="direct")["color"].mean())

    assert mean(lumen=6830) == pytest.approx(mean(power=10), rel=1e-5)
    assert mean(lux=683) == pytest.approx(mean(irradiance=1), rel=1e-5)


def test_projectors_have_names_light_channels_and_changeable_power() -> None:
    world = scene(name="beamer")
    world.add_light("sky", radiance=0.1)
    names = ["color", "light:beamer", "light:sky", "light:surfaces"]
    frame = raycam.render(world, camera(), integrator="path", samples=4, channels=names)
    np.testing.assert_allclose(sum(frame[name] for name in names[1:]), frame["color"], rtol=2e-6, atol=1e-6)
    stored = world.lights[0]
    assert raycam.Camera.from_dict(stored["camera"]) == projector_camera("pinhole")
    world.set_light(0, power=20)
    again = raycam.render(world, camera(), integrator="path", samples=4, channels=names)
    np.testing.assert_allclose(again["light:beamer"], 2 * frame["light:beamer"], rtol=1e-5, atol=1e-6)


def test_world_files_contain_projectors(tmp_path: Path) -> None:
    image = (pattern() * 255).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "slide.png"), image[..., ::-1])
    (tmp_path / "a.toml").write_text(
        """
[[object]]
plane = { size = 20 }

[[light]]
type = "projector"
image = "slide.png"
lumen = 3000
camera = { size = [64, 48], fov = 35, location = [0.5, -2.5, 1.5], target = [0, 0, 0.3] }
"""
    )
    loaded = raycam.load(tmp_path / "a.toml")
    described = raycam.World()
    described.add_object(plane={"size": 20})
    described.add_light("projector", image=image, camera=projector_camera("pinhole"), lumen=3000)
    frames = [
        raycam.render(world, camera(), integrator="direct", channels=["color", "projector_uv"])
        for world in (loaded, described)
    ]
    np.testing.assert_array_equal(frames[0]["color"], frames[1]["color"])
    np.testing.assert_array_equal(frames[0]["projector_uv"], frames[1]["projector_uv"])


def test_worlds_without_a_projector_have_no_projector_pixels() -> None:
    world = raycam.World()
    world.add_object(plane={"size": 20})
    assert np.isnan(raycam.render(world, camera(), channels="projector_uv")["projector_uv"]).all()


@pytest.mark.parametrize(
    ("keys", "facts"),
    [
        ({"image": None}, ("image",)),
        ({"camera": None}, ("camera",)),
        ({"power": None}, ("power", "irradiance")),
        ({"irradiance": 1}, ("power", "irradiance")),
        ({"power": -1}, ("power",)),
        (
            {
                "camera": {
                    "size": [64, 48],
                    "height": 2,
                    "projection": "orthographic",
                    "location": [0, 0, 1],
                    "yaw": 0,
                }
            },
            ("orthographic",),
        ),
        ({"camera": {"size": [64, 48], "fov": 300}}, ("fov",)),
        (
            {"type": "sun", "direction": [0, 0, -1], "irradiance": 1, "power": None, "image": None},
            ("camera", "sun"),
        ),
    ],
)
def test_invalid_projectors_are_refused(keys: dict[str, Any], facts: tuple[str, ...]) -> None:
    usual: dict[str, Any] = {
        "type": "projector",
        "image": pattern(),
        "camera": projector_camera("pinhole"),
        "power": 1,
    }
    given = {key: value for key, value in {**usual, **keys}.items() if value is not None}
    with pytest.raises(raycam.errors.Error) as caught:
        raycam.World().add_light(given)
    for fact in facts:
        assert fact in str(caught.value)
