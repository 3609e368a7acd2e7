"""Coplanar surfaces of several objects.

Ids, colours and queries show the last object.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from raycam.notices import Notice

RED, GREEN = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]


def rotation(axis: list[float], angle: float) -> npt.NDArray[np.float64]:
    """The rotation matrix by Rodrigues' formula; the angle is in degrees."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(angle)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def grid(size: float, cells: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    """A square in the plane z = 0, divided into cells."""
    line = np.linspace(-size / 2, size / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    corner = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1]
    a = corner.ravel()
    b = a + cells + 1
    triangles = np.stack([a, a + 1, b + 1, a, b + 1, b], axis=1).reshape(-1, 3)
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), triangles.astype(np.int32)


Pose = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]

POSES: dict[str, Pose] = {
    "level": (np.eye(3), np.zeros(3)),
    "tilted": (rotation([1, 2, 3], 47), np.array([3.1, -2.7, 1.3])),
    "far away": (rotation([2, -1, 1], 110), np.array([452_000.3, 5_410_000.7, 310.1])),
}
ELEVATIONS = {"steep": 60.0, "grazing": 4.0}


def scene(pose: Pose, elevation: float, last: str, **style: Any) -> tuple[raycam.World, raycam.Camera]:
    """A floor of six metres and a carpet of two metres in its middle, in the same plane."""
    turn, place = pose
    parts: dict[str, tuple[float, int, list[float]]] = {"floor": (6.0, 3, RED), "carpet": (2.0, 7, GREEN)}
    world = raycam.World()
    for name in sorted(parts, key=lambda name: name == last):
        size, cells, color = parts[name]
        vertices, triangles = grid(size, cells)
        extra = style if name == "carpet" else {}
        world.add_mesh(vertices @ turn.T + place, triangles, name=name, color=color, type="unlit", **extra)
    world.add_light("sky", radiance=0.0)
    across, height = np.cos(np.radians(elevation)), np.sin(np.radians(elevation))
    eye = turn @ np.array([0.0, -5 * across, 5 * height]) + place
    up = turn @ np.array([0.0, 0.0, 1.0])
    return world, raycam.Camera.look_at(eye, place, size=(96, 64), fov=30, up=up)


def on_carpet(pose: Pose, camera: raycam.Camera) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Masks of the pixels entirely on the carpet, and of those entirely beside it.

    They are computed with the homography of the plane.
    """
    turn, place = pose
    width, height = camera.size
    x, y = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    origins, directions = camera.rays(np.stack([x, y], axis=-1).reshape(-1, 2))
    local, along = (origins - place) @ turn, directions @ turn
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -local[:, 2] / along[:, 2]
        points = local + t[:, None] * along
    distance = np.where(t > 0, np.abs(points[:, :2]).max(axis=1), np.inf).reshape(height + 1, width + 1)
    inside = distance < 1 - 1e-3
    outside = (distance > 1 + 1e-3) & (distance < 3 - 1e-3)
    corners = [np.s_[:-1, :-1], np.s_[1:, :-1], np.s_[:-1, 1:], np.s_[1:, 1:]]
    return np.logical_and.reduce([inside[c] for c in corners]), np.logical_and.reduce(
        [outside[c] for c in corners]
    )


@pytest.mark.parametrize("last", ["floor", "carpet"])
@pytest.mark.parametrize("elevation", ELEVATIONS.values(), ids=ELEVATIONS.keys())
@pytest.mark.parametrize("pose", POSES.values(), ids=POSES.keys())
def test_ids_colors_and_queries_show_the_last_object(pose: Pose, elevation: float, last: str) -> None:
    world, camera = scene(pose, elevation, last)
    inside, outside = on_carpet(pose, camera)
    assert inside.sum() > 20
    names = [item.name for item in world.objects]
    expected = names.index(last)
    for integrator, samples in [("flat", 1), ("flat", 8), ("direct", 8), ("path", 16)]:
        with pytest.warns(Notice) as warned:
            frame = raycam.render(world, camera, integrator=integrator, samples=samples, filter="box")
        assert {"coplanar_surfaces"} == {getattr(w.message, "code", "") for w in warned}
        found = re.search(r"(\d+) pixel", str(next(iter(warned)).message))
        assert found is not None
        count = int(found[1])
        assert inside.sum() <= count <= (~outside).sum()
        assert (frame["instance"][inside] == expected).all()
        assert (frame["instance"][outside] == names.index("floor")).all()
        color = [RED, GREEN][last == "carpet"]
        assert np.abs(frame["color"][inside] - color).max() < 1e-6
    depth = frame["depth"][inside]
    assert np.isfinite(depth).all()
    rows, columns = np.nonzero(inside)
    origins, directions = camera.rays(np.stack([columns, rows], axis=1).astype(float))
    hits = world.cast_rays(origins, directions)
    assert (hits["instance"] == expected).all()
    float32 = world.cast_rays(origins, directions, exact=False)
    assert (float32["instance"] == expected).all()


def test_surfaces_that_are_apart_are_ordered_by_distance() -> None:
    """A carpet 20 micrometres above the floor is visible; 20 micrometres below, it is hidden.

    No notice is given.
    """
    for height in (2e-5, -2e-5):
        world = raycam.World()
        world.add_object(name="carpet", plane={"size": 2}, location=[0, 0, height], color=GREEN, type="unlit")
        world.add_object(name="floor", plane={"size": 6}, color=RED, type="unlit")
        world.add_light("sky", radiance=0.0)
        camera = raycam.Camera.look_at([0, -3, 3], [0, 0, 0], size=(32, 32), fov=30)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frame = raycam.render(world, camera, integrator="flat", samples=8)
        middle = np.s_[12:20, 12:20]
        assert (frame["instance"][middle] == (0 if height > 0 else 1)).all()
        np.testing.assert_allclose(
            frame["color"][middle], np.broadcast_to(GREEN if height > 0 else RED, (8, 8, 3))
        )


@pytest.mark.parametrize("samples", [1, 16])
def test_hidden_and_transparent_coplanar_objects_are_skipped(samples: int) -> None:
    pose = POSES["tilted"]
    transparent = np.zeros((4, 4, 4), np.uint8)
    for style in ({"visible": {"camera": False}}, {"texture": transparent, "alpha": "blend"}):
        world, camera = scene(pose, 40.0, "carpet")
        carpet = world.objects[1]
        assert carpet.name == "carpet"
        world = raycam.World()
        for size, color, extra in ((6, RED, {}), (2, GREEN, style)):
            world.add_object(plane={"size": size}, color=color, type="unlit", **extra)
        world.add_light("sky", radiance=0.0)
        camera = raycam.Camera.look_at([0.3, -3, 2.1], [0, 0, 0], size=(32, 32), fov=30)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            frame = raycam.render(world, camera, integrator="path", samples=samples, surface="solid")
        np.testing.assert_allclose(frame["color"], np.broadcast_to(RED, (32, 32, 3)), atol=1e-6)
        assert (frame["instance"] == 0).all()


def test_images_of_coplanar_surfaces_are_equal_for_every_number_of_threads() -> None:
    world, camera = scene(POSES["tilted"], 4.0, "carpet")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        one, two = (raycam.render(world, camera, integrator="path", samples=8, threads=n) for n in (1, 2))
    for name in ("color", "depth", "instance", "triangle"):
        np.testing.assert_array_equal(one[name], two[name])
