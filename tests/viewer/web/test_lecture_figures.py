"""Every number in the lecture's figures, compared with `raycam.reference`.

`make proof` tests 1,000 random states of each figure, other runs a few. The figures run in Node as in the
page, on canvases that draw nothing. Their labels are checked for overlaps as well.
"""

from __future__ import annotations

import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam import reference
from support.lecture_truth import MINUS, NAMES, TRUTHS, Truth, camera_of, to_sun
from support.node_core import needs_node, run_module

pytestmark = needs_node
COUNTS = pytest.mark.parametrize("count", [24, pytest.param(1000, marks=pytest.mark.proof)])
SCRIPT = Path(__file__).with_name("lecture_states.js").read_text(encoding="utf-8")
NUMBER = re.compile(rf"(?<![\w#.]){MINUS}?(?:\d+(?:\.\d+)?|∞)")
NAME = re.compile("|".join(sorted(NAMES, key=len, reverse=True)))
BUTTONS = {
    "box": ("Play", "Back"),
    "closest": ("Play",),
    "tree": ("Play",),
    "path": ("Another path", "Play"),
    "mean": ("Other random numbers",),
}
"""The buttons that are clicked in each state."""
ANSWERS = """{ refine: ({ onWorld }, { text }) =>
  onWorld({ corners: new Float64Array(126 * 4 ** text.match(/refine = (\\d)/)[1]) }) }"""


def in_page(script: str) -> Any:
    """Runs a script in the scope of the page's modules.

    Stand-in elements store the texts that the script shows.
    """
    return run_module("lecture/main.js", f"delete globalThis.onmessage; {SCRIPT} {script}")


@pytest.fixture(scope="module")
def start() -> dict[str, Any]:
    """The page's world at its start."""
    found: dict[str, Any] = in_page(
        "const numbers = firstNumbers(); return { numbers, corners: cornersOf(numbers), text: worldText(numbers) };"
    )
    return found


