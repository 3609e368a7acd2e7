"""The exercises of the lecture's page.

Correct answers are accepted, and each known mistake gets its hint.
"""

from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np
import pytest
from raycam import reference
from support.lecture_truth import camera_of
from support.node_core import needs_node, run_module

pytestmark = needs_node

MISTAKES: dict[str, list[tuple[str, str]]] = {
    "walk": [
        ("add(c, [0.5, -0.2, 0])", "second number is y"),
        ("add(c, [0.5, 0, 0.2])", "along z is negative"),
        ("[9, 9, 9]", "Add 0.5"),
    ],
    "edges": [
        ("minus(a, b)", "from b to a"),
        ("add(a, b)", "This is a + b"),
        ("[9, 9, 9]", "Subtract"),
    ],
    "refined": [("[240]", "20 · 4 · 3"), ("[320]", "two refinements"), ("[1]", "three times")],
    "project": [
        ("[pixel.v, pixel.u]", "column comes first"),
        ("homogeneous.slice(0, 2)", "Divide them by the third"),
        ("[1, 1]", "Append 1"),
    ],
    "principal": [
        ("[p, q, 0.5]", "turns the camera down"),
        ("[q, p, -0.5]", "wrong order"),
        ("[-0.5, Math.sqrt(0.75), -0.5]", "by cos pitch"),
        ("[1, 1, 1]", "roll does not matter"),
    ],
    "line": [
        ("facts.ray.X.slice(0, 3)", "divide them by the fourth"),
        ("facts.ray.C", "a second point is needed"),
        ("rayOfPixel(facts.P, facts.pixel[1], facts.pixel[0]).XPrime", "column comes first"),
        ("[0.3, -0.1, 0.2]", "The image of your point is"),
    ],
    "forward": [
        ("[along, ...negated(facts.ray.r)]", "r = C - X'"),
        ("[-along, ...facts.ray.r]", "not C - X'"),
        ("[dot(rowOf(facts.R, 0), line), ...facts.ray.r]", "another row of R"),
        ("[99, ...facts.ray.r]", "sum of the products"),
    ],
    "normal": [
        ("negated(n)", "the other order changes the sign"),
        ("n.map((value) => value / lengthOf(n))", "the length is not"),
        ("facts.found.edges[0]", "perpendicular to both edges"),
        ("cross(facts.found.edges[0], [1, 2, 3])", "n·(c - a) is not 0"),
    ],
    "distance": [
        ("[-t]", "the sign is wrong"),
        ("[1 / t]", "upside down"),
        ("[facts.found.above]", "divide it by n·r"),
        ("[t * lengthOf(facts.ray.r)]", "distance t |r|"),
        ("[t * dot(facts.ray.r, v)]", "depth t (v·r)"),
        ("[99]", "Divide it by n·r"),
    ],
    "crossings": [
        ("[4]", "0 to 3"),
        ("[facts.found.crossings + 1]", "again: s = "),
        ("[facts.found.crossings - 1]", "again: s = "),
    ],
    "hit": [
        ("onOtherRay(0.2)", "crossings is even"),
        ("onOtherRay(-0.3)", "behind the camera"),
        ("onOtherRay(0.9)", "another one is closer"),
        ("OTHER_RAY.r.map((value) => 0.4 * value)", "This is t r"),
        ("[9, 9, 9]", "smallest positive t"),
    ],
    "halving": [
        ("[512]", "one halving"),
        ("[9]", "Count the halvings"),
        ("[11]", "Count the halvings"),
        ("[3]", "How often"),
    ],
    "bulb": [
        ("[2]", "factor cos θ is missing"),
        ("[6]", "square of the distance, and multiply"),
        ("[18]", "E = I cos"),
        ("[3]", "not by the distance"),
    ],
    "radiance": [
        ("[1]", "light of one direction"),
        ("[Math.PI]", "Divide by π"),
        ("[2 / Math.PI]", "cos θ is missing"),
        ("[(2 * Math.cos(60)) / Math.PI]", "radians"),
        ("[(2 * Math.sin(Math.PI / 3)) / Math.PI]", "contains sin 60°"),
        ("[2]", "First E = S cos θ"),
    ],
    "blocker": [
        ("[-0.4]", "behind the point"),
        ("[1.3]", "farther away than the bulb"),
        ("[1]", "between the point"),
    ],
    "noise": [
        ("[64]", "requires more"),
        ("[4]", "more noise"),
        ("[1]", "factor of 4"),
    ],
    "throughput": [
        ("[1.6]", "the sum"),
        ("[1.6 / 3]", "the mean"),
        ("[1]", "Multiply the three"),
    ],
    "estimator": [
        ("[0.7]", "Divide by the density"),
        ("[0.7 / (2 * Math.PI)]", "This is cos θ · p"),
        ("[Math.PI]", "expected value"),
        ("[1]", "multiply by 2π"),
    ],
    "snell": [("[0.9]", "closer to the normal"), ("[3]", "by the index")],
    "distortion": [
        ("[0.9536]", "k₁ is negative"),
        ("[0.608]", "Square the distance"),
        ("[0.808]", "Multiply it by d"),
        ("[3]", "Put d = 0.8"),
    ],
    "rolling": [
        ("[0.15]", "movement m"),
        ("[45]", "This is f m"),
        ("[500]", "during the readout only"),
        ("[1]", "m = 5 · 0.03"),
    ],
    "frames": [("[2.5]", "60 / 24"), ("[1]", "Multiply the seconds")],
    "depth": [("[45 / 180]", "upside down"), ("[500]", "do not divide"), ("[1]", "Solve δ")],
    "triangulate": [
        ("[4, 2, 0]", "of the first ray, for t = 2"),
        ("[4, 2, 0.4]", "of the second ray"),
        ("[8, 4, 0.4]", "Halve it"),
        ("[1, 1, 1]", "The equations are"),
    ],
    "points": [
        ("[16]", "number of equations"),
        ("[4]", "eleven are unknown"),
        ("[-3]", "one for the row"),
        ("[1]", "eleven free numbers"),
    ],
    "rounding": [
        ("[23]", "exponent is negative"),
        ("[-24]", "before the point"),
        ("[-32]", "Eight of the 32 bits"),
        ("[5]", "last of the 23 digits"),
    ],
}
INTRINSICS = {"fx": 300, "fy": 300, "skew": 0, "cx": 160, "cy": 120}
TURNED = {**INTRINSICS, "C": [0, 0, 0], "roll": 45, "pitch": 30, "yaw": 120}


