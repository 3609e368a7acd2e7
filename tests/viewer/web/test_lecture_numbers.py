"""The numbers of the lecture's page, compared with `raycam.reference` and raycam."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam import reference
from support.node_core import needs_node, run_module

pytestmark = needs_node
PAGE = "lecture/main.js"
STATES = 1000


def in_page(script: str) -> object:
    """Runs a script in the scope of the lecture's modules."""
    return run_module(PAGE, f"delete globalThis.onmessage; {script}")


@pytest.fixture(scope="module")
def states() -> list[dict[str, object]]:
    """Random numbers of the shared world."""
    rng = np.random.default_rng(7)
    return [
        {
            **dict(zip(("fx", "fy"), rng.uniform(120, 700, 2), strict=True)),
            "skew": rng.uniform(-150, 150),
            "cx": rng.uniform(0, 319),
            "cy": rng.uniform(0, 239),
            "roll": rng.uniform(-180, 180),
            "pitch": rng.uniform(-89, 89),
            "yaw": rng.uniform(0, 360),
            "C": [*rng.uniform(-6, 6, 2), rng.uniform(0.2, 6)],
            "pixel": [int(rng.integers(320)), int(rng.integers(240))],
        }
        for _ in range(STATES)
    ]


@pytest.fixture(scope="module")
def shown(states: list[dict[str, object]]) -> list[dict[str, object]]:
    """The page's results for each state."""
    found = in_page(
        f"""const shown = [];
        for (const state of {json.dumps(states)}) {{
          const shared = new Shared();
          Object.assign(shared.numbers, state);
          shared.compute();
          const {{ camera, ray, steps, corners }} = shared;
          shown.push({{ ...camera, r: ray.r, v: ray.forward, winner: steps.winner, corners }});
        }}
        return shown;"""
    )
    assert isinstance(found, list)
    return found


def test_camera_of_the_page_equals_from_pose(states: list[dict], shown: list[dict]) -> None:
    for state, page in zip(states, shown, strict=True):
        K = [[state["fx"], state["skew"], state["cx"]], [0, state["fy"], state["cy"]], [0, 0, 1]]
        camera = raycam.Camera.from_pose(
            state["C"], state["roll"], state["pitch"], state["yaw"], size=(320, 240), K=K
        )
        np.testing.assert_allclose(np.reshape(page["P"], (3, 4)), camera.P, atol=1e-9)
        np.testing.assert_allclose(np.reshape(page["R"], (3, 3)), camera.R, atol=1e-12)


def test_ray_of_the_page_equals_the_reference(states: list[dict], shown: list[dict]) -> None:
    for state, page in zip(states, shown, strict=True):
        P = np.reshape(page["P"], (3, 4))
        X = reference.points_on_lines(P, np.array([state["pixel"]], float))
        C = reference.camera_center(P)
        v = reference.third_row_of_r(P)
        line = reference.lines(X, C)
        np.testing.assert_allclose(page["v"], v, atol=1e-9)
        r = reference.pointed_forward(line, v)[0]
        np.testing.assert_allclose(page["r"], r, rtol=1e-6, atol=1e-6 * np.abs(r).max())


def test_closest_hit_of_the_page_equals_the_reference(shown: list[dict]) -> None:
    hits = 0
    for page in shown:
        triangles = np.reshape(page["corners"], (-1, 3, 3))
        C, r = np.array(page["C"], float), np.array([page["r"]], float)
        found = reference.trace(triangles, C, r)
        winner = page["winner"]
        assert (winner["index"] if winner else -1) == found.index[0]
        if winner:
            hits += 1
            np.testing.assert_allclose(winner["t"], found.t[0], rtol=1e-9)
    assert hits > STATES // 10


