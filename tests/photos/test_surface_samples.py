"""Random points on surfaces against closed forms and statistics."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import raycam
import scipy.stats
import trimesh
from raycam.photos.face_samples import sample_pattern
from support.raises import raises


def ball_world() -> raycam.World:
    world = raycam.World()
    world.add_object(sphere={"radius": 1, "level": 4}, name="ball")
    return world


def test_points_are_uniform_by_area() -> None:
    world = raycam.World()
    world.add_object(box={"size": [1, 2, 3]}, name="box")
    found = raycam.sample_surface(world, 20_000, seed=3)
    corners = world.triangles()
    areas = trimesh.triangles.area(corners)
    counts = np.bincount(found.ids[:, 1], minlength=len(areas))
    assert scipy.stats.chisquare(counts, areas / areas.sum() * 20_000).pvalue > 1e-3
    bary = trimesh.triangles.points_to_barycentric(corners[found.ids[:, 1]], found.points)
    assert bary.min() > -1e-9
    # Each weight of a point in a triangle has the distribution 1 - (1 - w)^2.
    for weight in bary.T:
        assert scipy.stats.kstest(weight, lambda w: 1 - (1 - np.clip(w, 0, 1)) ** 2).pvalue > 1e-3
    np.testing.assert_allclose(np.abs(found.normals).max(axis=1), 1)


def test_points_visible_to_a_camera_are_uniform_on_the_visible_cap() -> None:
    world, distance = ball_world(), 3.0
    camera = raycam.Camera.look_at([0, 0, distance], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 64))
    found = raycam.sample_surface(world, 5000, visible_to={"a": camera})
    assert len(found.points) == 5000
    height = found.points[:, 2]
    # The visible cap is above the height 1 / distance; heights of points on a sphere are uniform (Archimedes).
    assert height.min() > 1 / distance - 0.03
    assert scipy.stats.kstest(height, "uniform", args=(1 / distance, 1 - 1 / distance)).pvalue > 1e-4
    assert (raycam.sample_surface(world, 5000).points[:, 2] < 0).mean() == pytest.approx(0.5, abs=0.03)


def fan(count: int, **settings: Any) -> raycam.Lidar:
    """A lidar with `count` pulses in random directions below the horizon."""
    ways = np.random.default_rng(3).normal(size=(count, 3))
    ways[:, 2] = -np.abs(ways[:, 2])
    return raycam.Lidar.of(ways, noise=False, **settings)


def test_points_visible_to_a_lidar_are_on_the_disc_within_its_range() -> None:
    world = raycam.World()
    x, y = np.meshgrid(np.linspace(-6, 6, 49), np.linspace(-6, 6, 49), indexing="ij")
    a = (np.arange(48)[:, None] * 49 + np.arange(48)).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 49, a + 50], 1), np.stack([a, a + 50, a + 1], 1)])
    world.add_mesh(np.stack([x, y, 0 * x], 2).reshape(-1, 3), faces, name="floor", color=[0.5] * 3)
    lidar = fan(60_000, max_range=5.0).placed([0, 0, 3])
    found = raycam.sample_surface(world, 2000, visible_to={"top": lidar})
    radius = np.hypot(found.points[:, 0], found.points[:, 1])
    # The disc within the lidar's range has the radius 4; faces at its border extend by a diagonal of up to 0.4.
    assert radius.max() < 4 + 0.4
    # For points that are uniform by area, the squares of the radii are uniform. Faces at the border are excluded.
    inner = radius[radius < 3.6] ** 2
    assert scipy.stats.kstest(inner, "uniform", args=(0, 3.6**2)).pvalue > 1e-4
    camera = raycam.Camera.look_at([0, 0, 3], [5.3, 0, 0], up=[0, 0, 1], fov=10, size=(64, 64))
    both = raycam.sample_surface(world, 2000, visible_to=[lidar, camera])
    beyond = np.hypot(both.points[:, 0], both.points[:, 1]) > 4.4
    assert 0 < beyond.mean() < 0.5
    with raises(raycam.WorldError, code="nothing_visible", mentions=["0 of"]), warnings.catch_warnings():
        warnings.simplefilter("ignore", raycam.Notice)
        raycam.sample_surface(world, 1, visible_to=[lidar.placed([0, 0, 30])])


def test_points_visible_to_a_lidar_are_nearest_to_a_measured_sample_by_brute_force() -> None:
    world = raycam.World()
    world.add_object(box={"size": [4, 5, 3]}, name="room", location=[0, 0, 1.5], color=[0.5] * 3)
    world.add_object(box={"size": [1, 1, 1]}, name="table", location=[1, 1, 0.5], color=[0.5] * 3)
    lidar = fan(3000).placed([-0.5, -0.7, 1.6])
    found = raycam.sample_surface(world, 300, visible_to=[lidar], facing="both")
    scan = raycam.scan(world, lidar)
    measured = np.stack([scan["instance"], scan["triangle"]], axis=1)
    faces = {tuple(row): number for number, row in enumerate(world.triangle_ids().tolist())}
    corners = world.triangles()
    seen = raycam.surface_visibility(world, [lidar], facing="both")
    visible_area = (seen.fraction * trimesh.triangles.area(corners)).sum()
    assert 0.1 < visible_area / trimesh.triangles.area(corners).sum() < 0.95
    for point, face in zip(found.points, found.ids.tolist(), strict=True):
        own = scan["true_position"][(measured == face).all(axis=1)]
        count = int(np.clip(np.ceil(len(own) / 16), 4, 256))
        samples = sample_pattern(count) @ corners[faces[tuple(face)]]
        marked = {int(np.linalg.norm(samples - each, axis=1).argmin()) for each in own}
        assert int(np.linalg.norm(samples - point, axis=1).argmin()) in marked


def test_points_behind_an_occluder_are_omitted() -> None:
    world = ball_world()
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 64))
    # The lid hides points with x > 0.
    world.add_object(plane={"size": [10, 10]}, location=[5, 0, 2], name="lid")
    found = raycam.sample_surface(world, 2000, visible_to=[camera], objects="ball")
    assert found.points[:, 0].max() < 1e-9
    assert set(found.ids[:, 0]) == {0}
    with raises(raycam.WorldError, code="nothing_visible", mentions=["0 of"]):
        world.add_object(plane={"size": [10, 10]}, location=[-5, 0, 2])
        raycam.sample_surface(world, 1, visible_to=[camera], objects="ball")


def test_sampled_points_depend_on_the_seed_but_not_on_threads() -> None:
    world = ball_world()
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 64))
    one, two, other = (
        raycam.sample_surface(world, 500, visible_to=[camera], threads=threads, seed=seed).points
        for threads, seed in ((1, 7), (2, 7), (1, 8))
    )
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("options", [{"count": 0}, {"count": 5, "seed": -1}, {"count": 5, "facing": "back"}])
def test_invalid_arguments_are_refused(options: dict) -> None:
    with pytest.raises(raycam.SettingsError):
        raycam.sample_surface(ball_world(), **options)
    with raises(raycam.WorldError, code="nothing_visible"):
        raycam.sample_surface(raycam.World(), 5)