def closest_midpoint() -> list[float]:
    """The midpoint of the closest points of the exercise's two rays, by least squares."""
    rays, C = np.array([[2, 1, 0], [1, 2, 0]], float), np.array([3, 0, 0.4])
    (t, s), *_ = np.linalg.lstsq(np.column_stack([rays[0], -rays[1]]), C, rcond=None)
    found: list[float] = ((t * rays[0] + C + s * rays[1]) / 2).tolist()
    return found


FIXED: dict[str, float | list[float]] = {
    "refined": 20 * 4**3,
    "principal": np.asarray(camera_of(TURNED).R)[2].tolist(),
    "hit": (np.array([0, -2, 1]) + 0.4 * np.array([1, 4, -0.5])).tolist(),
    "halving": math.log2(1024),
    "bulb": 18 * math.cos(math.pi / 3) / 3**2,
    "radiance": 0.5 / math.pi * 4 * math.cos(math.radians(60)),
    "blocker": 0.6,
    "noise": 16 * (0.08 / 0.02) ** 2,
    "throughput": 0.9 * 0.5 * 0.2,
    "estimator": 0.7 / (1 / (2 * math.pi)),
    "snell": 0.6 / 1.5,
    "distortion": 0.8 * (1 - 0.3 * 0.8**2),
    "rolling": 300 * (5 * 0.03) / 3,
    "frames": 60 * 24,
    "depth": 300 * 0.6 / 45,
    "triangulate": closest_midpoint(),
    "points": 2 * 8 - 11,
    "rounding": math.log2(np.spacing(np.float32(1))),
}


def in_page(script: str) -> Any:
    return run_module("lecture/main.js", f"delete globalThis.onmessage; {script}")


