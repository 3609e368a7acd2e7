"""The reference compared with closed forms, exact rational arithmetic and OpenCV."""

import itertools
from fractions import Fraction

import cv2
import numpy as np
import pytest
from raycam import reference
from scipy.spatial.transform import Rotation
from support.raises import fault, raises

SIZE = (24, 18)


def random_camera(rng, center, size=SIZE):
    """A random K, R and P = s K R [I | -C], with s of either sign.

    K has skew and an off-centre principal point.
    """
    width, height = size
    focal = width * rng.uniform(0.4, 2.0)
    K = np.array(
        [
            [focal, focal * rng.uniform(-0.2, 0.2), width * rng.uniform(-0.2, 1.2)],
            [0.0, focal * rng.uniform(0.5, 2.0), height * rng.uniform(-0.2, 1.2)],
            [0.0, 0.0, 1.0],
        ]
    )
    R = Rotation.random(random_state=rng).as_matrix()
    scale = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-4, 4)
    return K, R, scale * K @ R @ np.column_stack([np.eye(3), -np.asarray(center)])


def box_triangles(low, high):
    """A closed box, two triangles per side: axis 0 low, axis 0 high, axis 1 low, ..."""
    triangles = []
    for axis, side in itertools.product(range(3), (low, high)):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        corners = np.empty((2, 2, 3))
        for p, q in itertools.product(range(2), range(2)):
            corners[p, q, axis] = side[axis]
            corners[p, q, i] = (low, high)[p][i]
            corners[p, q, j] = (low, high)[q][j]
        triangles += [
            [corners[0, 0], corners[1, 0], corners[1, 1]],
            [corners[0, 0], corners[1, 1], corners[0, 1]],
        ]
    return np.array(triangles)


# Steps 1 and 2 of `raycam.reference`: the ray of a pixel


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-3, 50.0)])
def test_rays_from_p_equal_those_of_its_camera(scale, offset):
    rng = np.random.default_rng(1)
    for _ in range(50):
        C = rng.normal(size=3) * scale + offset
        K, R, P = random_camera(rng, C)
        units = reference.Units.for_world(rng.normal(size=(4, 3)) * scale + offset, C)
        local = units.camera(P)
        center, forward = reference.camera_center(local), reference.third_row_of_r(local)
        pixels = rng.uniform(-10, 40, size=(20, 2))
        line = reference.lines(reference.points_on_lines(local, pixels), center)
        r = reference.pointed_forward(line, forward)

        expected = np.column_stack([pixels, np.ones(20)]) @ np.linalg.inv(K).T @ R
        unit = lambda a: a / np.linalg.norm(a, axis=1, keepdims=True)  # noqa: E731
        np.testing.assert_allclose(unit(r), unit(expected), atol=1e-13)
        np.testing.assert_allclose(forward, R[2], atol=1e-14)
        np.testing.assert_allclose(
            units.origin + units.scale * center, C, atol=1e-13 * scale + 1e-15 * offset * 4
        )


def test_points_on_lines_map_to_their_pixels():
    rng = np.random.default_rng(2)
    _, _, P = random_camera(rng, [1, 2, 3])
    pixels = rng.uniform(0, 20, size=(50, 2))
    x = reference.points_on_lines(P, pixels) @ P.T
    np.testing.assert_allclose(x[:, :2] / x[:, 2:], pixels, atol=1e-10)


def test_point_at_infinity_is_the_direction_of_the_line():
    # With C at the origin, the fourth coordinate of P⁺ x is 0 for every pixel; with C beside the principal
    # axis, for the pixels whose rays are perpendicular to C.
    for C in ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0]):
        P = np.diag([10.0, 10.0, 1.0]) @ np.column_stack([np.eye(3), -np.array(C)])
        X = reference.points_on_lines(P, np.array([[0.0, 0.0], [0.0, 5.0]]))
        assert reference.at_infinity(X).all()
        r = reference.pointed_forward(reference.lines(X, np.array(C)), reference.third_row_of_r(P))
        np.testing.assert_allclose(r / r[:, 2:], [[0, 0, 1], [0, 0.5, 1]], atol=1e-15)


@pytest.mark.parametrize("sign", [1, -1])
def test_rays_point_forward_for_either_sign_of_p(sign):
    # The camera is at z = -4 and looks along +z.
    P = sign * np.array([[10.0, 0, 0, 0], [0, 10, 0, 0], [0, 0, 1, 4]])
    behind, ahead = [[[-9, -9, z], [9, -9, z], [0, 9, z]] for z in (-9.0, 1.0)]
    seen = reference.render_triangles([behind, ahead], P, (1, 1))
    assert seen["triangle"] == 1
    assert seen["depth"] == 5


# Step 3: the plane of a triangle


