"""Light paths: their mean equals the image."""

from __future__ import annotations

import numpy as np
import pytest
import raycam


def room(albedo: float) -> raycam.World:
    """A closed box with one albedo, lit by a lamp inside."""
    world = raycam.World()
    world.add_object(box={"size": 4}, color=[albedo, albedo / 2, 0.1], name="room")
    world.add_object(box={"size": 0.6}, location=[0.5, 0.5, -1], color=[0.2, 0.6, 0.3], name="crate")
    world.add_light({"type": "point", "position": [0.5, -0.6, 1], "power": 40})
    return world


def test_mean_of_many_paths_equals_the_pixel() -> None:
    world = room(0.8)
    camera = raycam.Camera.look_at([-1.5, -1.5, 0.5], [0.5, 0.5, -0.8], size=(8, 8), fov=60)
    explanation = raycam.explain(world, camera, (4, 3))
    origin, direction = camera.rays([4, 3])
    narrow = raycam.Camera.look_at(origin, origin + direction, size=(1, 1), focal=1e5)
    wanted = raycam.render(world, narrow, integrator="path", samples=4096, max_depth=4)["color"][0, 0]
    found = np.array([explanation.light_path(seed, 3).radiance for seed in range(120)])
    error = found.std(axis=0) / np.sqrt(len(found))
    assert (np.abs(found.mean(axis=0) - wanted) < 4 * error + 0.01 * wanted).all()
    assert (error < 0.2 * wanted).all()


def test_path_weights_of_matte_surfaces_equal_their_albedo() -> None:
    camera = raycam.Camera.look_at([-1.5, -1.5, 0.5], [1.9, 1.9, 0.5], size=(8, 8), fov=30)
    path = raycam.explain(room(0.8), camera, (4, 4)).light_path(seed=3)
    weight = np.ones(3)
    albedos = {"room": [0.8, 0.4, 0.1], "crate": [0.2, 0.6, 0.3]}
    for bounce in path.bounces:
        assert np.allclose(bounce.weight, weight, rtol=1e-3)
        weight = weight * albedos[bounce.object_name]
    assert len(path.bounces) > 2


def test_escaping_path_ends_in_the_sky_and_equal_seeds_give_equal_paths() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [9, 9]})
    world.add_light({"type": "sky", "radiance": 1})
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(8, 8), fov=30)
    explanation = raycam.explain(world, camera, (4, 4))
    path = explanation.light_path(seed=1)
    assert [each.object_name for each in path.bounces] == [world.objects[0].name, "the sky"]
    assert not path.bounces[1].gathered.any()  # the sky's light is part of the floor's direct light
    assert np.array_equal(path.points, explanation.light_path(seed=1).points)
    assert not np.array_equal(path.points, explanation.light_path(seed=2).points)
    assert all(each.object_name in str(path) for each in path.bounces)
    up = raycam.explain(world, raycam.Camera.look_at([0, 0, 1], [0, 1, 3], size=(8, 8), fov=30), (4, 4))
    assert up.light_path().radiance == pytest.approx([1, 1, 1], rel=1e-5)
