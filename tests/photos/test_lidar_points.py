"""Visibility of faces to lidars, compared with brute force and closed forms."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import raycam
import trimesh
from raycam.cli import main
from support.box_table import ring, table
from support.raises import warns


def fan(count: int, seconds: float = 0.5, **settings: object) -> raycam.Lidar:
    """A lidar with `count` pulses in random directions below the horizon."""
    random = np.random.default_rng(3)
    ways = random.normal(size=(count, 3))
    ways[:, 2] = -np.abs(ways[:, 2])
    times = np.linspace(0, seconds, count)
    return raycam.Lidar.of(ways, times=times, rate=1 / seconds, noise=False, **settings)


def lengths(origin: np.ndarray, way: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The ray's parameter on each triangle [n, 3, 3]; inf for a miss.

    The method is that of Möller and Trumbore (1997).
    """
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(way, f)
    with np.errstate(divide="ignore", invalid="ignore"):
        d = 1 / (e * p).sum(axis=1)
        s = origin - a
        u = (s * p).sum(axis=1) * d
        q = np.cross(s, e)
        v = (q @ way) * d
        t = (f * q).sum(axis=1) * d
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)


def measured(world: raycam.World, lidar: raycam.Lidar, start: float | None) -> np.ndarray:
    """True for faces whose fronts are hit first by a pulse within the lidar's range.

    World and lidar have their poses at each pulse's time.
    """
    pattern = lidar.pattern()
    turns, places = lidar.track.at(pattern.times)
    corners = world.triangles()
    found = np.zeros(len(corners), bool)
    for way, turn, place, moment in zip(pattern.directions, turns, places, pattern.times, strict=True):
        if start is not None:
            corners = world.at(start + moment).triangles()
        direction = turn @ way
        length = lengths(place, direction, corners)
        first = int(np.argmin(length))
        if lidar.min_range <= length[first] <= lidar.max_range and np.isfinite(length[first]):
            side = np.cross(corners[first, 1] - corners[first, 0], corners[first, 2] - corners[first, 0])
            found[first] |= bool(side @ direction < 0)
    return found


def boxes() -> raycam.World:
    """Two boxes on a ground, one of which moves and turns."""
    world = raycam.World()
    world.add_object(plane={"size": [9, 9]}, name="ground")
    world.add_object(box={"size": [0.8, 0.6, 1]}, name="post", location=[1, 0.2, 0.5], yaw=30)
    world.add_object(box={"size": [0.5, 0.5, 0.5]}, name="cart", location=[-1.2, 0, 0.25])
    keys = [
        {"time": time, "object": "cart", "location": [x, -0.9, 0.25], "yaw": yaw}
        for time, x, yaw in ((0, -1.2, 0), (1, 1.2, 170))
    ]
    world.set_video(seconds=1, keyframe=keys)
    return world


@pytest.mark.parametrize("at", [None, 0.1])
def test_faces_of_a_moving_lidar_equal_brute_force(at: float | None) -> None:
    world = boxes() if at is None else boxes().at(at)
    lidar = fan(300, max_range=3.5, min_range=0.8).placed([-2, -1, 1.6])
    lidar = lidar.moving(lidar.placed([2, -1, 1.6], yaw=70))
    with warns(raycam.Notice, code="unused_times") if at is None else nullcontext():
        seen = raycam.surface_visibility(world, {"top": lidar}, pairs=True)
    expected = measured(boxes(), lidar, at)
    assert 6 < expected.sum() < 0.8 * len(expected)
    np.testing.assert_array_equal(seen.views, expected)
    np.testing.assert_array_equal(seen.best_view, expected - 1)
    assert seen.names == ("top",)
    assert seen.faces_seen.tolist() == [expected.sum()]
    assert seen.pairs is not None
    np.testing.assert_array_equal(np.diff(seen.pairs.offsets), expected)