def verdicts(exercise: str) -> list[str]:
    """The verdicts on the exercise's mistakes, at the page's start."""
    answers = ", ".join(expression for expression, _ in MISTAKES[exercise])
    found: list[str] = in_page(
        f"""const facts = factsOf(), {{ n, t }} = facts.found, v = facts.ray.forward;
        const line = minus(facts.behind, facts.ray.C), along = dot(v, line);
        const p = -Math.sqrt(0.75) / 2, q = 0.75;
        const [a, b, c] = facts.corners, add = (x, y) => x.map((value, i) => value + y[i]);
        const pixel = pixelOf(facts.P, c);
        const homogeneous = [0, 1, 2].map((i) => dot(facts.P.slice(4 * i, 4 * i + 3), c) + facts.P[4 * i + 3]);
        return [{answers}].map((values) => verdictOn({json.dumps(exercise)}, values.map(String), facts)).map(
          ({{ right, text }}) => `${{right}} ${{text}}`);"""
    )
    return found


def test_every_exercise_has_tested_mistakes() -> None:
    hints = in_page("return Object.fromEntries(EXERCISES.map(({ id, hint }) => [id, hint.toString()]));")
    assert set(hints) == set(MISTAKES)
    page = re.findall(r'data-exercise="(\w+)"', in_page_text())
    assert sorted(page) == sorted(MISTAKES)
    for exercise, source in hints.items():
        texts = {re.sub(r"-?[\d.]+", "#", text) for text in verdicts(exercise)}
        assert len(texts) >= source.count("return"), (exercise, texts)


def in_page_text() -> str:
    """The page's HTML."""
    from raycam.viewer.bundle import client_file

    return client_file("lecture/index.html")


def test_every_chapter_has_an_exercise() -> None:
    chapters = in_page_text().split("<section ")[1:]
    assert len(chapters) == 21
    assert all("data-exercise" in chapter for chapter in chapters)


@pytest.mark.parametrize("exercise", MISTAKES)
def test_common_mistakes_get_their_hints(exercise: str) -> None:
    for found, (expression, word) in zip(verdicts(exercise), MISTAKES[exercise], strict=True):
        assert found.startswith("false "), (expression, found)
        assert word in found, (expression, found)


def test_parallel_edges_get_their_hint() -> None:
    found = in_page(
        """const facts = factsOf(), crossed = [false, false, false];
        const found = { ...facts.found, crossings: 0, crossed, alongU: [NaN, 0, 0] };
        return verdictOn("crossings", ["1"], { ...facts, found }).text;"""
    )
    assert "parallel to u" in found


def test_answers_of_exercises_with_fixed_numbers_are_correct() -> None:
    found = in_page(
        f"const answerOf = (id) => EXERCISES.find((each) => each.id === id).answer(factsOf());"
        f"return {json.dumps(list(FIXED))}.map((id) => [id, answerOf(id)]);"
    )
    for exercise, answer in found:
        assert answer == pytest.approx(np.ravel(FIXED[exercise]).tolist(), rel=1e-12), exercise


