"""The lecture alive in a browser: numbers, pictures, dragged corners, a student. Needs Chromium: `make proof`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.web.live_page import lecture_page
from support.chromium import Tab, chromium
from support.node_core import needs_core

pytestmark = [pytest.mark.proof, needs_core]
DONE = "document.getElementById('picture')?.dataset.samples === '{}'"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    path = tmp_path_factory.mktemp("page") / "lecture.html"
    path.write_text(lecture_page(), encoding="utf-8")
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        made.show(1280, 900)
        made.call("Page.navigate", url=path.as_uri())
        made.wait(DONE.format(1))
        yield made


@pytest.fixture
def tab(browser: Tab) -> Iterator[Tab]:
    """The page as at its start; no test may make it ask for anything or complain."""
    browser.evaluate("location.hash = 'camera'; document.getElementById('reset').click()")
    settle(browser)
    yield browser
    complaints = [line for line in browser.said if "Canvas2D" not in line]  # which tells how to read pictures
    assert complaints == []
    assert all(each.startswith(("file:", "blob:", "data:")) for each in browser.requests), browser.requests


def settle(tab: Tab, samples: int = 1) -> None:
    """Waits for a picture of what was changed last."""
    tab.evaluate("document.getElementById('integrator').dispatchEvent(new Event('change'))")
    tab.wait("document.getElementById('picture').ariaBusy === 'false'")
    tab.wait(f"Number(document.getElementById('picture').dataset.samples) >= {samples}")


def put(tab: Tab, selector: str, value: object) -> None:
    """Writes into an input."""
    tab.evaluate(
        f"((field) => {{ field.value = {json.dumps(str(value))}; field.dispatchEvent(new Event('input')); "
        f"field.dispatchEvent(new Event('change')); }})(document.querySelector({json.dumps(selector)}))"
    )


def world_of(tab: Tab, folder: Path) -> raycam.World:
    """The world that the page gives away."""
    tab.evaluate(
        "globalThis.copied = '', navigator.clipboard.writeText = async (text) => { copied = text; }, "
        "document.getElementById('copy-world').click()"
    )
    tab.wait("copied")
    (folder / "lecture.toml").write_text(tab.evaluate("copied"), encoding="utf-8")
    return raycam.load(folder / "lecture.toml")


def place_of(tab: Tab) -> list[float]:
    """Left, top and width of the picture in the window."""
    found: list[float] = tab.evaluate(
        "(({x, y, width}) => [x, y, width])(document.getElementById('picture').getBoundingClientRect())"
    )
    return found


def matrix(tab: Tab, name: str) -> np.ndarray:
    """A matrix of the page, with all digits."""
    return np.array(
        tab.evaluate(
            f"[...document.querySelectorAll('#matrix-{name} tr')].map((row) => "
            "[...row.querySelectorAll('td')].map((cell) => Number(cell.title)))"
        )
    )


def picture(tab: Tab) -> tuple[int, np.ndarray]:
    """The samples of the page's picture, and its bytes [240, 320, 3]."""
    samples, values = tab.evaluate(
        "((canvas) => [canvas.dataset.samples, [...canvas.getContext('2d').getImageData(0, 0, 320, 240).data]])"
        "(document.getElementById('picture'))"
    )
    return int(samples), np.array(values, np.uint8).reshape(240, 320, 4)[..., :3]


@pytest.mark.parametrize("integrator", ["flat", "direct", "path"])
def test_its_picture_is_raycams(tab: Tab, tmp_path: Path, integrator: str) -> None:
    for key, value in {"roll": 12, "yaw": 100, "pitch": 14, "f": 260, "skew": 20, "C0": 1.3}.items():
        put(tab, f"#{key}", value)
    put(tab, "#integrator", integrator)
    settle(tab, 1 if integrator == "flat" else 4)
    samples, found = picture(tab)
    expected = raycam.render(world_of(tab, tmp_path), integrator=integrator, samples=samples).to_srgb8()
    assert np.array_equal(found, expected)


def test_its_matrices_are_those_of_the_camera(tab: Tab, tmp_path: Path) -> None:
    put(tab, "#yaw-range", 100)
    put(tab, "#roll", -33.5)
    put(tab, "#cx", 140)
    settle(tab)
    camera = world_of(tab, tmp_path).camera("camera")
    for name in "PKR":
        assert np.array_equal(matrix(tab, name), getattr(camera, name)), name
    expected = raycam.Camera.from_pose(
        [2.4, -4.4, 2.4], -33.5, 20, 100, size=(320, 240), K=[[300, 0, 140], [0, 300, 119.5], [0, 0, 1]]
    )
    assert np.allclose(camera.P, expected.P, atol=1e-12)


