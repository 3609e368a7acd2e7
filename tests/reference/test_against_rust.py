"""The Rust renderer compared with the reference.

Ids, depth, distance and position are compared in scenes of every kind.
"""

import numpy as np
import pytest
import raycam
from raycam import reference
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

SIZE = (32, 24)
CAMERAS = 10
TIE = 1e-9
CHANNELS = ["color", "depth", "distance", "position", "instance", "triangle"]


def place(rng, scale=1.0, shear=False, mirror=False):
    """world_from_mesh [4, 4]: a random rotation and location, and the given scale or shear."""
    matrix = np.eye(4)
    linear = Rotation.random(random_state=rng).as_matrix() * scale * rng.uniform(0.5, 1.5)
    if shear:
        linear = (
            linear
            @ (np.eye(3) + np.triu(rng.uniform(-1, 1, size=(3, 3)), 1))
            @ np.diag(rng.uniform(0.4, 2, 3))
        )
    if mirror:
        linear = linear @ np.diag([-1, 1, 1])
    matrix[:3, :3] = linear
    matrix[:3, 3] = rng.uniform(-1.5, 1.5, size=3) * scale
    return matrix


def shapes(rng, scale=1.0, offset=0.0, count=4, **placing):
    """Boxes, spheres, tori, cones and cylinders at random positions in a cube."""
    world = raycam.World()
    ball = rng.normal(size=(40, 3))
    ball *= 0.6 / np.linalg.norm(ball, axis=1, keepdims=True)
    kinds = [
        {"box": {"size": [1, 0.7, 1.3]}},
        {"vertices": ball, "triangles": ConvexHull(ball).simplices},
        {"torus": {"radius": 0.6, "tube": 0.2, "segments": 8}},
        {"cone": {"radius": 0.5, "height": 1.0, "segments": 9}},
        {"cylinder": {"radius": 0.4, "height": 1.1, "segments": 7}, "refine": 1},
    ]
    for i in range(count):
        matrix = place(rng, scale, **placing)
        matrix[:3, 3] += offset
        world.add_object({**kinds[i % len(kinds)], "matrix": matrix, "color": rng.uniform(size=3)})
    return world


def soup(rng, triangles=150, size=0.8, flatten=(1, 1, 1)):
    """Random triangles that intersect each other, each with its own colour."""
    world = raycam.World()
    corners = (rng.normal(size=(triangles, 1, 3)) + size * rng.normal(size=(triangles, 3, 3))) * flatten
    world.add_mesh(
        corners.reshape(-1, 3),
        np.arange(3 * triangles).reshape(-1, 3),
        face_colors=rng.uniform(size=(triangles, 3)),
    )
    return world


def instances(rng, **placing):
    """Many instances of one mesh."""
    world = raycam.World()
    vertices = rng.normal(size=(9, 3)) * 0.6
    faces = rng.permuted(np.tile(np.arange(9), (14, 1)), axis=1)[:, :3]
    world.add_mesh(vertices, faces, name="first", face_colors=rng.uniform(size=(14, 3)))
    for _ in range(7):
        world.add_object({"instance_of": "first", "matrix": place(rng, **placing)})
    return world


def room(rng):
    """A box seen from inside, with objects in it."""
    world = shapes(rng, count=5)
    world.add_object(box={"size": [9, 9, 6]}, color=[0.7, 0.7, 0.6])
    return world


def coplanar(rng):
    """Overlapping, almost coplanar sheets: near ties, but no exact ones."""
    world = raycam.World()
    for i in range(6):
        world.add_object(
            plane={"size": [2, 1]}, location=[*rng.uniform(-1, 1, size=2), 1e-4 * i], yaw=37.0 * i
        )
    return world


def twins(rng):
    """Every triangle twice, in two objects: all hits are ties."""
    world = soup(rng, triangles=40)
    world.add_object({"instance_of": world.objects[0].name})
    return world


def degenerate(rng):
    """A mesh with lines and points among its triangles."""
    world = raycam.World()
    vertices = rng.normal(size=(60, 3))
    faces = rng.integers(0, 60, size=(90, 3))
    faces[::4, 1] = faces[::4, 0]
    faces[::12] = faces[::12, :1]
    world.add_mesh(vertices, faces)
    return world


def huge_ground(rng):
    """Small objects on a plane of several kilometres."""
    world = shapes(rng, count=4)
    world.add_object(plane={"size": [5000, 5000]}, location=[0, 0, -1.2], roll=3.0)
    return world


# For each scene, a function that creates its world, the world's size, and its distance from the origin.
SCENES = {
    "boxes": (lambda rng: shapes(rng, count=1), 1.0, 0.0),
    "shapes": (lambda rng: shapes(rng, count=5), 1.0, 0.0),
    "many shapes": (lambda rng: shapes(rng, count=9), 1.0, 0.0),
    "mirrored": (lambda rng: shapes(rng, count=5, mirror=True), 1.0, 0.0),
    "sheared": (lambda rng: shapes(rng, count=5, shear=True), 1.0, 0.0),
    "sheared and mirrored": (lambda rng: shapes(rng, count=5, shear=True, mirror=True), 1.0, 0.0),
    "soup": (soup, 1.0, 0.0),
    "large triangles": (lambda rng: soup(rng, 40, 4.0), 1.0, 0.0),
    "small triangles": (lambda rng: soup(rng, 300, 0.1), 1.0, 0.0),
    "flat soup": (lambda rng: soup(rng, flatten=(1, 1, 1e-3)), 1.0, 0.0),
    "needles": (lambda rng: soup(rng, 400, flatten=(1, 0.03, 0.03)), 1.0, 0.0),
    "instances": (instances, 1.0, 0.0),
    "instances sheared": (lambda rng: instances(rng, shear=True), 1.0, 0.0),
    "instances mirrored": (lambda rng: instances(rng, mirror=True), 1.0, 0.0),
    "room": (room, 1.0, 0.0),
    "coplanar": (coplanar, 1.0, 0.0),
    "twins": (twins, 1.0, 0.0),
    "degenerate": (degenerate, 1.0, 0.0),
    "huge ground": (huge_ground, 1.0, 0.0),
    "tiny": (lambda rng: shapes(rng, 1e-6, count=5), 1e-6, 0.0),
    "huge": (lambda rng: shapes(rng, 1e6, count=5), 1e6, 0.0),
    "far away": (lambda rng: shapes(rng, offset=1e6, count=5), 1.0, 1e6),
    "tiny and far away": (lambda rng: shapes(rng, 1e-3, offset=2e3, count=5), 1e-3, 2e3),
}


