"""Near infrared light, compared with the radiance of sunlit diffuse surfaces and images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from lidar.conftest import beams, quad


def sunny(**keys: object) -> raycam.World:
    """A floor with 40 % reflectance in red, under a sun at 60 degrees from the zenith.

    A wall shades the floor's left part.
    """
    world = raycam.World()
    quad(world, [0, 0, 0], [50, 0, 0], [0, 50, 0], "floor", color=[0.4, 0.9, 0.1], **keys)
    quad(world, [0, 20, 2], [-50, 0, 0], [0, 0, 2], "wall", color=[0.0] * 3)
    world.add_light("sun", irradiance=800.0, direction=[0.0, -np.sin(np.pi / 3), -0.5])
    return world


def down(world: raycam.World, y: float, **settings: object) -> raycam.Scan:
    lidar = beams(3, noise=False, **settings).placed([0, y, 5], pitch=90)
    return raycam.scan(world, lidar)


def test_sunlit_floor_has_the_radiance_of_a_diffuse_surface() -> None:
    """The radiance is (rho / pi) E cos(60 degrees), and 0 in the wall's shadow of 6.9 m."""
    found = down(sunny(), 10.0, near_ir_samples=4)["near_ir"]
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, 0.4 / np.pi * 800 * 0.5, rtol=1e-4)
    np.testing.assert_allclose(down(sunny(), 16.0, near_ir_samples=4)["near_ir"], 0.0, atol=1e-6)


def test_near_infrared_equals_the_red_channel_of_an_image(tmp_path: Path) -> None:
    """A floor next to a red wall under a sky, with the render settings of the world file."""
    (tmp_path / "world.toml").write_text(
        """
        render = { integrator = "path", max_depth = 4 }
        light = [{ type = "sky", radiance = 1 }]
        object = [
            { plane = { size = [99, 99] }, color = [0.5, 0.5, 0.5] },
            { box = { size = [1, 99, 10] }, location = [3, 0, 5], color = [0.9, 0.1, 0.1] },
        ]
        """
    )
    world = raycam.load(tmp_path / "world.toml")
    camera = raycam.Camera.from_pose([0, 0, 5], pitch=89.9, fov=1.0, size=(8, 8))
    image = raycam.render(world, camera, samples=64)["color"][..., 0].mean()
    assert image == pytest.approx(0.43, abs=0.02)
    assert down(world, 0.0, near_ir_samples=2048)["near_ir"].mean() == pytest.approx(float(image), rel=0.03)


def test_near_infrared_is_absent_without_samples_and_the_same_for_any_number_of_threads() -> None:
    world = sunny()
    assert "near_ir" not in down(world, 10.0)
    lidar = raycam.Lidar("os1-16", mode="512x10", near_ir_samples=2).placed([0, 0, 2])
    one, two = (raycam.scan(world, lidar, threads=n)["near_ir"] for n in (1, 2))
    assert one.tobytes() == two.tobytes()
    assert len(np.unique(one)) > 1


def test_near_infrared_of_a_moving_world_is_measured_at_the_time_of_each_pulse() -> None:
    """The wall that shades the floor moves away."""
    world = raycam.World()
    quad(world, [0, 0, 0], [50, 0, 0], [0, 50, 0], "floor", color=[0.4] * 3)
    world.add_object(box={"size": [9, 9, 1]}, name="roof", location=[0, 0, 20], color=[0.0] * 3)
    world.add_light("sun", irradiance=800.0, direction=[0.0, 0.0, -1.0])
    keys = [{"time": t, "object": "roof", "location": [0, 90 * t, 20]} for t in (0.0, 1.0)]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    times = np.array([0.0, 0.01, 0.09])
    lidar = raycam.Lidar.of([[0, 0, -1]] * 3, times=times, noise=False, near_ir_samples=2).placed([0, 0, 5])
    found = raycam.scan(world.at(0.0), lidar)["near_ir"]
    np.testing.assert_allclose(found, [0, 0, 0.4 / np.pi * 800], rtol=1e-4, atol=1e-6)


def test_near_infrared_is_measured_along_the_axis_of_the_beam() -> None:
    """A wire next to the beam's axis returns the echo; the axis itself points to the sky."""
    world = raycam.World()
    quad(world, [20, 0.06, 0], [0, -0.05, 0], [0, 0, 0.5], "wire", color=[0.9] * 3)
    world.add_light("sky", radiance=3.0)
    lidar = beams(1, noise=False, beam_samples=37, beam_divergence=0.01, near_ir_samples=4)
    scan = raycam.scan(world, lidar)
    assert scan["instance"].tolist() == [0]
    assert scan["near_ir"][0] == pytest.approx(3.0, rel=1e-4)