def test_triangles_of_the_page_equal_those_of_its_world_file(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    page = in_page(
        "const numbers = firstNumbers(); return [worldText(numbers), cornersOf(numbers), colorsOf(numbers)];"
    )
    assert isinstance(page, list)
    path = tmp_path_factory.mktemp("world") / "lecture.toml"
    path.write_text(page[0], encoding="utf-8")
    world = raycam.load(path)
    np.testing.assert_allclose(np.reshape(page[1], (-1, 3, 3)), np.asarray(world.triangles()), atol=1e-12)
    linear = np.asarray(world.triangle_colors(), float)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    np.testing.assert_array_equal(page[2], np.round(255 * srgb))


def test_labels_never_overlap_in_random_configurations() -> None:
    rng = np.random.default_rng(3)
    configurations = [
        [
            {"at": rng.uniform([0, 0], [600, 370]).tolist(), "width": rng.uniform(12, 110), "height": 18}
            for _ in range(rng.integers(2, 16))
        ]
        for _ in range(1000)
    ]
    placed = in_page(f"return {json.dumps(configurations)}.map((labels) => placeLabels(labels, 600, 370));")
    assert isinstance(placed, list)
    shown = 0
    for boxes in placed:
        found = [box for box in boxes if box]
        shown += len(found)
        for i, a in enumerate(found):
            assert min(a["x"], a["y"]) >= 0
            assert a["x"] + a["width"] <= 600
            assert a["y"] + 18 <= 370
            for b in found[:i]:
                apart = (
                    a["x"] >= b["x"] + b["width"]
                    or b["x"] >= a["x"] + a["width"]
                    or a["y"] >= b["y"] + 18
                    or b["y"] >= a["y"] + 18
                )
                assert apart
    assert shown >= 0.99 * sum(map(len, configurations))


def test_tree_finds_the_closest_hit_of_all_triangles() -> None:
    page = in_page(
        """const corners = scatter(300), tree = buildTree(corners);
        const rays = Array.from({ length: 101 }, (_, i) => {
          const angle = ((i - 50) / 50) * 0.45;
          return { C: [-0.2, 0.5, 0], r: [Math.cos(angle), Math.sin(angle), 0], forward: [1, 0, 0] };
        });
        const found = rays.map((ray) => traverse(tree, corners, ray));
        return { corners, rays, found: found.map(({ tested, hit }) => [tested.length, hit ? hit.index : -1]) };"""
    )
    assert isinstance(page, dict)
    triangles = np.reshape(page["corners"], (-1, 3, 3))
    directions = np.array([ray["r"] for ray in page["rays"]], float)
    expected = reference.trace(triangles, np.array([-0.2, 0.5, 0]), directions).index
    assert [hit for _, hit in page["found"]] == expected.tolist()
    assert np.mean([tested for tested, _ in page["found"]]) < 40
    assert (expected >= 0).any()


def test_calibration_recovers_the_camera_without_noise() -> None:
    page = in_page(
        """const numbers = firstNumbers(), { P } = cameraOf(numbers), points = cornerPoints(cornersOf(numbers));
        const pixels = points.map((point) => [pixelOf(P, point).u, pixelOf(P, point).v]);
        return [P, calibrate(points, pixels)];"""
    )
    assert isinstance(page, list)
    P, found = map(np.array, page)
    np.testing.assert_allclose(found, P / P[11], rtol=1e-6, atol=1e-6)


def test_calibration_with_noise_equals_least_squares() -> None:
    rng = np.random.default_rng(11)
    noise = rng.uniform(-3, 3, (14, 2)).tolist()
    page = in_page(
        f"""const numbers = firstNumbers(), {{ P }} = cameraOf(numbers), points = cornerPoints(cornersOf(numbers));
        const noise = {json.dumps(noise)};
        const pixels = points.map((point, i) => [pixelOf(P, point).u + noise[i][0], pixelOf(P, point).v + noise[i][1]]);
        return [points, pixels, calibrate(points, pixels)];"""
    )
    assert isinstance(page, list)
    rows, right = [], []
    for (x, y, z), (u, v) in zip(*page[:2], strict=True):
        rows += [[x, y, z, 1, 0, 0, 0, 0, -u * x, -u * y, -u * z]]
        rows += [[0, 0, 0, 0, x, y, z, 1, -v * x, -v * y, -v * z]]
        right += [u, v]
    expected, *_ = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)
    np.testing.assert_allclose(page[2][:11], expected, rtol=1e-5, atol=1e-7)


