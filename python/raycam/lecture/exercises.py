"""Checks for the exercises of the notebook "A ray tracer by hand".

Each check takes the student's function, tries the function on several cameras, triangles and pixels, compares
the results with `raycam.reference`, and returns a `Verdict`. A wrong answer does not raise an error: the
verdict contains a hint for common mistakes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import reference
from ..camera import Camera
from ..reference.units import Floats
from ..world import World

__all__ = [
    "Verdict",
    "check_center",
    "check_closest",
    "check_image",
    "check_is_inside",
    "check_plane_distance",
    "check_ray",
]

Triangles = Floats
TOLERANCE = 1e-6
"""Relative tolerance of answers."""


@dataclass(frozen=True)
class Verdict:
    """Result of a check: whether the answer is correct, and a text with a hint if it is not."""

    correct: bool
    text: str

    def __repr__(self) -> str:
        """The text that a notebook shows below a cell."""
        return f"Correct. {self.text}".strip() if self.correct else f"Not correct yet. {self.text}"

    def __bool__(self) -> bool:
        """True for a correct answer."""
        return self.correct


def check_center(center: Callable[[Floats], Any]) -> Verdict:
    """Checks `center(P)`, the camera's centre, [3]."""
    for camera, P in _matrices():
        expected = np.asarray(camera.C)
        given, problem = _numbers(center, (3,), P)
        if given is None:
            if np.shape(_call(center, P)[0]) == (4,):
                problem = "The result has 4 numbers: divide the first three by the fourth."
            return Verdict(False, problem)
        if _close(given, expected):
            continue
        M, p4 = P[:, :3], P[:, 3]
        hints = [
            (np.asarray(_matrices()[0][0].C), SAME_CAMERA),
            (-expected, "The sign is wrong: P (C, 1) = 0 means M C = -p4."),
            (_null_vector(P)[:3], HOMOGENEOUS_CENTER),
            (-_null_vector(P)[:3], HOMOGENEOUS_CENTER),
            (np.linalg.solve(M.T, -p4), "M is transposed: solve M C = -p4, not Mᵀ C = -p4."),
            (
                camera.R @ expected,
                "This is R C. The centre itself is in world coordinates: C = -Rᵀ t, not -t.",
            ),
            (-camera.R @ expected, "This is the translation t = -R C, not the centre: C = -Rᵀ t."),
            (
                -M.T @ p4,
                "The transpose of M is not its inverse, because M = K R contains K. Use np.linalg.solve.",
            ),
        ]
        return Verdict(False, _hint(given, hints, _difference("C", given, expected)))
    return Verdict(True, "P maps C to zero.")


def check_ray(ray: Callable[[Floats, float, float], Any]) -> Verdict:
    """Checks `ray(P, u, v)`, the viewing ray of the pixel (u, v).

    The expected result is a vector of any length that points forward, from the camera's centre through the
    pixel.
    """
    for camera, P in _matrices():
        for u, v in ((0, 0), (24, 18), (40.25, 7.5)):
            given, problem = _numbers(ray, (3,), P, u, v)
            if given is None:
                if np.shape(_call(ray, P, u, v)[0]) == (4,):
                    problem = "The result has 4 numbers: divide X' by its fourth, then subtract C."
                return Verdict(False, problem)
            if not given.any():
                other, _ = _numbers(ray, (3,), P, 24, 18)
                is_third_missing = (u, v) == (0, 0) and other is not None and other.any()
                zero = f"The ray of pixel ({u}, {v}) has length zero."
                return Verdict(False, THIRD_COORDINATE if is_third_missing else zero)
            expected = _direction(P, u, v)
            given = _unit(given)
            if _close(given, expected):
                continue
            point = np.linalg.pinv(P) @ [u, v, 1]
            K_direction = np.linalg.solve(camera.K, [u, v, 1])
            hints = [
                (_direction(_matrices()[0][1], u, v), SAME_CAMERA),
                (
                    -expected,
                    "The ray points backwards: compare it with the third row of M, times the sign of det(M).",
                ),
                (_unit(point[:3] / point[3]), "Subtract the centre: the ray is X' - C, not X'."),
                (
                    _unit(point[:3] - np.asarray(camera.C)),
                    "X' is homogeneous: divide it by its fourth coordinate.",
                ),
                (
                    _unit(camera.R @ K_direction),
                    "R is transposed: a camera direction d is Rᵀ d in the world.",
                ),
                (
                    _unit(K_direction),
                    "This is the direction in camera axes: a camera direction d is Rᵀ d in the world.",
                ),
                (
                    _unit(np.asarray(camera.C) + np.linalg.solve(P[:, :3], [u, v, 1])),
                    "This is a point on the ray, not the vector from C to the point.",
                ),
                (_direction(P, u + 0.5, v + 0.5), HALF_PIXEL),
                (_direction(P, u - 0.5, v - 0.5), HALF_PIXEL),
                (_direction(P, v, u), "u and v are swapped: u is the column, v the row, x = (u, v, 1)."),
                (
                    _direction(P, int(u), int(v)),
                    "u and v are rounded: use them unchanged, because a point may lie between two pixel centres.",
                ),
                (
                    _direction(P, u + 1, v + 1),
                    "The pixels are counted from 1; count from 0, because the first pixel is (0, 0).",
                ),
            ]
            return Verdict(
                False, _hint(given, hints, f"Pixel ({u}, {v}): {_difference('r', given, expected)}")
            )
    return Verdict(True, "The ray passes through its pixel and points forward, for P and for -P.")