def random_states(name: str, first: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Random states of a figure.

    Two thirds are close to the page's start, so that most pixels show a triangle; the others are anywhere.
    """
    rng = np.random.default_rng([ord(each) for each in name])
    states: list[dict[str, Any]] = []
    total = 0
    for k in range(count):
        near = k % 3 < 2 or name == "calibration"
        corners = [rng.uniform([-2, -2, 0], 2, (3, 3)).tolist() for _ in range(2)]
        codes = [f"#{rng.integers(1 << 24):06x}" for _ in range(2)]
        numbers = {
            "fx": rng.uniform(200, 420) if near else rng.uniform(120, 700),
            "fy": rng.uniform(200, 420) if near else rng.uniform(120, 700),
            "skew": rng.uniform(-20, 20) if near else rng.uniform(-150, 150),
            "cx": rng.uniform(120, 200) if near else rng.uniform(0, 319),
            "cy": rng.uniform(90, 150) if near else rng.uniform(0, 239),
            "roll": rng.uniform(-20, 20) if near else rng.uniform(-180, 180),
            "pitch": rng.uniform(10, 30) if near else rng.uniform(-89, 89),
            "yaw": rng.uniform(100, 135) if near else rng.uniform(0, 360),
            "C": (np.array(first["C"]) + rng.uniform(-1, 1, 3)).tolist()
            if near
            else [*rng.uniform(-6, 6, 2), rng.uniform(0.2, 6)],
            "pixel": [int(rng.integers(320)), int(rng.integers(240))],
            "bulb": rng.uniform([-2, -2, 0.2], 3, 3).tolist(),
            "sun": rng.uniform(-180, 180),
            "height": rng.uniform(5, 90),
            "triangles": [
                {"name": each, "corners": points, "color": code}
                for each, points, code in zip(("green", "blue"), corners, codes, strict=True)
            ],
        }
        clicks = {text: int(rng.integers(4)) for text in BUTTONS.get(name, ()) if text != "Play"}
        total += sum(clicks.values())
        if "Play" in BUTTONS.get(name, ()):
            clicks = {"Play": 1, **clicks} if name == "box" else {**clicks, "Play": 1}
        states.append(
            {
                "numbers": numbers,
                "sliders": rng.uniform(0, 1, 12).tolist(),
                "choices": [int(rng.integers(2))] if name == "lights" else [],
                "clicks": clicks,
                "total": total,
                "linear": linear_colors(codes),
            }
        )
    return states


BOX_LINEAR = [
    *([0.68, 0.02, 0.05], [0.9, 0.16, 0.06], [0.02, 0.13, 0.4], [0.17, 0.4, 0.73]),
    *([0.01, 0.33, 0.26], [0.1, 0.63, 0.51], [0.2, 0.04, 0.27], [0.46, 0.2, 0.64]),
    *([0.03, 0.02, 0.07], [0.1, 0.07, 0.25], [0.76, 0.54, 0.05], [0.92, 0.79, 0.26]),
]
"""Linear colours of the box's triangles, as in its world file."""


def linear_colors(codes: list[str]) -> list[list[float]]:
    """The linear colours of all triangles, from 8-bit sRGB, which the page keeps."""
    box = np.array(BOX_LINEAR)
    codes_of_box = np.round(255 * np.where(box <= 0.0031308, 12.92 * box, 1.055 * box ** (1 / 2.4) - 0.055))
    free = [[int(code[i : i + 2], 16) for i in (1, 3, 5)] for code in codes]
    srgb = np.array([[217, 212, 199], [217, 212, 199], *codes_of_box, *free]) / 255
    linear: list[list[float]] = np.where(
        srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4
    ).tolist()
    return linear


def assert_shown(text: list[str], expected: list[float], where: object) -> None:
    """Checks each number in the texts to the digits shown."""
    words = NUMBER.findall(NAME.sub("", "\n".join(text)))
    assert len(words) == len(expected), (where, text, expected)
    for word, value in zip(words, expected, strict=True):
        shown = float(word.replace(MINUS, "-").replace("∞", "inf"))
        digits = len(word.partition(".")[2])
        assert shown == pytest.approx(value, rel=1e-6, abs=0.5000001 * 10.0**-digits), (where, text, expected)


@COUNTS
@pytest.mark.parametrize("name", TRUTHS)
def test_numbers_equal_the_reference_in_random_states(name: str, start: dict[str, Any], count: int) -> None:
    states = random_states(name, start["numbers"], count)
    sent = [{key: state[key] for key in ("numbers", "sliders", "choices", "clicks")} for state in states]
    found = in_page(f"return textsOf({json.dumps(name)}, {json.dumps(sent)}, {ANSWERS});")
    fixed = np.reshape(start["corners"], (-1, 3, 3))[:14]
    for k, (shown, state) in enumerate(zip(found, states, strict=True)):
        truth = Truth(shown, fixed, state)
        tables = [cell for table in shown["tables"] for cell in table]
        assert_shown([*shown["lines"], *tables], TRUTHS[name](truth), (name, k, shown["numbers"]))
        for output, value in zip(shown["outputs"], shown["values"], strict=True):
            if name != "plane":
                assert_shown([output], [value], (name, k))
        for canvas in shown["labels"]:
            assert_apart(canvas, (name, k))
        check_labels(name, truth, [label["text"] for canvas in shown["labels"] for label in canvas])


def assert_apart(labels: list[dict[str, Any]], where: object) -> None:
    """Checks that no two labels overlap."""
    for a, b in combinations(labels, 2):
        beside = a["x"] >= b["x"] + b["width"] or b["x"] >= a["x"] + a["width"]
        assert beside or a["y"] >= b["y"] + b["height"] or b["y"] >= a["y"] + a["height"], (where, a, b)


def check_labels(name: str, truth: Truth, labels: list[str]) -> None:
    """Checks the numbers in a figure's labels."""
    numbered = [label for label in labels if re.search(r"\d\.\d", label)]
    if name == "origin" and numbered:
        assert_shown(numbered, [*truth.triangles[14][2]], name)
    elif name == "plane" and truth.index >= 0 and numbered:
        assert_shown(numbered, [truth.t], name)
    elif name == "project" and numbered:
        x = truth.P @ [*truth.triangles[14][2], 1]
        assert_shown(numbered, list(x[:2] / x[2]), name)


@COUNTS
def test_crossings_equal_the_reference_in_random_states(count: int) -> None:
    rng = np.random.default_rng(12)
    points = np.array([[0.8125, 0.75], [0, 0], [2, 0.25], [0.75, 1.75]])
    selected, expected, moves = 0, [], []
    for _ in range(count):
        keys = [str(key) for key in rng.choice([*ARROWS, "Enter"], 6)]
        for key in keys:
            if key == "Enter":
                selected = (selected + 1) % 4
            else:
                moved = points[selected] + 10 / 64 * np.array(ARROWS[key])
                points[selected] = np.clip(moved, [-1.25, -1.75], [3, 2])
        moves.append(keys)
        expected.append(points.copy())
    found = in_page(f"return crossingTexts({json.dumps(moves)});")
    for lines, state in zip(found, expected, strict=True):
        triangle = np.column_stack([state[1:], np.zeros(3)])
        f, n = np.array([*state[0], 0]), reference.normals(triangle[None])[0]
        if not n.any():
            continue
        truth = reference.crossings(triangle[None], n[None], f[None], np.array([1e-12]))
        numbers = [*truth.u[0][:2]]
        for s, q in zip(truth.along_u[0], truth.along_edge[0], strict=True):
            numbers += [] if np.isnan(s) else [s, q]
        numbers = [*numbers, int(truth.count[0])]
        assert_shown([re.sub(r"[₁₂₃]", "", line) for line in lines], numbers, state)
        assert lines[-1].endswith("inside" if reference.inside(truth)[0] else "outside"), (lines, state)
        # The values are exact, because all of them are multiples of 1/64.
        ways, u = state[1:] - state[0], truth.u[0][:2]
        on_walk = [name for name, (x, y) in zip("abc", ways, strict=True) if x * u[1] == y * u[0]]
        assert ("exactly through " + " and ".join(on_walk) in lines[-2]) == bool(on_walk)


ARROWS = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, 1), "ArrowDown": (0, -1)}


