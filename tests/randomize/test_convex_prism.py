"""Convex outlines and vertical prisms around objects."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.randomize.convex_prism import ConvexPrism, outline
from scipy.spatial import ConvexHull  # type: ignore[import-untyped]


def test_outlines_are_convex_hulls_and_prisms_intersect_exactly() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(3000, 2))
    assert sorted(map(tuple, outline(points))) == sorted(map(tuple, points[ConvexHull(points).vertices]))
    square = ConvexPrism(outline(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])), 0.0, 1.0)
    turned = square.turned(np.sqrt(0.5), np.sqrt(0.5), [2.0, 0.0, 0.0])
    assert not square.intersects(turned, 0.0)
    assert square.intersects(turned, 0.4)
    assert not square.intersects(square.turned(1.0, 0.0, [0, 0, 1.0]), 0.0)
    flat = np.array([[[-5.0, -5, 0.5], [9, -5, 0.5], [0, 9, 0.5]]])
    assert square.intersects_triangles(flat)
    assert not square.intersects_triangles(flat + np.array([0, 0, 0.6]))
    # Only the triangle's bounding box touches the square.
    corner = np.array([[[1.4, 0.7, 0.2], [0.7, 1.4, 0.2], [1.5, 1.5, 0.9]]])
    assert not square.intersects_triangles(corner)


def test_outline_of_many_repeated_points_equals_the_hull_of_scipy() -> None:
    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    center = np.array([50.0, -7.0])
    ring = np.column_stack([np.cos(angle), 0.1 * np.sin(3 * angle) + np.sin(angle)]) + center
    points = np.concatenate([ring, ring[::-1], 0.5 * (ring - center) + center])
    assert sorted(map(tuple, outline(points))) == sorted(map(tuple, ring[ConvexHull(ring).vertices]))


def test_diameter_width_and_area_of_prisms_equal_closed_forms() -> None:
    angle = np.arange(64) * 2 * np.pi / 64
    circle = ConvexPrism(outline(np.column_stack([3 * np.cos(angle), 3 * np.sin(angle)])), 0.0, 1.0)
    assert circle.diameter == pytest.approx(6)
    assert circle.width == pytest.approx(6 * np.cos(np.pi / 64))
    assert circle.area == pytest.approx(32 * 9 * np.sin(2 * np.pi / 64))
    box = ConvexPrism(np.array([[0, 0], [3, 0], [3, 1], [0, 1.0]]) + 100, 0.0, 1.0)
    assert (box.diameter, box.width, box.area) == pytest.approx((np.sqrt(10), 1, 3))


@pytest.mark.parametrize("gap", [0.0, 0.01, 3.0])
def test_grown_prism_is_the_hull_of_the_moved_edges(gap: float) -> None:
    base = ConvexPrism(outline(np.random.default_rng(5).normal(size=(200, 2))), 0.0, 1.0)
    along = base.normals * gap
    moved = np.concatenate([base.outline + along, np.roll(base.outline, -1, axis=0) + along])
    corners = base.grown(gap).outline
    assert {tuple(corner) for corner in corners} == {tuple(corner) for corner in outline(moved)}
    x, y = corners.T
    assert np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0  # counter-clockwise


def test_grown_prism_has_bevelled_corners() -> None:
    square = ConvexPrism(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), 0.0, 1.0).grown(0.5)
    for x, y, z in (
        [1.49, 0.5, 0.5],
        [0.5, -0.49, 0.5],
        [1.24, 1.24, 0.5],
        [0.5, 0.5, 1.49],
    ):
        tiny = np.array([[x, y, z]]) + 1e-6 * np.eye(3)
        assert square.intersects_triangles(tiny[np.newaxis])
    for x, y, z in ([1.51, 0.5, 0.5], [1.26, 1.26, 0.5], [0.5, 0.5, 1.51], [0.5, 0.5, -0.01]):
        tiny = np.array([[x, y, z]]) + 1e-6 * np.eye(3)
        assert not square.intersects_triangles(tiny[np.newaxis])