def check_plane_distance(plane_distance: Callable[[Floats, Floats, Floats], Any]) -> Verdict:
    """Checks `plane_distance(triangle, C, r)`: t of the point C + t r in the triangle's plane.

    If r is parallel to the plane, the expected result is NaN.
    """
    rng = np.random.default_rng(1)
    for _ in range(8):
        triangle, C, r = rng.normal(size=(3, 3)), rng.normal(size=3), 3 * rng.normal(size=3)
        given, problem = _numbers(plane_distance, (), triangle, C, r)
        if given is None:
            return Verdict(False, problem)
        expected = _plane_distance(triangle, C, r)
        if _close(given, expected):
            continue
        hints = [
            (np.asarray(-expected), "The sign is wrong: the numerator is n·(a - C), not n·(C - a)."),
            (np.asarray(1 / expected), "Numerator and denominator are swapped."),
            (expected * np.linalg.norm(r), "t is in units of the length of r: do not normalise r."),
            (np.asarray(_plane_distance(triangle, -C, r)), "The sign of C is wrong: the ray starts at +C."),
        ]
        return Verdict(False, _hint(given, hints, _difference("t", given, np.asarray(expected))))
    flat = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    parallel, _ = _numbers(plane_distance, (), flat, np.zeros(3), np.array([1.0, 0, 0]))
    if parallel is None or not np.isnan(parallel):
        return Verdict(False, "A ray parallel to the plane meets nothing: return NaN if n·r is zero.")
    return Verdict(True, "The point C + t r lies in the plane.")


def check_is_inside(is_inside: Callable[[Floats, Floats], Any]) -> Verdict:
    """Checks `is_inside(triangle, point)` for points in the triangle's plane.

    The expected result is True if the point is inside the triangle.
    """
    rng = np.random.default_rng(2)
    # For each wrong result: the expected result, and whether the corners are in the original order and the
    # point is within the triangle's bounding box.
    wrong: list[tuple[bool, bool, bool]] = []
    for number in range(60):
        triangle = rng.normal(size=(3, 3))
        weights = rng.dirichlet(np.ones(3)) if number % 3 == 0 else rng.uniform(-0.8, 1.2, 3)
        weights[2] = 1 - weights[0] - weights[1]
        if abs(weights).min() < 0.02:
            continue
        point, expected = weights @ triangle, bool((weights > 0).all())
        in_box = bool(((point > triangle.min(axis=0)) & (point < triangle.max(axis=0))).all())
        for order in (triangle, triangle[::-1].copy()):
            given, problem = _call(is_inside, order, point)
            if problem:
                return Verdict(False, problem)
            if not isinstance(given, bool | np.bool_ | int | np.integer):
                return Verdict(False, f"Return True or False, not {_kind(given)}.")
            if bool(given) != expected:
                wrong.append((expected, order is triangle, in_box))
    if not wrong:
        return Verdict(True, "All points are correct, for both orders of the corners.")
    if len(wrong) > 100:
        return Verdict(False, "The answer is inverted: an odd number of crossings means inside.")
    if all(expected for expected, _, _ in wrong) and len({order for _, order, _ in wrong}) == 1:
        return Verdict(
            False,
            "Only one order of the corners works: accept three positive signs and three negative signs.",
        )
    if all(not expected and in_box for expected, _, in_box in wrong):
        return Verdict(False, "Points in the triangle's bounding box are accepted. Test against each edge.")
    if all(not expected for expected, _, _ in wrong):
        return Verdict(False, "Points outside are accepted: every one of the three edges must be tested.")
    return Verdict(
        False, f"The results for {len(wrong)} points are wrong. Draw one triangle and one point by hand."
    )