def test_vertex_passed_by_the_ray_counts_once() -> None:
    (lines,) = in_page("return crossingTexts([[]], 'Send u through vertex b');")
    assert "u passes exactly through b, which counts as right of u" in lines
    assert lines[-1] in ("0 crossings: even, f(t) is outside", "2 crossings: even, f(t) is outside")


CAMERA = ["C", "v", "roll"]
CORNERS = ["a", "b", "c"]
HANDLES: dict[tuple[str, str], list[list[str]]] = {
    ("hero", ""): [[*CORNERS, *CAMERA, "bulb", "sun"], [*CORNERS, "bulb", "sun"]],
    ("matrix", ""): [[*CAMERA, *CORNERS], CORNERS],
    ("angles", ""): [CAMERA, []],
    ("sign", ""): [CAMERA],
    ("project", ""): [["X", *CAMERA], ["X"]],
    ("normal", ""): [CORNERS],
    ("lights", ""): [["sun", *CAMERA], ["sun"]],
    ("lights", "Bulb"): [["bulb", *CAMERA], ["bulb"]],
    ("shadow", ""): [["bulb", *CAMERA], ["bulb"]],
    ("closest", ""): [CAMERA, []],
    ("plane", ""): [CAMERA, []],
    ("back-project", ""): [CAMERA, []],
    ("path", ""): [CAMERA],
}
"""The points that are dragged in each view of a figure, after a click on a button."""


@pytest.mark.parametrize(("name", "button"), HANDLES)
def test_points_are_moved_in_every_view_that_shows_them(name: str, button: str) -> None:
    found = in_page(f"return handlesOf({json.dumps(name)}, {json.dumps(button)});")
    names = [[text for text, _ in canvas] for canvas in found]
    assert names == HANDLES[name, button]
    assert all(moves for canvas in found for _, moves in canvas)


