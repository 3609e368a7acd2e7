"""Scans against closed forms, moving worlds, and statistics."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
import raycam
from lidar.conftest import GREY, beams, quad, wall


def test_tilted_wall_has_the_distances_of_the_plane() -> None:
    world = raycam.World()
    normal = np.array([-1.0, 0.4, -0.2]) / np.linalg.norm([1, 0.4, 0.2])
    u = np.cross(normal, [0, 0, 1.0])
    v = np.cross(normal, u)
    quad(world, [10, 0, 0], u / np.linalg.norm(u) * 1000, v / np.linalg.norm(v) * 1000, "wall")
    lidar = raycam.Lidar("vlp16", noise=False, min_range=0, max_range=1e6).placed([0, 0, 0])
    scan = raycam.scan(world, lidar)
    pattern, at = scan.pattern, scan["pulse"]
    expected = ((np.array([10.0, 0, 0]) - pattern.origins[at]) @ normal) / (pattern.directions[at] @ normal)
    np.testing.assert_allclose(scan["distance"], expected, rtol=1e-9)
    assert scan.count > 4000


def test_single_ray_per_pulse_equals_cast_rays(yard: raycam.World) -> None:
    lidar = raycam.Lidar("vlp16", noise=False, min_range=0).placed([0, 0, 1.8], yaw=20)
    scan = raycam.scan(yard, lidar)
    pose, pattern = lidar.pose, lidar.pattern()
    hits = yard.cast_rays(
        pattern.origins @ pose[:3, :3].T + pose[:3, 3],
        pattern.directions @ pose[:3, :3].T,
        fields=["distance", "instance", "category", "triangle"],
    )
    kept = np.flatnonzero(hits["distance"] <= 100)
    np.testing.assert_array_equal(scan["pulse"], kept)
    np.testing.assert_allclose(scan["distance"], hits["distance"][kept], rtol=1e-12)
    np.testing.assert_array_equal(scan["true_distance"], scan["distance"])
    for name in ("instance", "category", "triangle"):
        np.testing.assert_array_equal(scan[name], hits[name][kept])


def turning_boxes() -> raycam.World:
    """Boxes that turn and drift around the origin for two seconds."""
    world, keys = raycam.World(), []
    rng = np.random.default_rng(3)
    for i, angle in enumerate(np.arange(0, 360, 30)):
        place = 8 * np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0])
        world.add_object(box={"size": [1.5, 2, 3]}, name=f"box{i}", location=place, color=GREY)
        for t in (0.0, 1.0, 2.0):
            drift = place + rng.uniform(-1, 1, 3) * t
            turn = 40 * t * (1 if i % 2 else -1)
            keys.append(
                {"time": t, "object": f"box{i}", "location": drift.tolist(), "yaw": turn, "pitch": 10 * t}
            )
    world.set_video(seconds=2, interpolation="linear", keyframe=keys)
    return world


def test_points_lie_on_the_surfaces_at_their_own_times() -> None:
    """A spinning lidar on a turning car in a world of turning boxes."""
    world = turning_boxes()
    lidar = raycam.Lidar("vlp16", noise=False, rate=10).placed([0, 0, 0.3])
    moving = lidar.moving(lidar.placed([0.8, 0.3, 0.4], yaw=12, pitch=2))
    scan = raycam.scan(world.at(0.5), moving)
    points, times = scan.in_world(), scan["time"]
    chosen = np.random.default_rng(1).choice(scan.count, 150, replace=False)
    assert len(np.unique(scan["instance"][chosen])) > 8
    for i in chosen.tolist():
        found = world.at(0.5 + times[i]).closest_points([points[i]], objects=[int(scan["instance"][i])])
        assert found["distance"][0] < 1e-9
    np.testing.assert_allclose(points, scan["true_position"], atol=1e-9)


def test_points_of_a_moving_scan_differ_from_a_static_scan() -> None:
    """The moving scan's points are centimetres away from the surfaces at the frame's start."""
    world = turning_boxes()
    scan = raycam.scan(world.at(0.5), raycam.Lidar("vlp16", noise=False))
    late = np.flatnonzero(scan["time"] > 0.08)[::40]
    apart = world.at(0.5).closest_points(scan.in_world()[late])["distance"]
    assert apart.max() > 0.01


def test_very_fast_scan_equals_the_scan_of_a_static_frame() -> None:
    world = turning_boxes()
    lidar = raycam.Lidar("vlp16", noise=False)
    ways = lidar.pattern().directions[::7]
    fast = raycam.Lidar.of(ways, times=np.arange(len(ways)) * 1e-12, noise=False)
    static = raycam.Lidar.of(ways, noise=False)
    a, b = raycam.scan(world.at(0.5), fast), raycam.scan(world.at(0.5), static)
    np.testing.assert_array_equal(a["pulse"], b["pulse"])
    np.testing.assert_allclose(a["distance"], b["distance"], atol=1e-8)


def test_approaching_wall_is_measured_at_the_time_of_each_pulse() -> None:
    """The distance at time t is d - v t; the wall moves by v = 2 m/s."""
    world = raycam.World()
    world.add_object(box={"size": [1, 50, 50]}, name="wall", location=[20.5, 0, 0], color=GREY)
    keys = [{"time": t, "object": "wall", "location": [20.5 - 2 * t, 0, 0]} for t in (0, 1)]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    times = np.linspace(0, 0.9, 50)
    lidar = raycam.Lidar.of(np.tile([1.0, 0, 0], (50, 1)), times=times, rate=1, noise=False)
    scan = raycam.scan(world.at(0), lidar)
    np.testing.assert_allclose(scan["distance"], 20 - 2 * times, atol=1e-12)


def test_reflectivity_falls_with_the_cosine_and_energy_with_the_square_of_the_distance() -> None:
    """An echo is detected if E = reflectivity / L² is large enough.

    The largest detected distance follows from range_10.
    """
    for angle in (0.0, 30.0, 60.0, 80.0):
        world = raycam.World()
        turn = math.radians(angle)
        u = np.array([-math.sin(turn), math.cos(turn), 0]) * 1e4
        quad(world, [30, 0, 0], u, [0, 0, 1e4], "wall", color=[0.4] * 3)
        scan = raycam.scan(world, beams(1, noise=False))
        assert scan["reflectivity"][0] == pytest.approx(0.4 * math.cos(turn), rel=1e-6)
        assert scan["incidence"][0] == pytest.approx(angle, abs=1e-4)
    # A surface of reflectance p is found up to range_10 sqrt(p / 0.1).
    for reflectance in (0.01, 0.1, 0.9):
        limit = 50 * math.sqrt(reflectance / 0.1)
        for factor, found in ((0.999, 1), (1.001, 0)):
            world = wall(limit * factor, color=[reflectance] * 3)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", raycam.Notice)
                scan = raycam.scan(world, beams(1, noise=False, range_10=50, max_range=1e6), keep_lost=True)
            assert (scan["lost"] == 0).sum() == found


def test_distance_noise_has_the_mean_and_deviation_of_the_settings() -> None:
    """The tolerances are three standard errors for 1e5 pulses."""
    count = 100_000
    scan = raycam.scan(wall(20.0), beams(count, range_noise=0.03))
    error = scan["distance"] - 20.0
    assert abs(error.mean()) < 3 * 0.03 / math.sqrt(count)
    assert abs(error.std() - 0.03) < 3 * 0.03 / math.sqrt(2 * count)
    assert abs(np.corrcoef(error[:-1], error[1:])[0, 1]) < 3 / math.sqrt(count)


def test_noise_of_weak_echoes_follows_the_rise_time() -> None:
    """sigma² = floor² + (c rise / (2 SNR))², and SNR = 5 E / E(10 %, range_10)."""
    count = 50_000
    lidar = beams(count, range_noise=0.01, range_10=40, rise_time=1e-9, pulse_length=0)
    scan = raycam.scan(wall(20.0, color=[0.5] * 3), lidar)
    snr = 5 * (0.5 / 20**2) / (0.1 / 40**2)
    sigma = math.hypot(0.01, 299792458e-9 / (2 * snr))
    assert abs(scan["distance"].std() - sigma) < 3 * sigma / math.sqrt(2 * count)


def test_half_of_the_pulses_are_detected_at_range_10() -> None:
    count = 100_000
    scan = raycam.scan(wall(40.0, color=[0.1] * 3), beams(count, range_10=40), keep_lost=True)
    found = (scan["lost"] == 0).mean()
    assert abs(found - 0.5) < 3 * 0.5 / math.sqrt(count)
    assert set(np.unique(scan["lost"])) <= {0, 2, 6}


def test_detection_probability_is_the_normal_distribution_of_the_margin() -> None:
    """A signal-to-noise ratio of 6 is 1 above the threshold, so P = Phi(1) = 0.8413."""
    count = 50_000
    distance = 40 * math.sqrt(5 / 6)
    scan = raycam.scan(wall(distance, color=[0.1] * 3), beams(count, range_10=40), keep_lost=True)
    p = 0.5 * (1 + math.erf(1 / math.sqrt(2)))
    assert abs((scan["lost"] == 0).mean() - p) < 3 * math.sqrt(p * (1 - p) / count)
    assert (scan["lost"] == 6).any()


def test_distances_are_rounded_to_the_step() -> None:
    scan = raycam.scan(wall(20.0), beams(1000, range_noise=0.1, step=0.004))
    np.testing.assert_allclose(scan["distance"] / 0.004, np.rint(scan["distance"] / 0.004), atol=1e-6)
    assert len(np.unique(scan["distance"])) > 50


def test_azimuth_noise_is_one_number_per_column() -> None:
    lidar = raycam.Lidar("vlp16", azimuth_noise=0.5, range_noise=0, step=0)
    scan = raycam.scan(wall(20.0), lidar)
    still = raycam.scan(wall(20.0), lidar.replace(azimuth_noise=0))
    shared, i, j = np.intersect1d(scan["pulse"], still["pulse"], return_indices=True)
    assert len(shared) > 1000
    change = scan["distance"][i] / still["distance"][j]
    columns = scan["column"][i]
    same = [np.ptp(change[columns == c]) for c in np.unique(columns)[::20]]
    assert max(same) < 1e-3 < np.ptp(change)


def test_scan_depends_on_frame_and_seed_but_not_on_threads(yard: raycam.World) -> None:
    lidar = raycam.Lidar("os1-16", returns="dual").placed([0, 0, 1.8])
    one, two = (raycam.scan(yard, lidar, threads=n) for n in (1, 2))
    for name in one:
        assert one[name].tobytes() == two[name].tobytes(), name
    assert raycam.scan(yard, lidar, frame=1)["distance"].tobytes() != one["distance"].tobytes()
    assert raycam.scan(yard, lidar.replace(seed=1))["distance"].tobytes() != one["distance"].tobytes()


def test_noise_of_a_pulse_does_not_depend_on_other_pulses() -> None:
    """Pulses that hit nothing do not change the random numbers of other pulses."""
    ways = np.array([[1.0, 0, 0], [0, 0, 1.0], [1.0, 0, 0], [1.0, 0, 0]])
    everything = raycam.scan(wall(20.0), raycam.Lidar.of(np.tile([1.0, 0, 0], (4, 1)), range_noise=0.1))
    some = raycam.scan(wall(20.0), raycam.Lidar.of(ways, range_noise=0.1))
    np.testing.assert_array_equal(some["distance"], everything["distance"][[0, 2, 3]])


def test_lost_contains_the_reason_of_each_missing_point() -> None:
    world = raycam.World()
    for y, distance in ((-3, 0.5), (0, 20), (3, 200)):
        quad(world, [distance, y, 0], [0, -1, 0], [0, 0, 1], f"at{distance}", color=[0.5] * 3)
    quad(world, [20, 6, 0], [0, -1, 0], [0, 0, 1], "dark", color=[0.0] * 3)
    mirror = {"type": "metal", "metal": "silver", "roughness": 0.0}
    quad(world, [20, 9, 0], [0, -1, 0], [0, 0, 1], "mirror", **mirror)
    starts = [[0, y, 0] for y in (-3, 0, 3, 6, 9, 12)]
    lidar = raycam.Lidar.of([[1.0, 0, 0]] * 6, origins=starts, min_range=1, max_range=100, noise=False)
    scan = raycam.scan(world, lidar, keep_lost=True)
    assert scan["lost"].tolist() == [3, 0, 4, 2, 5, 1]
    assert np.isnan(scan["position"]).any(axis=1).tolist() == [True, False, True, True, True, True]
    assert raycam.scan(world, lidar)["pulse"].tolist() == [1]


@pytest.mark.parametrize(
    ("returns", "expected"),
    [
        ("first", [10.0]),
        ("last", [30.0]),
        ("strongest", [10.0]),
        ("dual", [10.0, 30.0]),
        ("all", [10.0, 20.0, 30.0]),
    ],
)
def test_returns_select_echoes_of_translucent_screens(returns: str, expected: list[float]) -> None:
    world = raycam.World()
    for distance in (10.0, 20.0, 30.0):
        opacity = {} if distance == 30 else {"opacity": 0.5, "alpha": "blend"}
        quad(world, [distance, 0, 0], [0, -5, 0], [0, 0, 5], f"at{distance}", **opacity)
    scan = raycam.scan(world, beams(1, returns=returns, noise=False))
    np.testing.assert_allclose(scan["distance"], expected, atol=1e-6)
    np.testing.assert_allclose(scan["true_distance"], expected, atol=1e-12)
    np.testing.assert_allclose(scan["true_position"][:, 0], expected, atol=1e-12)
    assert scan["return"].tolist() == list(range(len(expected)))
    assert (scan["returns"] == len(expected)).all()


def test_dual_reports_the_second_strongest_if_the_last_is_the_strongest() -> None:
    """The rule is in the VLP-16 manual, section 9.3.2."""
    world = raycam.World()
    for distance, opacity in ((10.0, 0.05), (11.0, 0.2), (12.0, 1.0)):
        quad(world, [distance, 0, 0], [0, -5, 0], [0, 0, 5], f"at{distance}", opacity=opacity, alpha="blend")
    scan = raycam.scan(world, beams(1, returns="dual", noise=False, pulse_length=0))
    np.testing.assert_allclose(scan["distance"], [11, 12])


def test_fog_attenuates_by_the_visibility_law_on_the_way_out_and_back() -> None:
    """The factor is exp(-2 alpha L) with alpha = ln 20 / visibility.

    It is 1/20 for a surface at half of the visibility.
    """
    clear = raycam.scan(wall(40.0), beams(1, noise=False))
    foggy = raycam.scan(wall(40.0), beams(1, noise=False, visibility=80, returns="last"))
    assert foggy["reflectivity"][0] / clear["reflectivity"][0] == pytest.approx(1 / 20, rel=1e-5)


def test_overlap_scales_the_energy_with_the_distance() -> None:
    """The factor is interpolated linearly: 0.5 + 0.3 (20 - 10) / 30 = 0.6."""
    plain = raycam.scan(wall(20.0), beams(1, noise=False))
    scaled = raycam.scan(wall(20.0), beams(1, noise=False, overlap=[[1, 0], [10, 0.5], [40, 0.8]]))
    assert scaled["reflectivity"][0] == pytest.approx(0.6 * plain["reflectivity"][0], rel=1e-6)
    assert scaled["distance"][0] == plain["distance"][0]


def test_signal_gain_is_the_signal_of_a_white_surface_at_one_metre() -> None:
    """The signal is gain * 0.5 / 20², rounded, and at most 65535."""
    scan = raycam.scan(wall(20.0, color=[0.5] * 3), beams(1, noise=False, signal_gain=1e6))
    assert scan["signal"].dtype == np.uint16
    assert scan["signal"].tolist() == [1250]
    assert raycam.scan(wall(1.0), beams(1, noise=False, signal_gain=1e6))["signal"].tolist() == [65535]


def test_notices_of_a_scan_are_issued_and_listed() -> None:
    with pytest.warns(raycam.Notice):
        scan = raycam.scan(raycam.World(), beams(1))
    assert [notice.code for notice in scan.notices] == ["empty_scan"]
    assert raycam.scan(wall(5.0), beams(1)).notices == ()


def test_lidar_on_a_surface_returns_finite_numbers(yard: raycam.World) -> None:
    """The floor and the lidar are at z = 0."""
    scan = raycam.scan(yard, raycam.Lidar("os1-16", min_range=0, noise=False, range_10=50))
    assert all(np.isfinite(scan[name]).all() for name in ("position", "distance", "reflectivity"))