def test_correct_answers_are_accepted_in_random_states() -> None:
    rng = np.random.default_rng(5)
    states = [
        {
            **dict(
                zip(("yaw", "pitch", "roll"), rng.uniform([0, -60, -90], [360, 60, 90]).tolist(), strict=True)
            ),
            **dict(
                zip(
                    INTRINSICS,
                    rng.uniform([200, 200, -9, 100, 80], [400, 400, 9, 200, 160]).tolist(),
                    strict=True,
                )
            ),
            "C": rng.uniform(-3, 3, 3).tolist(),
            "corners": rng.uniform(-4, 4, (3, 3)).tolist(),
            "pixel": rng.integers([320, 240]).tolist(),
        }
        for _ in range(200)
    ]
    found = in_page(
        f"""return [...{json.dumps(states)}, EXERCISE_NUMBERS].map((numbers) => {{
          const facts = factsOf(numbers);
          return {{ numbers, answers: Object.fromEntries(EXERCISES.map((each) => {{
            const answer = each.answer(facts);
            return [each.id, [answer, verdictOn(each.id, answer.map(general), facts).right]];
          }})) }};
        }});"""
    )
    for page in found:
        answers = {exercise: answer for exercise, (answer, right) in page["answers"].items() if right}
        assert set(answers) == set(MISTAKES)
        numbers = page["numbers"]
        P = np.asarray(camera_of(numbers).P)
        X = reference.points_on_lines(P, np.array([numbers["pixel"]], float))
        C, v = reference.camera_center(P), reference.third_row_of_r(P)
        line = reference.lines(X, C)
        triangle = np.array(numbers["corners"], float)
        a, b, c = triangle
        x = P @ [*c, 1]
        r = reference.pointed_forward(line, v)[0]
        r *= 10 / (r @ v)
        n = reference.normals(triangle[None])
        t = reference.plane_distances(n, a[None], C, r[None])[0]
        expected = {
            "walk": c + np.array([0.5, 0, -0.2]),
            "edges": b - a,
            "project": x[:2] / x[2],
            "line": X[0, :3] / X[0, 3],
            "forward": [-10, *r],
            "normal": n[0],
            "distance": t,
            "crossings": reference.crossings(triangle[None], n, (C + t[0] * r)[None], np.zeros(1)).count,
        }
        for exercise, value in expected.items():
            np.testing.assert_allclose(answers[exercise], value, rtol=1e-5, atol=1e-8, err_msg=exercise)


def test_answers_appear_after_their_exercises_are_solved() -> None:
    hidden, shown = in_page(
        "const { given } = EXERCISES.find(({ id }) => id === 'distance');"
        "return [false, true].map((isSolved) => given(factsOf(), () => isSolved).join());"
    )
    assert "(1, 10, -1)" in shown
    assert "(-2, 6, -2)" in shown
    assert "(1, 10, -1)" not in hidden
    assert "(-2, 6, -2)" not in hidden


CODE_MISTAKES = {
    "pointForward": [
        ("return sub(X, C);", "points backward"),
        ("const d = sub(X, C); return scale(-1, dot(v, d) > 0 ? d : sub(C, X));", "points backward"),
        ("return X;", "The result must be"),
    ],
    "normal": [
        ("return cross(sub(b, a), sub(c, a));", "other order changes the sign"),
        (
            "const n = cross(sub(c, a), sub(b, a)); return scale(1 / Math.sqrt(dot(n, n)), n);",
            "Do not divide",
        ),
        ("return [0, 0, 1];", "Use cross"),
    ],
    "planeT": [
        ("return dot(n, sub(C, a)) / dot(n, r);", "The sign is wrong"),
        ("return dot(n, r) / dot(n, sub(a, C));", "upside down"),
        ("return 1;", "Divide dot"),
    ],
    "isInside": [
        ("return 1;", "true or false"),
        ("return false;", "one crossing counted"),
        ("return true;", "count only intersections"),
    ],
    "closest": [
        ("return -1;", "A triangle was hit"),
        ("return 0;", "is closer"),
        ("return 'x';", "Return a number"),
    ],
}
PARAMETERS = {
    "pointForward": "X, C, v",
    "normal": "a, b, c",
    "planeT": "n, a, C, r",
    "isInside": "a, b, c, n, f",
    "closest": "triangles, C, r",
}


@pytest.mark.parametrize("cell", CODE_MISTAKES)
def test_mistakes_in_code_get_their_hints(cell: str) -> None:
    bodies = ", ".join(
        f"({PARAMETERS[cell]}) => {{ {body} }}".replace("'x'", '"x"') for body, _ in CODE_MISTAKES[cell]
    )
    found = in_page(
        f"""const add = (p, q) => p.map((value, i) => value + q[i]), sub = minus;
        const scale = (s, p) => p.map((value) => s * value);
        const {{ cases, hint }} = CODE_EXERCISES.find(({{ id }}) => id === {json.dumps(cell)}), all = cases();
        return [{bodies}].map((written) => {{
          const wrong = all.find(({{ given, expected }}) => !isSame(written(...given), expected));
          return wrong ? hint(written(...wrong.given), wrong.expected, wrong.given) : "right";
        }});"""
    )
    for text, (body, word) in zip(found, CODE_MISTAKES[cell], strict=True):
        assert word in text, (body, text)