def test_faces_of_wide_beams_are_those_of_the_scan() -> None:
    world = boxes().at(0)
    lidar = raycam.Lidar("vlp16", beam_samples=7, beam_divergence=3e-3, returns="dual", seed=4).placed(
        [0, 0, 1.2]
    )
    scan = raycam.scan(world, lidar.replace(noise=False))
    expected = {(i, t) for i, t in zip(scan["instance"].tolist(), scan["triangle"].tolist(), strict=True)}
    seen = raycam.surface_visibility(world, [lidar])
    assert {tuple(pair) for pair in seen.ids[seen.views > 0].tolist()} == expected
    assert seen.fraction[seen.views > 0].min() > 0


def test_visibility_from_cameras_and_lidars_is_combined() -> None:
    world = table()
    camera = ring(1)[0]
    lidars = [fan(2000).placed(place) for place in ([-2, 0, 1.5], [2, 1, 1.5])]
    with warns(raycam.Notice, code="unused_times"):
        every = raycam.surface_visibility(world, {"a": lidars[0], "b": camera, "c": lidars[1]}, pairs=True)
        alone = [raycam.surface_visibility(world, [one]) for one in (lidars[0], camera, lidars[1])]
    np.testing.assert_array_equal(every.views, sum(one.views for one in alone))
    np.testing.assert_array_equal(every.faces_seen, [one.faces_seen[0] for one in alone])
    best = np.stack([one.best_resolution for one in alone])
    np.testing.assert_array_equal(every.best_resolution, best.max(axis=0))
    met = every.views > 0
    np.testing.assert_array_equal(every.best_view[met], best.argmax(axis=0)[met])
    assert every.pairs is not None
    rows = np.repeat(np.arange(len(every.ids)), np.diff(every.pairs.offsets))
    for number, one in enumerate(alone):
        np.testing.assert_array_equal(rows[every.pairs.camera == number], np.flatnonzero(one.views))


def wall(distance: float = 2.0) -> raycam.World:
    world = raycam.World()
    y, z = 1.5, 1.0
    world.add_mesh([[distance, -y, -z], [distance, -y, z], [distance, y, z]], [[0, 2, 1]])
    return world


def grid(step: float = 0.01) -> raycam.Lidar:
    """Pulses through a regular grid on the plane x = 2, `step` metres apart."""
    y, z = np.meshgrid(np.arange(-1.5, 1.5, step) + step / 3, np.arange(-1, 1, step) + step / 7)
    return raycam.Lidar.of(np.stack([np.full(y.size, 2.0), y.ravel(), z.ravel()], axis=1), noise=False)


def test_resolution_and_angle_of_a_lidar_equal_the_closed_form() -> None:
    seen = raycam.surface_visibility(wall(), [grid(0.02)], facing="both")
    assert seen.best_resolution[0] == pytest.approx(50, rel=5e-3)
    assert seen.fraction[0] == 1
    slanted = raycam.Lidar.of([[2.0, 0.4, 0.7]], noise=False)
    angle = raycam.surface_visibility(wall(), [slanted], facing="both").angle[0]
    assert angle == pytest.approx(np.degrees(np.arccos(2 / np.sqrt(4 + 0.16 + 0.49))), abs=1e-3)


def test_half_hidden_face_has_the_fraction_of_its_area_for_a_lidar() -> None:
    world = wall()
    # A lid in front of the wall hides the part with y < 0; the part with y > 0 is 1/4 of the triangle. A sample up to
    # 0.05 m (half of the samples' distance) beyond the border may also be nearest to a measured point, which adds up to
    # 0.02 of the area.
    world.add_mesh(
        [[1, -5, -5], [1, 0, -5], [1, 0, 5], [1, -5, 5]],
        [[0, 1, 2], [0, 2, 3]],
    )
    seen = raycam.surface_visibility(world, [grid(0.01)], facing="both")
    assert seen.fraction[0] == pytest.approx(0.26, abs=0.03)


def test_back_of_a_face_is_not_visible_to_a_lidar() -> None:
    lidar = raycam.Lidar.of([[1, 0.1, 0.3]], noise=False)
    front, back = wall(), raycam.World()
    back.add_mesh(wall().triangles()[0], [[0, 2, 1]])
    views = [raycam.surface_visibility(w, [lidar], facing="front").views[0] for w in (front, back)]
    assert sorted(views) == [0, 1]
    with warns(raycam.Notice, code="inside_out_mesh"):
        seen = raycam.surface_visibility((front, back)[int(views[0])], [lidar])
    assert (seen.facing, seen.views[0]) == ("both", 1)


