"""Mean curvature against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
import trimesh
from raycam.baking.curvature import corner_curvatures


def corners(mesh: trimesh.Trimesh) -> np.ndarray:
    return np.asarray(mesh.vertices)[np.asarray(mesh.faces)]


@pytest.mark.parametrize("radius", [0.25, 3.0])
def test_curvature_of_a_ball_is_one_divided_by_its_radius(radius: float) -> None:
    ball = corners(trimesh.creation.icosphere(subdivisions=3, radius=radius))
    np.testing.assert_allclose(corner_curvatures(ball), 1 / radius, rtol=0.01)
    np.testing.assert_allclose(corner_curvatures(ball[:, ::-1]), -1 / radius, rtol=0.01)


def test_curvature_of_a_torus_equals_its_closed_form() -> None:
    large, small = 2.0, 0.6
    torus = trimesh.creation.torus(large, small, major_sections=160, minor_sections=96)
    found = corner_curvatures(corners(torus))
    x, y, _ = np.moveaxis(corners(torus), -1, 0)
    away = np.hypot(x, y) - large  # the small radius times the cosine of the angle around the ring
    expected = (large + 2 * away) / (2 * small * (large + away))
    assert expected.min() > 0.4
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_curvature_of_a_saddle_is_zero_and_of_obtuse_triangles_finite() -> None:
    side = np.linspace(-1, 1, 41)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    first = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.concatenate(
        [np.stack([first, first + 1, first + 42], axis=1), np.stack([first, first + 42, first + 41], axis=1)]
    )
    sheared = np.stack([x + 1.5 * y, y, 0 * x], axis=1)[faces]  # every triangle is obtuse
    np.testing.assert_allclose(corner_curvatures(sheared), 0, atol=1e-12)
    saddle = np.stack([x, y, 0.2 * (x**2 - y**2)], axis=1)[faces]
    middle = np.abs(saddle[..., :2]).max(axis=2) < 0.04
    np.testing.assert_allclose(corner_curvatures(saddle)[middle], 0, atol=2e-3)
    ridge = np.stack([x, y, -0.2 * x**2], axis=1)[faces]
    np.testing.assert_allclose(corner_curvatures(ridge)[middle], 0.2, rtol=0.02)


def test_curvature_at_open_borders_and_of_faces_without_area_is_zero() -> None:
    half = trimesh.creation.icosphere(subdivisions=3)
    faces = corners(half)[half.triangles_center[:, 2] > 0]
    found, border = corner_curvatures(faces), faces[..., 2] < 0.02
    assert border.any()
    assert (found[border] == 0).all()
    assert (corner_curvatures(np.zeros((3, 3, 3))) == 0).all()


def test_curvature_map_shows_the_source_and_interpolates() -> None:
    low, high = raycam.World(), raycam.World()
    low.add_object(sphere={"radius": 1, "level": 3}, name="ball")
    high.add_object(box={"size": [0.1, 0.1, 0.1]}, location=[9, 9, 9])
    high.add_object(sphere={"radius": 1.05, "level": 5})
    own = raycam.bake(low, ["curvature"], size=32)
    np.testing.assert_allclose(own["curvature"][own.covered], 1, rtol=0.03)
    detailed = raycam.bake(low, ["curvature"], size=32, source=high, cage=0.2)
    np.testing.assert_allclose(detailed["curvature"][own.covered & ~detailed.missed], 1 / 1.05, rtol=0.01)