def check_closest(closest: Callable[[Triangles, Floats, Floats], Any]) -> Verdict:
    """Checks `closest(triangles, C, r)`, the index of the first triangle that a ray hits.

    The expected result for a miss is -1.
    """
    near, far, behind = ([[-3.0, -2, z], [3, -2, z], [0, 4, z]] for z in (2.0, 4.0, -1.0))
    C, forward, aside = np.zeros(3), np.array([0.0, 0, 1]), np.array([5.0, 0, 1])
    cases = [
        ([far, near], forward, 1, "Return the nearest triangle: keep the smallest t."),
        ([near, far], forward, 0, "Return the nearest triangle: keep the smallest t, not the last one."),
        ([behind, far], forward, 1, "A triangle behind the camera is found: discard negative t."),
        ([near, far], aside, -1, "The ray misses the triangles: test whether the point is inside."),
        ([behind], forward, -1, NO_TRIANGLE),
    ]
    for triangles, r, expected, hint in cases:
        given, problem = _call(closest, np.array(triangles), C, r)
        if problem:
            return Verdict(False, NO_TRIANGLE if problem == UNANSWERED and expected == -1 else problem)
        if isinstance(given, bool) or not isinstance(given, int | np.integer):
            return Verdict(False, f"Return the index of the triangle (an int), not {_kind(given)}.")
        if given != expected:
            if expected >= 0 and given == expected + 1 == len(triangles):
                hint = "Triangle indices start at 0."
            if expected == -1 and given == len(triangles):
                hint = NO_TRIANGLE
            return Verdict(False, hint)
    return Verdict(True, "The function returns the triangle with the smallest positive t.")


def check_image(numbers: Any, world: World, camera: Camera) -> Verdict:
    """Checks an image of triangle indices [height, width]; -1 for the background."""
    width, height = camera.size
    given = _array(numbers)
    if given is None or given.ndim != 2:
        return Verdict(False, f"Expected an array [{height}, {width}] of triangle indices.")
    if given.shape == (width, height) != (height, width):
        return Verdict(False, "The image is transposed: rows come first, numbers[v, u].")
    if given.shape != (height, width):
        return Verdict(False, f"Expected shape [{height}, {width}], got {list(given.shape)}.")
    triangles = world.triangles()

    def share(shift: float) -> float:
        return float((given == _triangle_numbers(triangles, camera, shift)).mean())

    if share(0) > 0.999:
        return Verdict(True, "Your ray tracer and raycam find the same triangles.")
    if max(share(0.5), share(-0.5)) > max(0.99, share(0)):
        return Verdict(False, HALF_PIXEL)
    expected = _triangle_numbers(triangles, camera, 0)
    if (
        max((given == expected[::down, ::right]).mean() for down, right in ((-1, 1), (1, -1), (-1, -1)))
        > 0.99
    ):
        return Verdict(False, "The image is mirrored: row 0 is at the top, column 0 on the left.")
    is_hit = expected >= 0
    if (given == expected + 1)[is_hit].mean() > 0.99:
        return Verdict(False, "Triangle indices start at 0; the background is -1.")
    if (given == expected)[is_hit].mean() > 0.99 and (given == expected)[~is_hit].mean() < 0.01:
        return Verdict(False, "The triangles are correct, but the background must be -1.")
    return Verdict(
        False, f"{share(0):.1%} of the pixels are correct. Look at one wrong pixel with raycam.explain."
    )


NO_TRIANGLE = "Return -1 if the ray meets nothing in front of the camera."
UNANSWERED = "The function returns nothing yet."
HOMOGENEOUS_CENTER = "The null vector of P is homogeneous: divide its first three numbers by the fourth."
THIRD_COORDINATE = (
    "The ray of pixel (0, 0) has length zero: the third coordinate of x must be 1, x = (u, v, 1)."
)
SAME_CAMERA = "The result belongs to another camera: use the argument P, not the notebook's camera."
HALF_PIXEL = (
    "The ray is half a pixel off: integer coordinates are pixel centres, so do not add or subtract 0.5."
)


