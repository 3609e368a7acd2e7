"""Rays with times, compared with worlds at these times and with closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.bending_plate import bending_plate
from support.raises import raises, warns

FIELDS = ["t", "instance", "triangle", "barycentric", "normal", "position", "front", "uv", "albedo"]


def moving_world(objects: int = 6) -> raycam.World:
    """Boxes that turn and drift along splines in front of a fixed wall."""
    world = raycam.World()
    world.add_object(box={"size": [0.2, 12, 8]}, name="wall", location=[6, 0, 0])
    keys: list[dict[str, Any]] = []
    random = np.random.default_rng(4)
    for number in range(objects):
        world.add_object(box={"size": 0.9}, name=f"box {number}", color="tomato")
        for time in (0.0, 0.3, 0.6, 1.0):
            place = random.uniform([-1, -3, -2], [3, 3, 2])
            turn = random.uniform(-180, 180, 2)
            keys.append(
                {
                    "time": time,
                    "object": f"box {number}",
                    "location": place.tolist(),
                    "yaw": turn[0],
                    "pitch": turn[1],
                }
            )
    world.set_video(fps=10, seconds=1, keyframe=keys)
    return world


def random_rays(count: int) -> tuple[Any, Any, Any]:
    random = np.random.default_rng(7)
    origins = random.uniform(-0.5, 0.5, (count, 3)) - [5, 0, 0]
    directions = random.normal([1, 0, 0], [0.1, 0.4, 0.3], (count, 3))
    times = np.round(random.uniform(0, 0.5, count), 2)
    return origins, directions, times


@pytest.mark.parametrize(
    "limits", [{}, {"exact": False}, {"facing": "front"}, {"objects": ["wall", "box 2"]}]
)
def test_timed_rays_hit_the_world_at_their_times(limits: Any) -> None:
    world, start = moving_world(), 0.25
    origins, directions, times = random_rays(4000)
    t_max = np.random.default_rng(1).uniform(3, 15, len(times))
    timed = world.at(start).cast_rays(origins, directions, t_max=t_max, times=times, fields=FIELDS, **limits)
    hidden = world.at(start).occluded(origins, directions, t_max=t_max, times=times, **limits)
    for time in np.unique(times):
        rays = times == time
        moment = world.at(start + time)
        expected = moment.cast_rays(
            origins[rays], directions[rays], t_max=t_max[rays], fields=FIELDS, **limits
        )
        for name in FIELDS:
            np.testing.assert_array_equal(timed[name][rays], expected[name])
        np.testing.assert_array_equal(
            hidden[rays], moment.occluded(origins[rays], directions[rays], t_max=t_max[rays], **limits)
        )
    assert np.count_nonzero(timed["instance"] > 0) > 500 or limits.get("objects")
    assert len(np.unique(times)) > 40


def test_timed_rays_skip_the_triangle_of_each_ray() -> None:
    world = moving_world().at(0)
    origins, directions, times = random_rays(2000)
    first = world.cast_rays(origins, directions, times=times)
    skip = (first["instance"], first["triangle"])
    behind = world.cast_rays(origins, directions, times=times, skip=skip)
    both = (behind["instance"] >= 0) & (first["instance"] >= 0)
    assert both.any()
    assert (behind["t"][both] > first["t"][both]).all()


def test_approaching_wall_is_hit_at_its_position_at_each_time() -> None:
    world = raycam.World()
    world.add_object(box={"size": 2}, name="box")
    speed = 3.0
    world.set_video(
        fps=10,
        seconds=1,
        interpolation="linear",
        keyframe=[
            {"time": 0, "object": "box", "location": [11, 0, 0]},
            {"time": 1, "object": "box", "location": [11 - speed, 0, 0]},
        ],
    )
    times = np.random.default_rng(2).uniform(0, 1, 300)
    hits = world.at(0).cast_rays(np.tile([0, 0.1, 0.2], (300, 1)), [1, 0, 0], times=times)
    np.testing.assert_allclose(hits["t"], 10 - speed * times, atol=1e-12)


def test_timed_hits_do_not_depend_on_threads_or_order() -> None:
    world = moving_world().at(0)
    origins, directions, times = random_rays(3000)
    one = world.cast_rays(origins, directions, times=times, fields=FIELDS, threads=1)
    two = world.cast_rays(origins, directions, times=times, fields=FIELDS, threads=2)
    order = np.random.default_rng(3).permutation(len(times))
    mixed = world.cast_rays(origins[order], directions[order], times=times[order], fields=FIELDS)
    for name in FIELDS:
        assert one[name].tobytes() == two[name].tobytes()
        assert one[name][order].tobytes() == mixed[name].tobytes()


def test_one_time_applies_to_all_rays_of_any_shape() -> None:
    world = moving_world()
    origins, directions, _ = random_rays(24)
    shape = (4, 6, 3)
    hits = world.at(0.1).cast_rays(origins.reshape(shape), directions.reshape(shape), times=0.2)
    expected = world.at(0.1 + 0.2).cast_rays(origins.reshape(shape), directions.reshape(shape))
    np.testing.assert_array_equal(hits["t"], expected["t"])
    assert hits["t"].shape == (4, 6)


def test_times_of_a_static_world_change_nothing() -> None:
    world = raycam.World()
    world.add_object(box={"size": 2}, location=[5, 0, 0])
    hits = world.cast_rays([[0, 0, 0.0], [0, 9, 0]], [1, 0, 0], times=[0.5, 1e9])
    np.testing.assert_array_equal(hits["t"], [4, np.inf])


def test_times_of_a_moving_world_without_a_time_give_a_notice() -> None:
    with warns(raycam.Notice, code="unused_times", mentions=["world.at"]):
        hits = moving_world().cast_rays([-5, 0, 0], [1, 0, 0], times=0.1)
    assert hits["t"] > 0


@pytest.mark.parametrize("times", [[0.0, np.nan], [np.inf, 0.0]])
def test_times_that_are_not_finite_are_refused(times: list[float]) -> None:
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["times["]):
        moving_world().at(0).cast_rays([[0, 0, 0], [1, 0, 0]], [1, 0, 0], times=times)


def test_times_of_wrong_shape_are_refused() -> None:
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["times"]):
        moving_world().at(0).occluded([[0, 0, 0], [1, 0, 0]], [1, 0, 0], times=[1, 2, 3])


def test_intersections_refuse_times() -> None:
    with raises(raycam.SettingsError, code="unknown_key", mentions=["times"]):
        moving_world().intersections([0, 0, 0], [1, 0, 0], times=[1.0])  # type: ignore[call-arg]


def test_deforming_mesh_is_hit_with_its_shape_at_each_time(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    times = np.linspace(0, 1, 21)
    origins = np.stack([0.4 * times, 1.6 - 0.3 * times, np.full(21, 5.0)], axis=1)
    hits = world.at(0).cast_rays(origins, [0, 0, -1], times=times)
    expected = [
        world.at(time).cast_rays(at, [0, 0, -1])["t"] for time, at in zip(times, origins, strict=True)
    ]
    np.testing.assert_array_equal(hits["t"], expected)
    assert len(np.unique(hits["t"][np.isfinite(hits["t"])])) > 5


@pytest.mark.parametrize("interpolation", ["linear", "smooth"])
@pytest.mark.parametrize("t_min", [0.0, -20.0])
def test_narrow_bundles_hit_objects_that_pass_through_them(interpolation: Any, t_min: float) -> None:
    """The rays have the order of a turning sensor.

    At any time, most objects are far from the rays, and the near objects change over time.
    """
    world = raycam.World()
    world.add_object(plane={"size": 60}, name="ground", location=[0, 0, -1])
    random = np.random.default_rng(8)
    keys: list[dict[str, Any]] = []
    for number in range(12):
        name = f"box {number}"
        world.add_object(box={"size": [1, 2, 1.5]}, name=name, visible=number != 5)
        for time in (0.0, 0.1, 0.25, 0.5):
            key: dict[str, Any] = {
                "time": time,
                "object": name,
                "location": random.uniform([-9] * 2 + [0], [9, 9, 1]),
            }
            if number % 3 == 1:
                key["yaw"] = random.uniform(-180, 180)
            if number % 3 == 2:
                key["target"] = [0, 0, 5.0]
            keys.append(
                {
                    name: np.asarray(value).tolist() if name == "location" else value
                    for name, value in key.items()
                }
            )
    world.set_video(fps=10, seconds=0.5, interpolation=interpolation, keyframe=keys)
    turn = np.linspace(0, 4 * np.pi, 3000)
    up = np.tile(np.linspace(-0.2, 0.2, 10), 300)
    directions = np.stack([np.cos(turn), np.sin(turn), up], axis=1)
    times = np.repeat(np.linspace(0, 0.5, 600), 5)
    start = world.at(0)
    fields = ["t", "instance", "triangle", "normal", "category"]
    found = start.cast_rays([0, 0, 0.5], directions, times=times, t_min=t_min, fields=fields)
    hidden = start.occluded([0, 0, 0.5], directions, times=times, t_min=t_min)
    for time in np.unique(times):
        rays, moment = times == time, world.at(time)
        expected = moment.cast_rays([0, 0, 0.5], directions[rays], t_min=t_min, fields=fields)
        for name in fields:
            np.testing.assert_array_equal(found[name][rays], expected[name])
        np.testing.assert_array_equal(hidden[rays], expected["instance"] >= 0)
    assert len(np.unique(found["instance"])) > 9
    assert not (found["instance"] == 6).any()


def test_rays_in_columns_have_the_hits_of_single_rays() -> None:
    """Rays from one place are traced in another order, which must not change the results."""
    world = moving_world()
    up, turn = np.meshgrid(np.linspace(-0.4, 0.4, 64), np.linspace(-0.5, 0.5, 64))
    directions = np.stack([np.ones(4096), turn.reshape(-1), up.reshape(-1)], axis=1)
    together = world.cast_rays([-5, 0.1, 0], directions, fields=FIELDS)
    hidden = world.occluded([-5, 0.1, 0], directions, t_max=10.5)
    skip = (together["instance"], together["triangle"])
    behind = world.cast_rays([-5, 0.1, 0], directions, fields=FIELDS, skip=skip)
    order = np.random.default_rng(5).permutation(4096)[:500]
    for i in order:
        alone = world.cast_rays([-5, 0.1, 0], directions[i], fields=FIELDS)
        after = world.cast_rays([-5, 0.1, 0], directions[i], fields=FIELDS, skip=(skip[0][i], skip[1][i]))
        for name in FIELDS:
            np.testing.assert_array_equal(together[name][i], alone[name])
            np.testing.assert_array_equal(behind[name][i], after[name])
    np.testing.assert_array_equal(hidden, together["t"] <= 10.5)
    assert (behind["t"] > together["t"]).any()