def random_cameras(first: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """The parameters (the page's `numbers`) of random cameras that face the world's triangles."""
    return [state["numbers"] for state in random_states("steer", first, count)]


def dragged(numbers: dict[str, Any], mode: str, places: list[list[float]]) -> dict[str, Any]:
    """The camera's parameters after a drag in the picture of the first figure.

    The picture has 640 x 480 CSS pixels.
    """
    found: list[dict[str, Any]] = in_page(
        f"return draggedNumbers('hero', {json.dumps(numbers)}, {json.dumps(mode)}, {json.dumps(places)});"
    )
    return found[-1]


def pixel_of(place: list[float]) -> list[float]:
    """The pixel at a place of that picture."""
    return [value / 2 - 0.5 for value in place]


def direction_of(numbers: dict[str, Any], pixel: list[float]) -> Any:
    """The direction that a pixel shows."""
    camera = camera_of(numbers)
    return np.asarray(camera.R).T @ np.linalg.solve(np.asarray(camera.K), [*pixel, 1])


FAR = {
    "triangles": [
        {"name": each, "corners": [[90, 90, 90]] * 3, "color": "#000000"} for each in ("green", "blue")
    ]
}
"""Triangles whose handles are far away from the picture."""


@pytest.mark.parametrize("seed", range(12))
def test_turned_image_follows_the_pointer(seed: int, start: dict[str, Any]) -> None:
    rng = np.random.default_rng(seed)
    numbers = {
        **random_cameras(start["numbers"], 12)[seed],
        **FAR,
        "bulb": [90, 90, 90],
        "sun": 0,
        "height": 90,
    }
    numbers |= dict(
        zip(("pitch", "fx", "fy"), rng.uniform([-40, 250, 250], [40, 420, 420]).tolist(), strict=True)
    )
    places = (np.array([320, 240]) + rng.uniform(-90, 90, (4, 2))).tolist()
    after = dragged(numbers, "Turn R", places)
    assert after["roll"] == pytest.approx(numbers["roll"], abs=0.006)
    seen = np.asarray(camera_of(after).P)[:, :3] @ direction_of(numbers, pixel_of(places[0]))
    # Angles are rounded to 0.01 degrees in each of three steps.
    assert seen[:2] / seen[2] == pytest.approx(pixel_of(places[-1]), abs=0.02 * np.radians(1) * 700 * 3)


@pytest.mark.parametrize("seed", range(12))
def test_rolled_image_follows_the_pointer(seed: int, start: dict[str, Any]) -> None:
    numbers = {
        **random_cameras(start["numbers"], 12)[seed],
        **FAR,
        "fx": 300,
        "fy": 300,
        "skew": 0,
        "cx": 159.5,
        "cy": 119.5,
    }
    numbers |= {"bulb": [90, 90, 90], "sun": 0, "height": 90}
    turn = np.radians(10 * seed - 55)
    places = [[320 + 230, 240 + 5], [320 + 230 * np.cos(turn), 240 + 230 * np.sin(turn)]]
    after = dragged(numbers, "Turn R", places)
    np.testing.assert_allclose(camera_of(after).R[2], camera_of(numbers).R[2], atol=2e-4)
    x, y = (np.array(pixel_of(place)) - [159.5, 119.5] for place in places)
    seen = np.asarray(camera_of(after).P)[:, :3] @ direction_of(numbers, pixel_of(places[0]))
    found = seen[:2] / seen[2] - [159.5, 119.5]
    assert np.arctan2(*found[::-1]) == pytest.approx(np.arctan2(*y[::-1]), abs=1e-3)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(x), abs=0.05)


@pytest.mark.parametrize("seed", range(12))
def test_moved_image_follows_the_pointer(seed: int, start: dict[str, Any]) -> None:
    rng = np.random.default_rng(seed)
    numbers = {
        **start["numbers"],
        "roll": float(rng.uniform(-30, 30)),
        "bulb": [90, 90, 90],
        "sun": 0,
        "height": 90,
    }
    camera = camera_of(numbers)
    first = np.array(numbers["pixel"])
    line = direction_of(numbers, first.tolist())
    found = reference.trace(
        np.reshape(start["corners"], (-1, 3, 3)), np.array(numbers["C"], float), line[None]
    )
    depth = float(found.t[0]) * float(line @ np.asarray(camera.R)[2])
    # A point at the depth of the selected pixel follows the pointer, away from handles.
    places = [[60.0, 60.0], [60 + rng.uniform(-40, 40), 60 + rng.uniform(-40, 40)]]
    way = direction_of(numbers, pixel_of(places[0]))
    point = np.array(numbers["C"]) + depth / (way @ np.asarray(camera.R)[2]) * way
    after = dragged(numbers, "Move C", places)
    assert project_pixel(after, point) == pytest.approx(pixel_of(places[1]), abs=0.1)
    np.testing.assert_array_equal(camera_of(after).R, camera.R)


def project_pixel(numbers: dict[str, Any], point: Any) -> Any:
    """The pixel of a point."""
    x = np.asarray(camera_of(numbers).P) @ [*point, 1]
    return x[:2] / x[2]


def test_drag_at_the_right_edge_moves_the_camera_forward(start: dict[str, Any]) -> None:
    numbers = start["numbers"]
    after = dragged(numbers, "Move C", [[620, 300], [620, 260]])
    way = np.array(after["C"]) - numbers["C"]
    forward = np.asarray(camera_of(numbers).R)[2]
    assert way @ forward == pytest.approx(np.linalg.norm(way), rel=1e-3)
    assert np.linalg.norm(way) == pytest.approx(0.015 * 20, abs=2e-3)


def test_sun_in_view_follows_the_pointer(start: dict[str, Any]) -> None:
    numbers = {**start["numbers"], "pitch": -20, "sun": 120.0, "height": 25.0}
    sun = np.asarray(camera_of(numbers).P)[:, :3] @ to_sun(numbers)
    at = (2 * (sun[:2] / sun[2]) + 1).tolist()
    goal = [at[0] + 60, at[1] - 40]
    after = dragged(numbers, "", [at, goal])
    seen = np.asarray(camera_of(after).P)[:, :3] @ to_sun(after)
    # The tolerance corresponds to 0.1 degrees.
    assert seen[:2] / seen[2] == pytest.approx(pixel_of(goal), abs=0.6)