def test_disparity_gives_the_depth_along_the_axis(states: list[dict[str, object]]) -> None:
    page = in_page(
        f"""return {json.dumps(states)}.map((state) => {{
          const numbers = {{ ...state, fy: state.fx, skew: 0, triangles: [] }}, {{ P, R }} = cameraOf(numbers);
          const depth = 1 + (state.cx / 319) * 8, {{ r, forward }} = rayOfPixel(P, ...state.pixel);
          const point = plusTimes(numbers.C, depth / dot(r, forward), r);
          const {{ u }} = pixelOf(cameraOf(secondNumbers(numbers, 0.6)).P, point);
          return [depth, depthOfDisparity(numbers.fx, 0.6, state.pixel[0] - u)];
        }});"""
    )
    depths = np.array(page)
    np.testing.assert_allclose(depths[:, 1], depths[:, 0], rtol=1e-6)


def test_exact_edge_rule_has_no_leaks_and_float32_has_some() -> None:
    page = in_page(
        "return Array.from({ length: 36 }, (_, i) => edgeLeaks(10 * i + 2, 200)).flat()"
        ".map(({ single, exact }) => [single, exact]);"
    )
    single, exact = np.array(page).T
    assert exact.all()
    assert not single.all()


def test_phong_reflects_at_most_the_incident_light() -> None:
    page = in_page(
        """const found = [];
        for (const shininess of [1, 20, 200]) for (const light of [0, 0.6]) {
          found.push(phongParts(-light, light, 0.6, 0.4, shininess));
        }
        return found;"""
    )
    assert isinstance(page, list)
    for i, parts in enumerate(page):
        shininess, light = [1, 20, 200][i // 2], [0, 0.6][i % 2]
        assert parts["diffuse"] == pytest.approx(0.6 / np.pi * np.cos(light))
        assert parts["specular"] == pytest.approx(0.4 * (shininess + 2) / (2 * np.pi) * np.cos(light))


def test_light_path_stays_outside_of_surfaces_and_loses_light() -> None:
    page = in_page(
        """const shared = new Shared();
        return Array.from({ length: 200 }, (_, seed) => lightPath(shared, seed));"""
    )
    assert isinstance(page, list)
    for path in page:
        throughputs = np.array([hit["throughput"] for hit in path["hits"]])
        assert (np.diff(throughputs, axis=0) <= 0).all()
        assert all(hit["f"][2] >= -1e-9 for hit in path["hits"])
    assert max(len(path["hits"]) for path in page) >= 3


def test_irradiance_of_the_page_equals_the_core(tmp_path: Path) -> None:
    page = in_page(
        """const numbers = { ...firstNumbers(), pixel: [60, 200] }, shared = new Shared();
        Object.assign(shared.numbers, numbers);
        shared.compute();
        const { winner } = shared.steps;
        const found = irradianceOf(winner.f, facingNormal(winner, shared.ray.r), shared.numbers);
        return [found, worldText(numbers, { lights: ["sun"] }), worldText(numbers, { lights: ["bulb"] })];"""
    )
    assert isinstance(page, list)
    albedo = ((0xD9 / 255 + 0.055) / 1.055) ** 2.4
    for name, text in (("sun", page[1]), ("bulb", page[2])):
        (tmp_path / "world.toml").write_text(text, encoding="utf-8")
        frame = raycam.render(
            raycam.load(tmp_path / "world.toml"), integrator="direct", samples=64, region=(60, 200, 1, 1)
        )
        color = float(np.asarray(frame["color"]).reshape(-1, 3)[0, 0])
        assert color == pytest.approx(page[0][name] * albedo / np.pi, rel=0.02), name


def test_floor_points_and_vanishing_points_follow_from_the_camera(states: list[dict[str, object]]) -> None:
    page = in_page(
        f"""return {json.dumps(states)}.map((state) => {{
          const {{ P }} = cameraOf(state), direction = [Math.cos(state.yaw), Math.sin(state.yaw), 0];
          return [P, floorPoint(P, state.pixel), direction, vanishingPoint(P, direction)];
        }});"""
    )
    assert isinstance(page, list)
    for state, (flat, floor, direction, vanishing) in zip(states, page, strict=True):
        P = np.reshape(flat, (3, 4))
        X, C = reference.points_on_lines(P, np.array([state["pixel"]], float)), reference.camera_center(P)
        r = reference.lines(X, C)[0]
        expected = C - C[2] / r[2] * r
        np.testing.assert_allclose(floor, expected[:2], rtol=1e-5, atol=1e-5 * np.abs(expected).max())
        far = P @ [*direction, 0]
        np.testing.assert_allclose(vanishing, far[:2] / far[2], rtol=1e-9)
