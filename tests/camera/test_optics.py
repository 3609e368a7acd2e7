"""Aperture, shutter and vignetting, compared with closed forms."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import raises

F = 400.0
SIZE = (81, 61)
K = np.array([[F, 0, 40], [0, F, 30], [0, 0, 1]])
EYE = np.eye(3)


def camera_at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> raycam.Camera:
    return raycam.Camera(K, EYE, [x, y, z], SIZE)


def world_of(size: list[float], location: list[float]) -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": size}, color="#ffffff", location=location)
    return world


def light_of(world: raycam.World, camera: raycam.Camera, samples: int = 256) -> np.ndarray:
    """Each pixel's share of the light [h, w]."""
    color = raycam.render(world, camera, integrator="flat", samples=samples)["color"]
    light = color[..., 0].astype(np.float64)
    assert light.sum() > 0
    share: np.ndarray = light / light.sum()
    return share


def moments(light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of x and y, in pixels."""
    y, x = np.indices(light.shape)
    mean = np.array([(light * x).sum(), (light * y).sum()])
    return mean, np.array([(light * (x - mean[0]) ** 2).sum(), (light * (y - mean[1]) ** 2).sum()])


@pytest.mark.parametrize(("blades", "spread"), [(0, 1 / 4), (6, 5 / 24), (4, 1 / 6)])
def test_blur_of_a_point_has_the_variance_of_the_circle_of_confusion(blades: int, spread: float) -> None:
    """A point at depth d is blurred to the aperture's shape.

    Its radius is r = f R |1/d - 1/focus|. Along an axis, a uniform disc has the variance r²/4, a hexagon 5
    r²/24, and a square r²/6.
    """
    world = world_of([0.02, 0.02, 1e-4], [0, 0, 4])
    sharp = camera_at()
    blurred = sharp.with_aperture(0.1, focus=2, blades=blades)
    radius = F * 0.1 * abs(1 / 4 - 1 / 2)
    (_, before), (mean, after) = (moments(light_of(world, camera, 1024)) for camera in (sharp, blurred))
    np.testing.assert_allclose(after - before, radius**2 * spread, rtol=0.03)
    np.testing.assert_allclose(mean, [40, 30], atol=0.15)
    light = light_of(world, blurred)
    assert light[30, 40 + int(radius) + 3 :].sum() == 0


def test_surfaces_in_focus_are_sharp() -> None:
    world = world_of([0.3, 0.3, 1e-9], [0.2, 0.1, 2])
    sharp, open_wide = light_of(world, camera_at()), light_of(world, camera_at().with_aperture(0.2, focus=2))
    assert np.abs(sharp - open_wide).max() < 0.1 * sharp.max()
    inside = sharp > 0.99 * sharp.max()
    np.testing.assert_allclose(open_wide[inside], sharp[inside], rtol=1e-3)


def test_f_number_equals_the_aperture_radius() -> None:
    camera = camera_at().with_aperture(f_number=2, focal_length=0.05, focus=3)
    assert camera.aperture is not None
    again = camera_at().with_aperture(0.0125, focus=3)
    point = [0.3, 0.1, 9.0]
    world = world_of([0.1, 0.1, 1e-4], point)
    assert (light_of(world, camera, 16) == light_of(world, again, 16)).all()


def test_motion_blur_of_a_moving_camera_has_the_closed_form_variance() -> None:
    """The image moves uniformly by s = f d / z pixels, which adds s² / 12 to the variance."""
    world = world_of([0.02, 0.02, 1e-4], [0, 0, 4])
    moving = camera_at(-0.1).moving(camera_at(0.1), exposure=0.01)
    length = F * 0.2 / 4
    (_, before), (mean, after) = (moments(light_of(world, camera, 1024)) for camera in (camera_at(), moving))
    assert after[0] - before[0] == pytest.approx(length**2 / 12, rel=0.02)
    assert after[1] == pytest.approx(before[1], abs=0.05)
    np.testing.assert_allclose(mean, [40, 30], atol=0.1)
    np.testing.assert_allclose(moving.C, [0, 0, 0], atol=1e-15)


@pytest.mark.parametrize(("direction", "sign"), [("down", 1), ("up", -1)])
def test_rolling_shutter_by_rows_skews_vertical_lines(
    direction: raycam.camera._optics.Readout, sign: int
) -> None:
    """A vertical line at depth z leans by f d / z over the image, because rows are read in turn."""
    world = world_of([0.05, 9.0, 1e-4], [0, 0, 4])
    rolling = camera_at(-0.1).moving(camera_at(0.1), readout=0.02, direction=direction)
    frame = raycam.render(world, rolling, integrator="flat", samples=1, channels=["instance", "position"])
    rows = np.arange(SIZE[1])
    columns = np.array([np.flatnonzero(row >= 0).mean() for row in frame["instance"]])
    share = (rows + 0.5) / SIZE[1]
    expected = 40 - sign * F * 0.2 / 4 * (share - 0.5)
    assert np.abs(columns - expected).max() <= 0.5 + 1e-9
    assert frame.reprojection_error() <= 1e-3


@pytest.mark.parametrize(("direction", "sign"), [("right", 1), ("left", -1)])
def test_rolling_shutter_by_columns_skews_horizontal_lines(
    direction: raycam.camera._optics.Readout, sign: int
) -> None:
    """A horizontal line leans, because columns are read in turn."""
    world = world_of([9.0, 0.05, 1e-4], [0, 0, 4])
    rolling = camera_at(0, -0.1).moving(camera_at(0, 0.1), readout=0.02, direction=direction)
    frame = raycam.render(world, rolling, integrator="flat", samples=1, channels=["instance", "position"])
    rows = np.array([np.flatnonzero(column >= 0).mean() for column in frame["instance"].T])
    share = (np.arange(SIZE[0]) + 0.5) / SIZE[0]
    assert np.abs(rows - (30 - sign * F * 0.2 / 4 * (share - 0.5))).max() <= 0.5 + 1e-9
    assert frame.reprojection_error() <= 1e-3


def test_vignetting_equals_the_polynomial() -> None:
    world = world_of([9, 9, 1e-4], [0, 0, 2])
    plain = raycam.render(world, camera_at(), integrator="flat", samples=4)["color"][..., 0]
    y, x = np.indices(plain.shape)
    squared = ((x - 40) ** 2 + (y - 30) ** 2) / F**2
    for camera, factor in (
        (camera_at().with_vignetting(cos4=True), (1 + squared) ** -2),
        (camera_at().with_vignetting(polynomial=[-2.0, 1.5]), 1 - 2 * squared + 1.5 * squared**2),
    ):
        dark = raycam.render(world, camera, integrator="flat", samples=4)["color"][..., 0]
        np.testing.assert_allclose(dark, plain * factor, rtol=2e-6)


def test_files_and_pickles_keep_all_optics(tmp_path: Path) -> None:
    camera = (
        camera_at(-0.1)
        .with_aperture(0.1, focus=2, blades=5, rotation=10)
        .with_vignetting(cos4=True, polynomial=[0.1])
        .moving(camera_at(0.1), exposure=0.01, readout=0.02)
    )
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert raycam.Camera.from_dict(camera.to_dict()) == camera
    world = world_of([1, 1, 1], [0, 0, 4])
    frame = raycam.render(world, camera, integrator="flat", samples=1)
    frame.save(tmp_path / "frame.npz")
    with np.load(tmp_path / "frame.npz") as saved:
        assert raycam.Camera.from_dict(json.loads(str(saved["camera"]))) == camera


def test_camera_with_parallel_rays_has_a_centre_at_infinity() -> None:
    camera = raycam.Camera.orthographic([0, 0, 5], pitch=90, height=2, size=(40, 30))
    assert camera.is_parallel
    assert np.allclose(camera.center, [0, 0, -1, 0])
    with raises(raycam.CameraError, code="unsupported_camera"):
        camera.C  # noqa: B018
    with raises(raycam.CameraError, code="invalid_camera", mentions=["aperture"]):
        camera.with_aperture(0.1, focus=1)
    affine = raycam.Camera.from_matrix(camera.P, camera.size)
    world = world_of([1, 1, 1], [0, 0, 0])
    channels = ["position", "depth"]
    one, two = (
        raycam.render(world, c, integrator="flat", samples=1, channels=channels) for c in (camera, affine)
    )
    np.testing.assert_allclose(one["position"], two["position"], atol=1e-9)
    assert one["depth"][15, 20] == pytest.approx(4.5)
    assert two["depth"][15, 20] == pytest.approx(-0.5)
    assert max(one.reprojection_error(), two.reprojection_error()) <= 1e-3


@pytest.mark.parametrize("far", [0.0, 1e6])
def test_positions_reproject_to_their_pixels_for_every_kind_of_camera(far: float) -> None:
    """The ray of a pixel hits a point that is projected back to the pixel."""
    shift = np.array([far, -far, far])
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, location=np.add(shift, [0.2, 0.1, 4]).tolist())
    world.add_object(box={"size": [20, 20, 0.1]}, location=np.add(shift, [0, 0, 8]).tolist())
    place = raycam.Camera(K, EYE, shift, SIZE)
    models: list[tuple[raycam.camera._arguments.Model, list[float]]] = [
        ("opencv", [-0.2, 0.05, 1e-3, -1e-3, 0.01]),
        ("opencv", [-0.2, 0.05, 1e-3, -1e-3, 0.01, 0.02, 0.01, 1e-3, 1e-3, -1e-3, 1e-3, 1e-3, 0.02, -0.01]),
        ("fisheye", [0.02, -0.01, 0.002, 0]),
        ("thin_prism_fisheye", [0.02, -0.01, 1e-3, 1e-3, 0, 0, 1e-3, 1e-3]),
        ("fov", [0.9]),
        ("division", [-0.2]),
        ("omni", [0.8, 0.02, -0.01, 1e-3, 1e-3]),
        ("eucm", [0.6, 1.1]),
        ("ds", [-0.2, 0.6]),
        ("equirectangular", []),
        ("cylindrical", []),
    ]
    cameras = [place]
    cameras += [
        raycam.Camera(K, EYE, shift, SIZE, model=model, distortion=numbers) for model, numbers in models
    ]
    cameras += [
        raycam.Camera.orthographic(shift, target=np.add(shift, [0, 0, 1]), height=4, size=SIZE, up="y"),
        place.moving(place.at_pose(EYE, np.add(shift, [0.2, 0.1, 0.1])), exposure=0.01, readout=0.02),
    ]
    for camera in cameras:
        frame = raycam.render(world, camera, integrator="flat", samples=1, channels=["position"])
        assert np.isfinite(frame["position"]).any(), camera
        assert frame.reprojection_error() <= (1e-2 if far else 1e-3), camera


def sliding(seconds: float = 1.0, speed: float = 1.0, rows: int = 64) -> tuple[raycam.World, raycam.Camera]:
    """A white vertical bar that slides to the right.

    At the bar's depth, the camera has 16 pixels per metre.
    """
    world = raycam.World()
    bar = world.add_object(box={"size": [1.0, 9.0, 0.001]}, name="bar", type="unlit", color=[1, 1, 1])
    assert bar == 0
    keys = [{"time": 0, "object": "bar", "location": [-speed * seconds / 2, 0, 4]}]
    keys.append({"time": seconds, "object": "bar", "location": [speed * seconds / 2, 0, 4]})
    world.set_video(seconds=seconds, keyframe=keys, interpolation="linear")
    k = [[64.0, 0, 63.5], [0, 64.0, rows / 2 - 0.5], [0, 0, 1]]
    return world, raycam.Camera(k, np.eye(3), [0, 0, 0], size=(128, rows))


def test_motion_blur_of_a_moving_bar_equals_a_trapezium() -> None:
    """A motion by s pixels blurs an edge to a ramp of s pixels, and a bar to a trapezium."""
    world, camera = sliding(speed=2.0)
    still = raycam.render(
        world.at(0.5), camera, samples=64, integrator="flat", channels=["color", "instance"]
    )
    seen = raycam.render(
        world.at(0.5),
        camera.exposing(0.5),
        samples=1024,
        integrator="flat",
        channels=["color", "instance", "depth"],
    )
    light = seen["color"][..., 0].mean(axis=0)
    # 16 pixels per metre: the bar is 16 pixels wide and moves by 16 pixels (2 m/s for half a second).
    x = np.arange(128) - 63.5
    expected = np.clip((16 - np.abs(x)) / 16, 0, 1)
    # The tolerance covers noise and the 64 moments of the exposure, which are 1/64 of the motion apart.
    np.testing.assert_allclose(light, expected, atol=0.04)
    assert abs(light.sum() - still["color"][..., 0].mean(axis=0).sum()) < 0.1
    # Labels show the middle of the exposure.
    assert (seen["instance"] == still["instance"]).all()
    assert (raycam.render(world, camera.exposing(0.5), samples=8, integrator="flat")["color"]
            == raycam.render(world, camera, samples=8, integrator="flat")["color"]).all()  # fmt: skip


def test_rolling_shutter_shows_a_moving_object_at_the_time_of_each_line() -> None:
    world, camera = sliding(speed=2.0)
    for direction, sign in (("down", 1), ("up", -1)):
        rolling = camera.exposing(0.0, readout=0.5, direction=direction)
        seen = raycam.render(world.at(0.5), rolling, samples=1, channels=["instance", "position"])
        rows = np.arange(64)
        time = sign * ((rows + 0.5) / 64 - 0.5) * 0.5
        middle = 63.5 + 16 * 2.0 * time
        columns = np.arange(128)[None, :]
        expected = np.abs(columns - middle[:, None]) < 8.0
        clear = np.abs(np.abs(columns - middle[:, None]) - 8.0) > 1e-6
        assert ((seen["instance"] == 0) == expected)[clear].all(), direction
        # With an exposure time, colours of a line are blurred, but its ground truth does not change.
        both = camera.exposing(0.25, readout=0.25, direction=direction)
        frame = raycam.render(
            world.at(0.5), both, samples=256, integrator="flat", channels=["color", "instance"]
        )
        time = sign * ((rows + 0.5) / 64 - 0.5) * 0.25
        middle = (63.5 + 16 * 2.0 * time)[:, None]
        off = np.abs(columns - middle)
        ramp = np.clip((12 - off) / 8, 0, 1)
        assert np.abs(frame["color"][..., 0] - ramp).mean() < 0.01
        assert ((frame["instance"] == 0) == (off < 8.0))[np.abs(off - 8.0) > 1e-6].all()


def test_camera_that_follows_an_object_shows_it_without_blur() -> None:
    world, camera = sliding(speed=2.0)
    world.set_video(
        seconds=1.0,
        interpolation="linear",
        keyframe=[
            {"time": 0, "object": "bar", "location": [-1, 0, 4]},
            {"time": 0, "location": [-1, 0, 0]},
            {"time": 1, "object": "bar", "location": [1, 0, 4]},
            {"time": 1, "location": [1, 0, 0]},
        ],
    )
    along = world.camera_at(camera.exposing(0.5), 0.5)
    np.testing.assert_allclose(along.location, [0, 0, 0], atol=1e-12)
    assert len(along.shutter["track"]) == 33
    frame = raycam.render(world.at(0.5), along, samples=256, integrator="flat", channels=["color"])
    still = raycam.render(world.at(0.5), camera, samples=256, integrator="flat", channels=["color"])
    off = np.abs(frame["color"] - still["color"]).mean(axis=(0, 2))
    assert off.max() < 0.2
    assert off[np.abs(np.abs(np.arange(128) - 63.5) - 8) > 1].max() == 0.0


def test_motion_blur_does_not_depend_on_threads_or_regions() -> None:
    world, camera = sliding()
    rolling = camera.exposing(0.25, readout=0.5)
    whole = raycam.render(world.at(0.5), rolling, samples=4, channels=["color", "depth"], threads=1)
    again = raycam.render(world.at(0.5), rolling, samples=4, channels=["color", "depth"], threads=2)
    part = raycam.render(
        world.at(0.5), rolling, samples=4, channels=["color", "depth"], region=(40, 9, 50, 33)
    )
    for name in ("color", "depth"):
        assert whole[name].tobytes() == again[name].tobytes()
        assert (part[name] == whole[name][9:42, 40:90]).all()
