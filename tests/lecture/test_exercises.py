"""Checks of the notebook's exercises.

Solutions pass, common mistakes get their hint, and no answer raises an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.lecture import exercises

Function = Callable[..., Any]


def center(P: Any) -> Any:
    return np.linalg.solve(P[:, :3], -P[:, 3])


def ray(P: Any, u: float, v: float) -> Any:
    X = np.linalg.pinv(P) @ [u, v, 1]
    line = X[:3] / X[3] - center(P)
    forward = P[2, :3] * np.sign(np.linalg.det(P[:, :3]))
    return line if line @ forward > 0 else -line


def plane_distance(triangle: Any, C: Any, r: Any) -> Any:
    a, b, c = triangle
    n = np.cross(c - a, b - a)
    return n @ (a - C) / (n @ r) if abs(n @ r) > 1e-12 else np.nan


def sides(triangle: Any, point: Any) -> list[float]:
    a, b, c = triangle
    n = np.cross(b - a, c - a)
    return [float(np.cross(q - p, point - p) @ n) for p, q in ((a, b), (b, c), (c, a))]


def is_inside(triangle: Any, point: Any) -> bool:
    return min(sides(triangle, point)) >= 0


def closest(triangles: Any, C: Any, r: Any) -> int:
    best, found = np.inf, -1
    for number, triangle in enumerate(triangles):
        t = plane_distance(triangle, C, r)
        if 0 <= t < best and is_inside(triangle, C + t * r):
            best, found = t, number
    return found


def rotation(P: Any) -> Any:
    return raycam.Camera.from_matrix(P, size=(48, 36)).R


def normalised_in_place(triangle: Any, C: Any, r: Any) -> Any:
    r /= np.linalg.norm(r)
    return plane_distance(triangle, C, r)


FIRST = raycam.Camera.look_at([1.5, -4, 1.6], [0.4, 0, 0], size=(48, 36), fov=30).P
"""The camera matrix of the notebook."""

CORRECT: dict[str, tuple[Function, Function]] = {
    "center": (exercises.check_center, center),
    "ray": (exercises.check_ray, ray),
    "plane_distance": (exercises.check_plane_distance, plane_distance),
    "is_inside": (exercises.check_is_inside, is_inside),
    "closest": (exercises.check_closest, closest),
}


@pytest.mark.parametrize("name", CORRECT)
def test_solution_is_correct(name: str) -> None:
    check, function = CORRECT[name]
    verdict = check(function)
    assert verdict.correct, verdict.text


@pytest.mark.parametrize("name", CORRECT)
@pytest.mark.parametrize("wrong", [lambda *given: None, lambda *given: ..., lambda *given: 1 / 0, lambda: 0])
def test_unanswered_exercise_is_reported_without_raising_an_error(name: str, wrong: Function) -> None:
    assert not CORRECT[name][0](wrong)


# Wrong answers, each with a word that only the hint for this mistake contains.
MISTAKES: list[tuple[Function, Function, str]] = [
    (exercises.check_center, lambda P: -center(P), "sign"),
    (exercises.check_center, lambda P: np.linalg.solve(P[:, :3].T, -P[:, 3]), "transposed"),
    (exercises.check_center, lambda P: -P[:, :3].T @ P[:, 3], "inverse"),
    (exercises.check_center, lambda P: -rotation(P) @ center(P), "translation"),
    (exercises.check_center, lambda P: np.append(center(P), 1), "fourth"),
    (exercises.check_ray, lambda P, u, v: -ray(P, u, v), "backwards"),
    (exercises.check_ray, lambda P, u, v: ray(P, u + 0.5, v + 0.5), "half a pixel"),
    (exercises.check_ray, lambda P, u, v: ray(P, u - 0.5, v - 0.5), "half a pixel"),
    (exercises.check_ray, lambda P, u, v: ray(P, v, u), "swapped"),
    (exercises.check_ray, lambda P, u, v: rotation(P) @ rotation(P) @ ray(P, u, v), "R is transposed"),
    (exercises.check_plane_distance, lambda t, C, r: -plane_distance(t, C, r), "sign"),
    (
        exercises.check_plane_distance,
        lambda t, C, r: plane_distance(t, C, r / np.linalg.norm(r)),
        "normalise",
    ),
    (exercises.check_plane_distance, lambda t, C, r: 1 / plane_distance(t, C, r), "swapped"),
    (exercises.check_plane_distance, lambda t, C, r: np.nan_to_num(plane_distance(t, C, r)), "NaN"),
    (exercises.check_is_inside, lambda t, p: not is_inside(t, p), "inverted"),
    (exercises.check_is_inside, lambda t, p: True, "outside"),
    (exercises.check_is_inside, lambda t, p: sides(t, p)[0] >= 0, "edges"),
    (exercises.check_is_inside, lambda t, p: bool(((p > t.min(0)) & (p < t.max(0))).all()), "bounding box"),
    (exercises.check_closest, lambda t, C, r: closest(t[::-1], C, r), "nearest"),
    (exercises.check_closest, lambda t, C, r: 0, "nearest"),
    (exercises.check_closest, lambda t, C, r: 2.0, "index of the triangle"),
    (exercises.check_closest, lambda t, C, r: np.array([closest(t, C, r), 1]), "index of the triangle"),
    (
        exercises.check_closest,
        lambda t, C, r: closest(t, C, r) if closest(t, C, r) >= 0 else None,
        "Return -1",
    ),
    (exercises.check_is_inside, lambda t, p: np.array(sides(t, p)) >= 0, "True or False"),
    (exercises.check_is_inside, lambda t, p: "yes", "True or False"),
    (exercises.check_center, lambda P: center(FIRST), "argument P"),
    (exercises.check_center, lambda P: center(P) + 0j, "real numbers"),
    (exercises.check_ray, lambda P, u, v: ray(FIRST, u, v), "argument P"),
    (exercises.check_ray, lambda P, u, v: rotation(P) @ ray(P, u, v), "camera axes"),
    (exercises.check_ray, lambda P, u, v: np.zeros(3), "pixel (0, 0) has length zero."),
    (
        exercises.check_ray,
        lambda P, u, v: np.zeros(3) if (u, v) == (24, 18) else ray(P, u, v),
        "pixel (24, 18) has length zero.",
    ),
    (
        exercises.check_ray,
        lambda P, u, v: np.zeros(3) if u % 1 else ray(P, u, v),
        "pixel (40.25, 7.5) has length zero.",
    ),
    (exercises.check_ray, lambda P, u, v: np.linalg.solve(P[:, :3], [u, v, 0]), "third coordinate"),
    (exercises.check_ray, lambda P, u, v: np.linalg.pinv(P) @ [u, v, 1], "4 numbers"),
    (exercises.check_ray, lambda P, u, v: ray(P, int(u), int(v)), "rounded"),
    (exercises.check_ray, lambda P, u, v: ray(P, u + 1, v + 1), "counted from 1"),
    (exercises.check_center, lambda P: np.linalg.svd(P)[2][-1][:3], "homogeneous"),
    (exercises.check_closest, lambda t, C, r: closest(t, C, r) + 1, "start at 0"),
    (
        exercises.check_closest,
        lambda t, C, r: closest(t, C, r) if closest(t, C, r) >= 0 else len(t),
        "Return -1",
    ),
    (exercises.check_ray, lambda P, u, v: np.linalg.solve(P[:, :3], [u, v, 1]), "backwards"),
    (exercises.check_plane_distance, normalised_in_place, "normalise"),
]


@pytest.mark.parametrize(("check", "wrong", "word"), MISTAKES)
def test_mistake_gets_its_hint(check: Function, wrong: Function, word: str) -> None:
    verdict = check(wrong)
    assert not verdict.correct
    assert word in verdict.text


def test_wrong_images_get_their_hint() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", yaw=25)
    camera = raycam.Camera.look_at([1.5, -4, 1.6], [0, 0, 0], size=(24, 18), fov=20)
    triangles = world.triangles()

    def image(shift: float = 0.0) -> Any:
        rays = [[ray(camera.P, u + shift, v + shift) for u in range(24)] for v in range(18)]
        return np.array([[closest(triangles, center(camera.P), r) for r in row] for row in rays])

    numbers = image()
    assert exercises.check_image(numbers, world, camera)
    for wrong, word in (
        (image(0.5), "half a pixel"),
        (numbers.T, "transposed"),
        (numbers[::-1], "mirrored"),
        (numbers[::-1, ::-1], "mirrored"),
        (np.zeros((18, 24)), "%"),
        (numbers + 1, "start at 0"),
        (np.where(numbers < 0, -1, numbers + 1), "start at 0"),
        (np.where(numbers < 0, np.nan, numbers), "background"),
        ([[1, 2], [3]], "array"),
        (..., "array"),
    ):
        verdict = exercises.check_image(wrong, world, camera)
        assert not verdict.correct
        assert word in verdict.text