@pytest.mark.parametrize(
    ("field", "value", "word"), [("f", 0, "K"), ("C0", 1e300, ""), ("f", -1e-320, "K"), ("pitch", 1e9, "")]
)
def test_numbers_that_make_no_camera_are_told(tab: Tab, field: str, value: float, word: str) -> None:
    put(tab, f"#{field}", value)
    if word:
        tab.wait("document.getElementById('picture').ariaBusy === 'false'")
        assert word in tab.evaluate("document.getElementById('message').textContent")
    tab.evaluate("document.getElementById('reset').click()")
    settle(tab)
    assert tab.evaluate("document.getElementById('message').hidden")


def test_a_click_explains_the_pixel(tab: Tab, tmp_path: Path) -> None:
    tab.evaluate("location.hash = 'pixel'")
    tab.wait("document.body.dataset.tab === 'pixel'")
    box = place_of(tab)
    scale = box[2] / 320
    tab.click(box[0] + 150.5 * scale, box[1] + 163.5 * scale)
    tab.wait("document.getElementById('steps').textContent.includes('(150, 163)')")
    world = world_of(tab, tmp_path)
    explained = raycam.explain(world, world.camera("camera"), (150, 163))
    shown = tab.evaluate("document.getElementById('steps').textContent")
    assert f"t = {explained.winner.t:.6g}" in shown
    assert explained.winner.object_name in tab.evaluate(
        "document.getElementById('candidate').selectedOptions[0].textContent"
    )
    crossings = tab.evaluate("document.querySelectorAll('#figure .crossing').length")
    assert crossings == explained.winner.crossings


def test_a_corner_is_dragged_at_its_depth(tab: Tab, tmp_path: Path) -> None:
    before = world_of(tab, tmp_path)
    camera = before.camera("camera")
    corner = np.asarray(before.triangles())[-2, 2]  # c of the green one
    x, y, z = camera.P @ [*corner, 1]
    box = place_of(tab)
    place = [box[i] + (at + 0.5) * box[2] / 320 for i, at in enumerate((x / z, y / z))]
    tab.mouse("mousePressed", *place, button="left", clickCount=1)
    for step in (10, 25, 40):
        tab.mouse("mouseMoved", place[0] - step, place[1] + step / 2, button="left", buttons=1)
    tab.mouse("mouseReleased", place[0] - 40, place[1] + 20, button="left", clickCount=1)
    after = np.asarray(world_of(tab, tmp_path).triangles())
    moved = camera.P @ [*after[-2, 2], 1]
    shift = 320 / box[2] * np.array([-40, 20])
    assert np.allclose(moved[:2] / moved[2], np.array([x / z, y / z]) + shift, atol=0.5)
    assert abs(moved[2] - z) < 0.002
    assert np.array_equal(np.delete(after, -2, 0), np.delete(np.asarray(before.triangles()), -2, 0))


@pytest.mark.parametrize("lights", [1, 2, 3, 4])
def test_lights_are_one_to_four(tab: Tab, tmp_path: Path, lights: int) -> None:
    tab.evaluate(
        f"location.hash = 'light'; document.querySelector('#light-count input[value=\"{lights}\"]').click()"
    )
    tab.wait("document.getElementById('integrator').value === 'direct'")
    assert len(world_of(tab, tmp_path).lights) == lights


