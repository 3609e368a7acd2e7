"""Motion blur compared with its closed form.

The number of moments of an exposure follows the motion in the image.
"""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from raycam.notices import Notice

SIZE = (640, 4)
SAMPLES = 2048


def sweep(pixels: float, bar: float, objects: int = 1) -> tuple[raycam.World, raycam.Camera]:
    """A white bar that moves during an exposure of one second, seen from above.

    `bar` is its width in pixels.
    """
    world = raycam.World()
    for i in range(objects):
        y = 0.0 if i == 0 else 1e5 + i
        world.add_object(
            name=f"bar{i}", plane={"size": [bar, 100]}, location=[0, y, 0], color=[1, 1, 1], type="unlit"
        )
    world.add_light("sky", radiance=0.0)
    ends = [(0, -pixels / 2), (1, pixels / 2)]
    keys = [{"time": t, "object": "bar0", "location": [x, 0, 0], "interpolation": "linear"} for t, x in ends]
    world.set_video(fps=1, seconds=1, keyframe=keys)
    # One metre is one pixel.
    distance = 2000.0
    K = [[distance, 0, (SIZE[0] - 1) / 2], [0, distance, (SIZE[1] - 1) / 2], [0, 0, 1]]
    camera = raycam.Camera(K, np.diag([1.0, -1.0, -1.0]), [0, 0, distance], SIZE)
    return world.at(0.5), camera.exposing(1.0)


def profile(world: raycam.World, camera: raycam.Camera) -> npt.NDArray[np.float64]:
    """Mean brightness of each column."""
    frame = raycam.render(world, camera, integrator="flat", samples=SAMPLES, filter="box", channels="color")
    return np.asarray(frame["color"][..., 1].mean(axis=0), dtype=float)


def coverage(pixels: float, bar: float) -> npt.NDArray[np.float64]:
    """Fraction of the exposure during which the bar covers a column, by fine integration."""
    edges = np.arange(SIZE[0] + 1) - SIZE[0] / 2
    middles = np.linspace(-pixels / 2, pixels / 2, 20_001)[:, None]
    overlap = np.minimum(edges[1:], middles + bar / 2) - np.maximum(edges[:-1], middles - bar / 2)
    return np.asarray(np.clip(overlap, 0, None).mean(axis=0))


@pytest.mark.parametrize("pixels", [40.0, 150.0, 500.0])
def test_a_moving_bar_leaves_no_stripes(pixels: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = profile(*sweep(pixels, 2.0))
    expected = coverage(pixels, 2.0)
    # Far from the ends of the motion, the bar covers every column for the same time.
    middle = np.abs(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) < pixels / 2 - 6
    assert found[middle].std() < 0.12 * expected[middle].mean()
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    assert np.abs(np.cumsum(found - expected)).max() < 0.02 * expected.sum()


def test_a_rotating_bar_leaves_no_spokes() -> None:
    """A bar that makes half a turn covers each point of a circle for the same time."""
    world = raycam.World()
    world.add_object(name="bar", plane={"size": [150, 2]}, color=[1, 1, 1], type="unlit")
    world.add_light("sky", radiance=0.0)
    keys = [{"time": t, "object": "bar", "yaw": 180.0 * t, "interpolation": "linear"} for t in (0, 1)]
    world.set_video(fps=1, seconds=1, keyframe=keys)
    size, distance = 160, 2000.0
    K = [[distance, 0, (size - 1) / 2], [0, distance, (size - 1) / 2], [0, 0, 1]]
    camera = raycam.Camera(K, np.diag([1.0, -1.0, -1.0]), [0, 0, distance], (size, size))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        frame = raycam.render(
            world.at(0.5),
            camera.exposing(1.0),
            integrator="flat",
            samples=256,
            filter="box",
            channels="color",
        )
    y, x = np.indices((size, size)) - (size - 1) / 2
    radius, degree = np.hypot(x, y), np.degrees(np.arctan2(y, x)).astype(int)
    ring = np.abs(radius - 62) < 8
    found = frame["color"][..., 1]
    # A bar of width w at radius r covers a direction for w / (pi r) of half a turn.
    expected = 2 / (np.pi * radius)
    assert found[ring].mean() == pytest.approx(expected[ring].mean(), rel=0.05)
    sectors = [
        found[ring & (degree == d)].sum() / expected[ring & (degree == d)].sum() for d in range(-170, 170)
    ]
    assert np.std(sectors) < 0.2  # the value would be 0.4 if all pixels shared 64 moments


def test_motion_beyond_the_largest_number_of_moments_is_reported() -> None:
    world, camera = sweep(500.0, 2.0, objects=200)
    with pytest.warns(Notice) as warned:
        raycam.render(world, camera, integrator="flat", samples=4, channels="color")
    messages = {getattr(w.message, "code", ""): str(w.message) for w in warned}
    assert set(messages) == {"coarse_motion_blur"}
    assert "500 pixels" in messages["coarse_motion_blur"]
    assert "256 moments" in messages["coarse_motion_blur"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        raycam.render(world, camera, integrator="flat", samples=4, channels="depth")