def test_depth_of_a_plane_is_constant_and_distance_is_the_length_of_the_ray():
    K = np.array([[30.0, 2, 10], [0, 25, 8], [0, 0, 1]])
    P = np.column_stack([K, np.zeros(3)])
    wall = [[[-50.0, -50, 5], [50, -50, 5], [0, 90, 5]]]
    for pixel_center, shift in (("integer", 0.0), ("half", 0.5)):
        seen = reference.render_triangles(wall, P, SIZE, pixel_center=pixel_center)
        u, v = np.meshgrid(np.arange(SIZE[0]) + shift, np.arange(SIZE[1]) + shift)
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T
        np.testing.assert_allclose(seen["depth"], 5, rtol=1e-14)
        np.testing.assert_allclose(seen["distance"], 5 * np.linalg.norm(rays, axis=-1), rtol=1e-14)
        np.testing.assert_allclose(seen["position"], 5 * rays, rtol=1e-13, atol=1e-13)


def test_hits_project_to_their_pixels_in_opencv():
    rng = np.random.default_rng(3)
    triangles = rng.normal(size=(60, 3, 3))
    for _ in range(10):
        K, R, P = random_camera(rng, rng.normal(size=3) * 3)
        K[0, 1] = 0  # the camera model of OpenCV has no skew
        P = K @ R @ np.column_stack([np.eye(3), -rng.normal(size=3) * 3])
        seen = reference.render_triangles(triangles, P, SIZE)
        v, u = np.nonzero(seen["triangle"] >= 0)
        points = seen["position"][v, u]
        if len(points):
            t = P[:, 3] @ np.linalg.inv(K).T
            pixels, _ = cv2.projectPoints(points, cv2.Rodrigues(R)[0], t, K, None)
            np.testing.assert_allclose(pixels[:, 0], np.column_stack([u, v]), atol=1e-8)


def test_hits_of_a_box_equal_the_slab_test():
    rng = np.random.default_rng(4)
    low, high = np.array([-0.5, -1.0, 0.25]), np.array([0.75, 0.5, 1.5])
    triangles = box_triangles(low, high)
    for i in range(40):
        inside_box = i % 4 == 0
        C = rng.uniform(low, high) if inside_box else rng.uniform(-4, 4, size=3)
        K, R, P = random_camera(rng, C)
        seen = reference.render_triangles(triangles, P, SIZE)
        u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T @ R
        enter, leave = np.sort([(low - C) / rays, (high - C) / rays], axis=0)
        near, far = enter.max(axis=-1), leave.min(axis=-1)
        in_box = np.all((low < C) & (high > C))
        t = np.where((near <= far) & (far >= 0), np.where(in_box, far, near), np.inf)
        t[t < 0] = np.inf
        np.testing.assert_allclose(seen["depth"], t, rtol=1e-10)
        axis = np.where(in_box, leave.argmin(axis=-1), enter.argmax(axis=-1))
        positive = np.take_along_axis(rays, axis[..., None], axis=-1)[..., 0] > 0
        side = 2 * axis + np.where(in_box, positive, ~positive)
        assert (seen["triangle"] // 2 == np.where(np.isfinite(t), side, -1)).all()


def test_triangles_behind_edge_on_or_without_area_are_missed():
    P = np.column_stack([np.diag([5.0, 5.0, 1.0]), np.zeros(3)])
    behind = [[-9, -9, -1], [9, -9, -1], [0, 9, -1]]
    edge_on = [[0, -9, 1], [0, 9, 1], [0, 0, 9]]
    line = [[-0.3, 0, 1], [0.1, 0, 1], [0.7, 0, 1]]
    point = [[0, 0, 2], [0, 0, 2], [0, 0, 2]]
    seen = reference.render_triangles([behind, edge_on, line, point], P, (1, 1))
    assert seen["triangle"] == -1
    assert seen["instance"] == -1
    assert seen["depth"] == np.inf
    assert seen["distance"] == np.inf
    assert np.isnan(seen["position"]).all()


def test_camera_on_a_triangle_hits_it_at_distance_zero():
    P = np.column_stack([np.diag([5.0, 5.0, 1.0]), np.zeros(3)])
    through = [[-9, -9, -9], [9, -9, -9], [0, 9, 9]]
    wall = [[-9, -9, 1], [9, -9, 1], [0, 9, 1]]
    seen = reference.render_triangles([wall, through], P, (1, 1))
    assert seen["triangle"] == 1
    assert seen["distance"] == 0


# Step 4: inside or outside a triangle


def lattice(low, high):
    return [
        (Fraction(x, 2), Fraction(y, 2))
        for x in range(2 * low, 2 * high + 1)
        for y in range(2 * low, 2 * high + 1)
    ]


def exactly_inside(triangle, point):
    """True inside the closed triangle, by signs of areas in rational arithmetic."""
    areas = [
        (q[0] - p[0]) * (point[1] - p[1]) - (q[1] - p[1]) * (point[0] - p[0])
        for p, q in zip(triangle, triangle[1:] + triangle[:1], strict=True)
    ]
    return all(area >= 0 for area in areas) or all(area <= 0 for area in areas)


@pytest.mark.parametrize("tilt", ["flat", "tilted"])
def test_inside_is_exact_on_a_lattice_of_points_vertices_and_edges(tilt):
    # Many lattice points lie on vertices and edges, and u often passes through vertices or along edges.
    corners = [(0, 0), (2, 0), (1, 0), (0, 1), (1, 2), (2, 2), (0, 2)]
    points = lattice(-2, 4)
    basis = np.array([[1.0, 0, 0], [0, 1, 0]])
    if tilt == "tilted":
        basis = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()[:2] * 1.7
    tested = 0
    for triangle in itertools.permutations(corners, 3):
        flat = np.array(triangle, dtype=float)
        if np.linalg.det(np.column_stack([flat[1] - flat[0], flat[2] - flat[0]])) == 0:
            continue
        corners_3d = (flat @ basis)[None]
        n = reference.normals(corners_3d)
        f = np.array(points, dtype=float) @ basis
        found = reference.inside(reference.crossings(corners_3d, n, f, np.full(len(f), 1e-13)))
        expected = [exactly_inside(list(triangle), point) for point in points]
        assert found.tolist() == expected, triangle
        tested += len(f)
    assert tested > 10_000


def test_crossings_equal_the_example_of_the_lecture():
    a, b, c, f = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0]])
    triangle = np.array([a, b, c])
    found = reference.crossings(triangle, reference.normals(triangle[None])[0], f, np.array(0.0))
    np.testing.assert_array_equal(found.g, [0, -4, 0])  # a + v3, v3 = a - c
    np.testing.assert_array_equal(found.u, [-1, -5, 0])
    assert found.crossed.tolist() == [True, False, False]
    assert found.count == 1
    # f + s u = a + q v1 at (0.8, 0, 0)
    np.testing.assert_allclose([found.along_u[0], found.along_edge[0]], [0.2, 0.2])