def test_surface_behind_a_mirror_is_not_visible_to_a_lidar() -> None:
    world = raycam.World()
    world.add_object(
        box={"size": [0.1, 4, 4]},
        location=[3, 0, 0],
        name="mirror",
        type="metal",
        metal="aluminium",
        roughness=0,
    )
    world.add_object(box={"size": [1, 1, 1]}, location=[-3, 0, 0], name="block")
    lidar = raycam.Lidar.of([[1, 0, 0.01]], noise=False)
    assert raycam.scan(world, lidar)["bounces"].tolist() == [1]
    assert raycam.surface_visibility(world, [lidar]).views.sum() == 0


def test_objects_select_the_faces_of_a_lidar() -> None:
    world = boxes().at(0)
    lidar = raycam.Lidar("vlp16").placed([0, 0, 1.2])
    every = raycam.surface_visibility(world, [lidar])
    some = raycam.surface_visibility(world, [lidar], objects="post")
    np.testing.assert_array_equal(some.views, every.views[every.of(1)])


def test_lidar_without_points_gives_a_notice() -> None:
    with warns(raycam.Notice, code="empty_scan"):
        seen = raycam.surface_visibility(wall(), [raycam.Lidar.of([[-1, 0, 0]])])
    assert seen.views.sum() == 0


def test_lidar_visibility_does_not_depend_on_threads() -> None:
    world = boxes().at(0)
    lidar = raycam.Lidar("os1-32").placed([0, 0, 1.2])
    one, two = (raycam.surface_visibility(world, [lidar], threads=n) for n in (1, 2))
    for name in ("views", "fraction", "best_resolution", "angle"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_viewpoint_of_an_unsupported_type_is_refused() -> None:
    for wrong in ({"a": 3}, raycam.Lidar("vlp16"), ["vlp16"]):
        with pytest.raises(raycam.SettingsError) as caught:
            raycam.surface_visibility(wall(), wrong)  # type: ignore[arg-type]
        assert caught.value.code == "wrong_type"


def test_command_visible_accepts_lidars(tmp_path: Path) -> None:
    (tmp_path / "yard.toml").write_text(
        '[[object]]\nname = "ground"\nplane = { size = [9, 9] }\n'
        '[[object]]\nname = "post"\nbox = { size = [0.8, 0.6, 1] }\nlocation = [1, 0.2, 0.5]\n'
        '[[rig]]\nname = "car"\n[[rig.lidar]]\nname = "top"\ndevice = "vlp16"\nlocation = [-2, 0, 1.2]\n'
    )
    world = raycam.load(tmp_path / "yard.toml")
    top = next(iter(world.sensors.values()))
    assert isinstance(top, raycam.Lidar)
    name, side = next(iter(world.sensors)), raycam.Lidar("os1-32").placed([3, 2, 0.9])
    common = ["visible", str(tmp_path / "yard.toml")]
    out = str(tmp_path / "seen.npz")
    assert main([*common, "--lidar", name, "-o", out, "--heat", str(tmp_path / "heat.png")]) == 0
    np.testing.assert_array_equal(np.load(out)["views"], raycam.surface_visibility(world, [top]).views)
    assert main([*common, "--lidar", name, "side=os1-32@3,2,0.9", "-o", out]) == 0
    both = raycam.surface_visibility(world, {name: top, "side": side})
    np.testing.assert_array_equal(np.load(out)["views"], both.views)
    assert np.load(out)["names"].tolist() == [name, "side"]
    culled = tmp_path / "seen.ply"
    assert main([*common, "--lidar", name, "--cull", "-o", str(culled)]) == 0
    seen = raycam.surface_visibility(world, [top])
    assert len(trimesh.load(culled, process=False).faces) == (seen.views > 0).sum()
    assert main(common) == 2
    assert main([*common, "--lidar", "bottom"]) == 1
    assert main([*common, "--lidar", f"{name}=os1-32@3,2,0.9", name]) == 2