def test_sun_behind_the_camera_has_a_marker_at_the_edge(start: dict[str, Any]) -> None:
    at, sides = in_page(
        "const numbers = firstNumbers(); return [sunInPicture(numbers),"
        " [10, 20, 160, 170].map((off) => sunInPicture({ ...numbers, sun: numbers.yaw - 180 + off }).pixel[0])];"
    )
    assert not at["isInside"]
    assert at["pixel"][0] in (pytest.approx(19.5), pytest.approx(299.5)) or at["pixel"][1] == pytest.approx(
        19.5
    )
    assert sides[0] > 159.5  # if the sun is behind the camera on the right, the camera must turn right
    numbers = start["numbers"]
    x, y = (2 * value + 1 for value in at["pixel"])
    after = dragged(numbers, "", [[x, y], [x - 30, y - 20]])
    assert after["sun"] == pytest.approx(numbers["sun"] + np.degrees(15 / 300), abs=0.06)
    assert after["height"] == pytest.approx(numbers["height"] + np.degrees(10 / 300), abs=0.06)


def test_keys_turn_and_move_the_camera(start: dict[str, Any]) -> None:
    numbers = start["numbers"]
    keys = ["t", "ArrowRight", "ArrowUp", "PageUp", "m", "ArrowLeft", "PageUp", "p", "ArrowRight"]
    found = in_page(f"return numbersAfterKeys('matrix', {json.dumps(numbers)}, {json.dumps(keys)});")
    assert [found[3][key] - numbers[key] for key in ("yaw", "pitch", "roll")] == [-1, -1, 1]
    R = np.asarray(camera_of(found[3]).R)
    np.testing.assert_allclose(np.array(found[5]["C"]) - numbers["C"], -0.05 * R[0], atol=1e-3)
    np.testing.assert_allclose(np.array(found[6]["C"]) - found[5]["C"], 0.05 * R[2], atol=1e-3)
    assert found[8]["pixel"] == [numbers["pixel"][0] + 1, numbers["pixel"][1]]
    assert found[8]["C"] == found[6]["C"]


def test_points_of_the_bent_grid_equal_pixels_of_a_camera_with_distortion() -> None:
    rng = np.random.default_rng(3)
    K = [[280, 5, 150], [0, 310, 125], [0, 0, 1]]
    ways = rng.uniform(-0.7, 0.7, (50, 2))
    for k1 in (-0.3, 0.25):
        camera = raycam.Camera.from_pose([0, 0, 0], 0, 0, 0, size=(320, 240), K=K, distortion=[k1, 0, 0, 0])
        found = in_page(
            "const numbers = { ...firstNumbers(), fx: 280, fy: 310, skew: 5, cx: 150, cy: 125 };"
            f"return {json.dumps(ways.tolist())}.map(([x, y]) => distortedPixel(numbers, {k1}, x, y));"
        )
        points = np.column_stack([ways, np.ones(len(ways))]) @ np.asarray(camera.R)
        np.testing.assert_allclose(found, camera.project(points)[0], atol=1e-9)


def test_noise_measured_from_two_images_equals_its_formula() -> None:
    page = in_page(
        """const random = randomOf(8), found = [];
        for (let k = 0; k < 1000; k++) {
          const count = 1 + Math.floor(30 * random()), draw = () => Array.from({ length: count }, random);
          const [a, b] = [draw(), draw()];
          found.push([a, b, noiseOf(a, b)]);
        }
        return found;"""
    )
    for a, b, noise in page:
        assert noise == pytest.approx(np.sqrt(np.mean(np.subtract(a, b) ** 2) / 2), rel=1e-12)


def test_refined_mesh_has_the_number_of_triangles_that_is_shown(tmp_path: Path) -> None:
    texts = in_page(
        """const found = {};
        textsOf("refine", [0, 0.25, 0.5, 0.75, 1].map((share) => ({ numbers: firstNumbers(), sliders: [share] })),
          { refine: (_, { text }) => { found[text.match(/refine = (\\d)/)[1]] = text; } });
        return found;"""
    )
    for level, text in texts.items():
        (tmp_path / "head.toml").write_text(text, encoding="utf-8")
        assert len(raycam.load(tmp_path / "head.toml").triangles()) == 14 * 4 ** int(level)
    assert len(texts) == 5
