"""Light from textured surfaces: samples follow the brightness of single texels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import raycam

MITSUBA_ERROR = {"dot": 0.0084, "dots": 0.0664, "gradient": 0.0621, "noise": 0.0679, "half": 0.0550}
"""Root mean square error relative to the mean of Mitsuba 3.7 (`path`, `max_depth` 2, 64 independent samples)."""


def pattern(kind: str, size: int = 128) -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(5)
    image = np.zeros((size, size, 3), np.float32)
    if kind == "dot":
        image[size // 3, size // 4] = 1
    elif kind == "dots":
        image[rng.random((size, size)) < 0.01] = 1
    elif kind == "gradient":
        image[:] = np.linspace(0, 1, size)[None, :, None]
    elif kind == "noise":
        image[:] = rng.random((size, size, 1)) ** 4
    else:
        image[:, : size // 2] = 1
    return image


def floor(kind: str, samples: int, seed: int, **lamp: object) -> npt.NDArray[np.float64]:
    """The floor under a lamp of one square metre, a metre above it, whose mean radiance is 1."""
    image = pattern(kind)
    world = raycam.World()
    world.add_object(plane={"size": 6}, color=[0.8] * 3)
    placed = {"plane": {"size": 1}, "location": [0, 0, 1], "roll": 180, **lamp}
    light = {"emission": 1 / float(image.mean()), "textures": {"emission": image}}
    world.add_object(placed, color=[0, 0, 0], **light)
    world.add_light("sky", radiance=0)
    camera = raycam.Camera.look_at([0, -3, 1.2], [0, 0, 0.2], size=(32, 32), fov=40)
    frame = raycam.render(
        world, camera, integrator="direct", samples=samples, seed=seed, channels="color", filter="box"
    )
    return np.asarray(frame["color"][17:, :, 1], dtype=float)


@pytest.mark.parametrize("kind", MITSUBA_ERROR)
def test_errors_of_textured_lights_are_not_larger_than_those_of_mitsuba(kind: str) -> None:
    exact = floor(kind, 4096, 1)
    errors = [floor(kind, 64, seed) - exact for seed in range(10, 14)]
    error = float(np.sqrt(np.mean(np.square(errors)))) / exact.mean()
    assert error < 1.15 * MITSUBA_ERROR[kind] + 1e-3


@pytest.mark.parametrize("kind", ["dot", "noise"])
def test_turned_textures_have_the_light_of_the_closed_form(kind: str) -> None:
    """The irradiance on a floor is the sum over texels (Lambert's cosine law at both ends)."""
    yaw = 30.0
    image = pattern(kind)[..., 0].astype(float)
    image /= image.mean()
    found = floor(kind, 1024, 3, yaw=yaw)
    camera = raycam.Camera.look_at([0, -3, 1.2], [0, 0, 0.2], size=(32, 32), fov=40)
    rows, columns = np.mgrid[17:32, 0:32]
    origins, directions = camera.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
    points = origins - directions * (origins[:, 2:] / directions[:, 2:])
    world = raycam.World()
    world.add_object({"plane": {"size": 1}, "location": [0, 0, 1], "roll": 180, "yaw": yaw})
    middles = (np.arange(128) + 0.5) / 128 - 0.5
    x, y = np.meshgrid(middles, middles)
    turn = np.radians(yaw)
    places = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)], axis=-1)
    hits = world.cast_rays(
        np.concatenate([places, np.zeros((128, 128, 1))], axis=-1), [0.0, 0.0, 1.0], fields=("uv",)
    )
    u, v = np.moveaxis(hits["uv"], -1, 0)
    texels = image[np.clip((v * 128).astype(int), 0, 127), np.clip((u * 128).astype(int), 0, 127)]
    offsets = places.reshape(1, -1, 2) - points[:, None, :2]
    squared = (offsets**2).sum(axis=-1) + 1
    expected = (0.8 / np.pi / 128**2 * texels.reshape(-1) / squared**2).sum(axis=1)
    np.testing.assert_allclose(found.reshape(-1).mean(), expected.mean(), rtol=0.01)
    assert np.abs(found.reshape(-1) - expected).max() < 0.1 * expected.mean()