def _matrices() -> list[tuple[Camera, Floats]]:
    """Returns cameras, each with a matrix P of positive or negative scale.

    The first camera is the notebook's camera.
    """
    camera = Camera.look_at([1.5, -4, 1.6], [0.4, 0, 0], size=(48, 36), fov=30)
    turned = Camera.from_pose(size=(48, 36), fov=50, location=[-3, 2, 5], yaw=130, pitch=-25, roll=40)
    return [(camera, camera.P), (turned, turned.P), (turned, -2 * turned.P)]


def _null_vector(P: Floats) -> Floats:
    return np.asarray(np.linalg.svd(P)[2][-1])


def _direction(P: Floats, u: float, v: float) -> Floats:
    C = reference.camera_center(P)
    lines = reference.lines(reference.points_on_lines(P, np.array([[u, v]], dtype=np.float64)), C)
    return _unit(reference.pointed_forward(lines, reference.third_row_of_r(P))[0])


def _plane_distance(triangle: Floats, C: Floats, r: Floats) -> float:
    triangles = triangle[None]
    return float(reference.plane_distances(reference.normals(triangles), triangles[:, 0], C, r[None])[0, 0])


def _triangle_numbers(triangles: Triangles, camera: Camera, shift: float) -> Any:
    """The indices [height, width] of the first triangles at all pixels, by barycentric weights."""
    width, height = camera.size
    P, numbers = camera.P, np.full((height, width), -1)
    C = reference.camera_center(P)
    a, edges = triangles[:, 0], triangles[:, 1:] - triangles[:, :1]
    for v in range(height):
        for u in range(width):
            r = _direction(P, u + shift, v + shift)
            with np.errstate(all="ignore"):
                matrix = np.concatenate([edges, np.broadcast_to(-r, (len(a), 1, 3))], axis=1)
                weights = np.einsum("nij,nj->ni", np.linalg.pinv(matrix.transpose(0, 2, 1)), C - a)
            hit = (weights[:, :2] >= 0).all(axis=1) & (weights[:, :2].sum(axis=1) <= 1) & (weights[:, 2] > 0)
            if hit.any():
                numbers[v, u] = np.argmin(np.where(hit, weights[:, 2], np.inf))
    return numbers


def _unit(vector: Any) -> Floats:
    vector = np.asarray(vector, dtype=np.float64)
    return np.asarray(vector / np.linalg.norm(vector))


def _close(a: Any, b: Any) -> bool:
    return bool(np.allclose(a, b, rtol=TOLERANCE, atol=TOLERANCE))


def _hint(given: Floats, hints: list[tuple[Any, str]], otherwise: str) -> str:
    return next((text for wrong, text in hints if _close(given, wrong)), otherwise)


def _difference(name: str, given: Floats, expected: Any) -> str:
    with np.printoptions(precision=4, suppress=True):
        return f"Expected {name} = {expected}, got {given}."


def _kind(given: Any) -> str:
    """What the student's function returned, for a hint."""
    return f"an array of shape {list(np.shape(given))}" if np.ndim(given) else f"{given!r}"


def _call(function: Callable[..., Any], *arguments: Any) -> tuple[Any, str]:
    """Returns the function's result for copies of the arguments, and an empty text.

    If the answer is missing or the function raises an error, the text describes the problem.
    """
    copies = [np.array(value) if isinstance(value, np.ndarray) else value for value in arguments]
    try:
        with np.errstate(all="ignore"):
            given = function(*copies)
    except Exception as error:
        return None, f"The function raised {type(error).__name__}: {error}."
    return given, UNANSWERED if given is None or given is Ellipsis else ""


def _array(given: Any) -> Floats | None:
    """The numbers as an array; None if they are not real numbers, or if rows differ in length."""
    try:
        return None if np.iscomplexobj(given) else np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def _numbers(
    function: Callable[..., Any], shape: tuple[int, ...], *arguments: Any
) -> tuple[Floats | None, str]:
    """Returns the function's result as an array of the given shape, and an empty text.

    If the answer is missing or has another shape, or if the function raises an error, returns None and a
    text.
    """
    given, problem = _call(function, *arguments)
    if problem:
        return None, problem
    array = _array(given)
    if array is None:
        return None, f"Expected real numbers, got {given!r}."
    if array.shape != shape:
        return None, f"Expected {list(shape) or 'one number'}, got an array of shape {list(array.shape)}."
    return array, ""