def random_camera(rng, scale, offset, inside):
    """A random camera with any K, created by one of the constructors.

    Half of the cameras face the centre.
    """
    width, height = SIZE
    spread = 0.7 if inside else 4.0
    C = rng.normal(size=3) * spread * scale
    target = rng.normal(size=3) * 0.5 * scale
    focal = width * rng.uniform(0.3, 1.5)
    K = np.array(
        [
            [focal, focal * rng.uniform(-0.2, 0.2), width * rng.uniform(0.2, 0.8)],
            [0.0, focal * rng.uniform(0.7, 1.4), height * rng.uniform(0.2, 0.8)],
            [0.0, 0.0, 1.0],
        ]
    )
    forward = (target - C) / np.linalg.norm(target - C)
    # A random roll about z, then the smallest rotation that turns z to `forward`.
    axis = np.cross([0, 0, 1], forward)
    angle = np.arctan2(np.linalg.norm(axis), forward[2])
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle) * Rotation.from_rotvec(
        [0, 0, rng.uniform(0, 7)]
    )
    R = turn.as_matrix().T
    if inside:
        R = Rotation.random(random_state=rng).as_matrix()
    C = C + offset
    pixel_center = str(rng.choice(["integer", "half"]))
    if rng.random() < 0.5:
        return raycam.Camera(K, R, C, SIZE, pixel_center=pixel_center)
    P = K @ R @ np.column_stack([np.eye(3), -C])
    P *= rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3, 3)
    return raycam.Camera.from_matrix(P, SIZE, pixel_center=pixel_center)


@pytest.mark.parametrize("name", SCENES)
def test_rendered_channels_equal_the_reference(name):
    rng = np.random.default_rng(list(SCENES).index(name))
    make, scale, offset = SCENES[name]
    world = make(rng)
    seen = 0
    for number in range(CAMERAS):
        camera = random_camera(rng, scale, offset, inside=number % 5 == 4)
        frame = raycam.render(world, camera, integrator="flat", samples=1, channels=CHANNELS)
        oracle = reference.render(world, camera)
        hit = oracle["instance"] >= 0
        seen += hit.sum()
        tie = hit & (oracle["next_t"] <= (1 + TIE) * oracle["t"])
        for channel in ("instance", "triangle"):
            differ = (frame[channel] != oracle[channel]) & ~tie
            assert not differ.any(), (name, number, channel, np.argwhere(differ)[:5], differ.sum())
        # In a tie either triangle is correct, but never a miss.
        np.testing.assert_array_equal(frame["instance"] >= 0, hit)
        for channel in ("depth", "distance"):
            np.testing.assert_allclose(frame[channel][hit], oracle[channel][hit], rtol=1e-6)
            assert np.isinf(frame[channel][~hit]).all()
        error = np.linalg.norm(frame["position"] - oracle["position"], axis=-1)[hit]
        assert (error <= 1e-9 * (oracle["distance"][hit] + offset + scale)).all()
        single = hit & ~tie
        np.testing.assert_allclose(frame["color"][single], oracle["color"][single], rtol=1e-6, atol=1e-7)
        assert (frame["color"][~hit] == 0).all()
    assert seen >= 100  # needles fill few pixels, the other scenes thousands


def test_comparison_covers_at_least_200_views():
    assert len(SCENES) >= 20
    assert len(SCENES) * CAMERAS >= 200


def test_sky_is_the_background_in_both_renderers():
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]})
    world.add_light({"type": "sky", "radiance": [0.2, 0.3, 0.5]})
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], size=SIZE)
    frame = raycam.render(world, camera, integrator="flat", samples=1)
    np.testing.assert_array_equal(frame["color"], reference.render(world, camera)["color"])
    assert raycam.explain(world, camera, (0, 0)).color.tolist() == pytest.approx([0.2, 0.3, 0.5])


def test_reference_reports_progress_and_can_be_cancelled():
    world = raycam.World()
    world.add_object("sphere", location=[0, 0, 2])
    camera = raycam.Camera.from_pose([0, 0, 0], 0, -90, 0, size=(8, 6), focal=8)
    told = []
    render = {"integrator": "reference", "channels": ["depth"]}
    raycam.render(world, camera, progress=lambda *numbers: told.append(numbers), **render)
    assert told[-1] == (48, 48)
    assert [done for done, _ in told] == sorted({done for done, _ in told})

    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        raycam.render(world, camera, progress=stop, **render)


def test_reference_integrator_returns_the_reference_image():
    world = shapes(np.random.default_rng(1))
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], size=SIZE)
    frame = raycam.render(world, camera, integrator="reference")
    oracle = reference.render(world, camera)
    np.testing.assert_array_equal(frame["color"], oracle["color"])
    np.testing.assert_array_equal(frame["triangle"], oracle["triangle"])