class Student:
    """One who computes with NumPy what the exercises ask."""

    def __init__(self, world: raycam.World, pixel: tuple[int, int]) -> None:
        camera = world.camera("camera")
        x = np.array([*pixel, 1.0])
        X = np.linalg.pinv(camera.P) @ x
        self.X, self.C, self.v = X[:3] / X[3], camera.C, camera.R[2]
        self.along = self.v @ (self.X - self.C)
        self.r = np.sign(self.along) * (self.X - self.C)
        hits = [
            (found["t"], found) for found in map(self.meet, np.asarray(world.triangles())) if found["t"] > 0
        ]
        inside = [each for each in hits if each[1]["crossings"] % 2]
        self.found = min(inside, key=lambda each: each[0])[1]

    def meet(self, corners: np.ndarray) -> dict:
        a, b, c = corners
        n = np.cross(c - a, b - a)
        t = n @ (a - self.C) / (n @ self.r) if n @ self.r else -1
        f = self.C + t * self.r
        u = a + (a - c) - f
        crossings = 0
        for start, edge in ((a, b - a), (b, c - b), (c, a - c)):
            # f + s u = start + q edge, in the least squares sense
            (s, q), *_ = np.linalg.lstsq(np.stack([u, -edge], 1), start - f, rcond=None)
            crossings += 0 <= s <= 1 and 0 <= q <= 1
        return {"n": n, "t": t, "crossings": int(crossings)}

    def answers(self) -> dict[str, list[float]]:
        return {
            "line": self.X.tolist(),
            "forward": [*self.v, self.along],
            "normal": self.found["n"].tolist(),
            "distance": [self.found["t"]],
            "crossings": [self.found["crossings"]],
        }


def answer(tab: Tab, exercise: str, values: list[object]) -> tuple[str, str]:
    """The class and the text of the verdict."""
    for i, value in enumerate(values):
        put(tab, f"#exercise-{exercise} label:nth-of-type({i + 1}) input", value)
    tab.evaluate(f"document.querySelector('#exercise-{exercise} button').click()")
    found = tab.evaluate(
        f"((p) => [p.className, p.textContent])(document.querySelector('#exercise-{exercise} .verdict'))"
    )
    return found[0].split()[-1], found[1]


@pytest.mark.parametrize("rounds", range(3))
def test_a_student_solves_five_exercises(tab: Tab, tmp_path: Path, rounds: int) -> None:
    tab.evaluate("location.hash = 'exercises'")
    put(tab, "#yaw", 112 + 3 * rounds)
    settle(tab)
    for _ in range(rounds + 1):
        tab.evaluate("document.getElementById('another').click()")
    pixel = tuple(
        tab.evaluate("['u', 'v'].map((name) => document.getElementById(`pixel-${name}`).valueAsNumber)")
    )
    student = Student(world_of(tab, tmp_path), pixel)
    for exercise, values in student.answers().items():
        kind, text = answer(tab, exercise, [f"{value:.6g}" for value in values])
        assert kind == "right", (exercise, values, text)
    assert tab.evaluate("document.getElementById('solved').textContent") == "5 of 5 solved."
    kind, text = answer(tab, "line", (student.C + 0.7 * (student.X - student.C)).tolist())
    assert (kind, "another point" in text) == ("right", True)


def test_wrong_answers_get_their_hint(tab: Tab, tmp_path: Path) -> None:
    tab.evaluate("location.hash = 'exercises'")
    tab.evaluate("document.getElementById('another').click()")
    pixel = tuple(
        tab.evaluate("['u', 'v'].map((name) => document.getElementById(`pixel-${name}`).valueAsNumber)")
    )
    student = Student(world_of(tab, tmp_path), pixel)
    right = student.answers()
    for exercise, values, word in [
        ("line", student.C.tolist(), "centre"),
        ("line", [0, 0, 0], "is seen at"),
        ("line", ["1,5", "2", "3"], "a point stands"),
        ("line", ["", "2", "3"], "write a number"),
        ("forward", [*(-student.v), student.along], "backward"),
        ("forward", [*student.v, -student.along], "sign"),
        ("normal", (-student.found["n"]).tolist(), "order"),
        ("normal", (2 * student.found["n"]).tolist(), "length"),
        ("normal", [1, 0.2, 0.3], "stands on both edges"),
        ("distance", [-student.found["t"]], "sign"),
        ("distance", [student.found["t"] * np.linalg.norm(student.r)], "distance t |r|"),
        ("distance", [1.01 * student.found["t"]], "Divide"),
        ("crossings", [right["crossings"][0] + 1], "again"),
        ("crossings", [1.5], "three edges"),
    ]:
        kind, text = answer(tab, exercise, values)
        assert (kind, word in text) == ("wrong", True), (exercise, word, text)
    assert tab.evaluate("document.getElementById('solved').textContent") == "0 of 5 solved."
    # Within the tolerance that is stated, and beyond it.
    t = student.found["t"]
    assert answer(tab, "distance", [t * 1.0008])[0] == "right"
    assert answer(tab, "distance", [t * 1.0012])[0] == "wrong"
