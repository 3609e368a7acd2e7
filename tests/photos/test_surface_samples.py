"""Random points on surfaces against closed forms and statistics."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
import scipy.stats
import trimesh
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


def test_points_visible_to_a_camera_are_on_the_cap_that_it_sees() -> None:
    world, distance = ball_world(), 3.0
    camera = raycam.Camera.look_at([0, 0, distance], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 64))
    found = raycam.sample_surface(world, 5000, visible_to={"a": camera})
    assert len(found.points) == 5000
    height = found.points[:, 2]
    # The cap above 1 / distance; heights on a sphere are uniform (Archimedes).
    assert height.min() > 1 / distance - 0.03
    assert scipy.stats.kstest(height, "uniform", args=(1 / distance, 1 - 1 / distance)).pvalue > 1e-4
    assert (raycam.sample_surface(world, 5000).points[:, 2] < 0).mean() == pytest.approx(0.5, abs=0.03)


def test_points_behind_an_occluder_are_omitted() -> None:
    world = ball_world()
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], fov=60, size=(64, 64))
    world.add_object(plane={"size": [10, 10]}, location=[5, 0, 2], name="lid")  # hides x > 0
    found = raycam.sample_surface(world, 2000, visible_to=[camera], objects="ball")
    assert found.points[:, 0].max() < 1e-9
    assert set(found.ids[:, 0]) == {0}
    with raises(raycam.WorldError, code="nothing_visible", mentions=["0 of"]):
        world.add_object(plane={"size": [10, 10]}, location=[-5, 0, 2])
        raycam.sample_surface(world, 1, visible_to=[camera], objects="ball")


def test_same_points_for_any_threads_and_other_points_for_another_seed() -> None:
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