def test_closed_meshes_do_not_leak_at_edges_and_vertices():
    rng = np.random.default_rng(5)
    for _ in range(20):
        transform = rng.normal(size=(3, 3))
        triangles = box_triangles(np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])) @ transform.T
        a, b = triangles.reshape(-1, 3), np.roll(triangles, -1, axis=1).reshape(-1, 3)
        weight = rng.uniform(size=(20, len(a), 1))
        aims = np.vstack([a, (a + weight * (b - a)).reshape(-1, 3)])
        C = transform @ rng.uniform(-0.9, 0.9, size=3)
        assert (reference.trace(triangles, C, aims - C).index >= 0).all()


# Step 5: the closest triangle


def test_closest_triangle_gives_the_color_and_the_first_wins_a_tie():
    P = np.column_stack([np.diag([5.0, 5.0, 1.0]), np.zeros(3)])
    far, near = [[[-9.0, -9, z], [9, -9, z], [0, 9, z]] for z in (2, 1)]
    colors = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    ids = [[4, 0], [4, 1], [7, 0]]
    seen = reference.render_triangles([far, near, near], P, (1, 1), colors=colors, ids=ids)
    assert seen["color"].tolist() == [[[0, 1, 0]]]
    assert (seen["instance"].item(), seen["triangle"].item()) == (4, 1)
    assert seen["t"] == seen["next_t"]
    seen = reference.render_triangles([far], P, (1, 1), background=[0.1, 0.2, 0.3])
    assert seen["next_t"] == np.inf


def test_block_size_does_not_change_the_image(monkeypatch):
    rng = np.random.default_rng(6)
    # Each triangle is present twice, so that ties occur across blocks.
    triangles = np.repeat(rng.normal(size=(40, 3, 3)), 2, axis=0)
    _, _, P = random_camera(rng, [0, 0, 0])
    whole = reference.render_triangles(triangles, P, SIZE)
    assert (whole["triangle"] >= 0).mean() > 0.2
    assert (whole["triangle"][whole["triangle"] >= 0] % 2 == 0).all()
    for pairs in (1, 7, 64, 1000):
        monkeypatch.setattr("raycam.reference.procedure.PAIRS_AT_ONCE", pairs)
        size = SIZE if pairs > 7 else (3, 2)
        part = reference.render_triangles(triangles, P, size)
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][: size[1], : size[0]])


def test_empty_world_shows_the_background():
    P = np.column_stack([np.eye(3), np.zeros(3)])
    seen = reference.render_triangles(np.empty((0, 3, 3)), P, (2, 3), background=[0.1, 0.2, 0.3])
    assert seen["color"].shape == (3, 2, 3)
    assert np.all(seen["color"] == np.float32([0.1, 0.2, 0.3]))
    assert np.all(seen["triangle"] == -1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"triangles": np.zeros((2, 3))}, fault(None, "[n, 3, 3]", "[2, 3]")),
        ({"triangles": [[[np.nan] * 3] * 3]}, fault(None)),
        ({"P": np.eye(3)}, fault(None, "[3, 4]", "3]")),
        ({"P": np.ones((3, 4))}, fault(None, "3 x 3")),
        ({"P": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]}, fault(None, "3 x 3")),
        ({"colors": np.zeros((4, 3))}, fault(None, "[1, 3]")),
        ({"pixel_center": "middle"}, fault(None, "pixel_center", '"integer"', '"half"')),
    ],
)
def test_invalid_input_raises_with_the_argument(change, message):
    good = {"triangles": np.zeros((1, 3, 3)), "P": np.eye(3, 4), "size": (2, 2)}
    with raises(ValueError, **message):
        reference.render_triangles(**(good | change))
