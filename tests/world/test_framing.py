"""Cameras that frame a world from a side, and the up axis of a model."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import raycam
from support.raises import Fault, fault, raises

SIDES = {
    "z": {"front": [0, -1, 0], "back": [0, 1, 0], "right": [1, 0, 0], "left": [-1, 0, 0], "top": [0, 0, 1]},
    "y": {"front": [0, 0, 1], "back": [0, 0, -1], "right": [1, 0, 0], "left": [-1, 0, 0], "top": [0, 1, 0]},
}


def cloud(up: Literal["z", "y"], scale: float = 1.0) -> tuple[raycam.World, np.ndarray]:
    """A world of one mesh of random triangles, and its corners."""
    corners = np.random.default_rng(5).normal(size=(40, 3)) * [1, 2, 0.4] * scale + [3 * scale, -1, 2]
    world = raycam.World(up=up)
    world.add_mesh(corners, np.arange(39).reshape(-1, 3))
    return world, corners[:39]


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("direction", ["front", "back", "right", "left", "top", "bottom", "iso", "default"])
@pytest.mark.parametrize(("size", "zoom"), [((640, 480), 1.0), ((50, 200), 1.0), ((300, 100), 0.5)])
def test_view_from_fits_the_world_into_the_image(
    up: Literal["z", "y"], direction: str, size: tuple[int, int], zoom: float
) -> None:
    world, corners = cloud(up)
    camera = world.view_from(direction, size=size, zoom=zoom)
    pixels, seen = camera.project(corners)
    assert seen.all()
    # The distances from the image centre, as multiples of 90 % of half the image size.
    share = np.abs(pixels - (np.array(size) - 1) / 2) / (np.array(size) / 2 * 0.9 / 1)
    assert share.max() == pytest.approx(zoom, abs=0.02)
    if direction in SIDES[up]:
        np.testing.assert_allclose(-camera.R[2], SIDES[up][direction], atol=1e-12)
    upward = [0, 0, 1] if up == "z" else [0, 1, 0]
    assert (-camera.R[1] @ upward >= -1e-12) or direction in ("top", "bottom")


def test_view_from_accepts_zoom_fov_and_vectors() -> None:
    world, corners = cloud("z")
    near, far = world.view_from("front", fov=60), world.view_from("front", fov=20)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    assert np.linalg.norm(far.C - middle) > 2 * np.linalg.norm(near.C - middle)
    np.testing.assert_allclose(world.view_from([0, -7, 0]).P, world.view_from("front").P)
    np.testing.assert_allclose(world.default_camera().P, world.view_from("default").P)
    tiny, _ = cloud("z", 1e-6)
    assert np.isfinite(tiny.view_from("iso").P).all()


LENSES: dict[str, raycam.Camera] = {
    "K alone": raycam.Camera([[500, 3, 290], [0, 520, 260], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480)),
    "opencv": raycam.data.camera(),
    "fisheye": raycam.data.fisheye(),
    "thin": raycam.data.camera().resized((320, 240)).cropped(100, 0, 60, 240),
}


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("direction", ["front", "top", "iso"])
@pytest.mark.parametrize("zoom", [1.0, 0.5])
@pytest.mark.parametrize("lens", LENSES)
def test_view_from_with_a_lens_fits_the_world_into_the_image(
    lens: str, up: Literal["z", "y"], direction: str, zoom: float
) -> None:
    given = LENSES[lens]
    world, corners = cloud(up)
    camera = world.view_from(direction, camera=given, zoom=zoom)
    assert (camera.size, camera.model) == (given.size, given.model)
    np.testing.assert_array_equal(camera.K, given.K)
    pixels, seen = camera.project(corners)
    assert seen.all()
    share = np.abs(pixels - camera.corner - np.array(camera.size) / 2) / (np.array(camera.size) / 2 * 0.9)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    radius = np.linalg.norm(corners - middle, axis=1).max()
    away = np.linalg.norm(middle - camera.C)
    assert share.max() <= zoom + 1e-9
    # The camera is never inside the world's bounding sphere.
    assert share.max() >= zoom * 0.98 or away == pytest.approx(radius)
    np.testing.assert_allclose(
        camera.project(middle)[0], camera.corner + np.array(camera.size) / 2, atol=1e-6
    )
    axis = world.view_from(direction).R[2]
    np.testing.assert_allclose((middle - camera.C) / away, axis, atol=1e-9)


def test_invalid_view_from_arguments_are_refused() -> None:
    with raises(raycam.CameraError, code="invalid_camera", mentions=["[0"]):
        cloud("z")[0].view_from(
            camera=raycam.Camera.orthographic([0, 0, 5], target=[0, 0, 0], height=2, size=(64, 48))
        )
    world, _ = cloud("z")
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'front'"]):
        world.view_from("fornt")
    for wrong in ([0, 0, 0], [1, 2], [np.nan, 0, 1]):
        with raises(raycam.SettingsError, mentions=["direction"]):
            world.view_from(wrong)
    with raises(raycam.SettingsError, code="out_of_range"):
        world.view_from(zoom=0)
    with raises(raycam.CameraError, code="nothing_visible"):
        raycam.World().view_from("front")


def test_world_of_a_single_point_has_a_finite_default_camera() -> None:
    world = raycam.World()
    world.add_mesh([[1, 1, 1]] * 3, [[0, 1, 2]])
    assert np.isfinite(world.default_camera().C).all()


def test_up_argument_changes_only_the_up_axis(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 3 0\nf 1 2 3\n")
    z, y = raycam.load(path), raycam.load(path, up="y")
    assert (z.up, y.up) == ("z", "y")
    np.testing.assert_array_equal(z.triangles(), y.triangles())
    assert [item.name for item in z.objects] == [item.name for item in y.objects]
    np.testing.assert_allclose(-y.view_from("front").R[1], [0, 1, 0], atol=1e-12)
    world = tmp_path / "a.toml"
    world.write_text("[[object]]\nbox = {}\n")
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["=", '"y"']):
        raycam.load(world, up="y")
    with raises(raycam.SettingsError, code="invalid_value", mentions=["'z'", "'y'"]):
        raycam.load(path, up="x")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("asked", "there", "said"),
    [
        ("cats.glb", ["cat.glb", "dog.obj"], fault("file_not_found", "cat.glb")),
        ("cat.gltf", ["cat.glb", "dog.obj"], fault("file_not_found", "cat.glb")),
        ("zebra.ply", ["cat.glb", "dog.obj"], fault("file_not_found", "cat.glb", "dog.obj")),
        ("zebra.ply", ["notes.txt"], fault("file_not_found")),
        ("nowhere/cat.glb", ["cat.glb"], fault("file_not_found")),
    ],
)
def test_missing_model_raises_with_similar_file_names(
    asked: str, there: list[str], said: Fault, tmp_path: Path
) -> None:
    for name in there:
        (tmp_path / name).touch()
    with raises(FileNotFoundError, **said):
        raycam.load(tmp_path / asked)


def share_of(world: raycam.World, name: str, camera: raycam.Camera) -> float:
    """The fraction of pixels that show the object."""
    number = next(item.id for item in world.objects if item.name == name)
    return float((raycam.render(world, camera, channels="instance")["instance"] == number).mean())


GROUNDS: dict[str, dict[str, Any]] = {
    "default": {},
    "small": {"size": 8.0},
    "renamed": {"name": "floor", "color": "red"},
    "shadow catcher": {"shadow_catcher": True, "name": "catcher"},
    "lower": {"height": -3.0},
}


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("kind", GROUNDS)
def test_default_cameras_frame_the_objects_without_the_ground(kind: str, up: Any, tmp_path: Path) -> None:
    world = raycam.World(up)
    world.add_object("sphere", radius=1, name="ball")
    expected = world.view_from("iso")
    share = share_of(world, "ball", world.default_camera())
    assert share > 0.3
    world.add_ground(**GROUNDS[kind])
    assert world.view_from("iso") == expected
    assert share_of(world, "ball", world.default_camera()) == pytest.approx(share, abs=0.01)
    again = raycam.World.from_bytes(world.to_bytes())
    assert again.view_from("iso") == expected
    world.to_gltf(tmp_path / "world.glb")
    read = raycam.load(tmp_path / "world.glb")
    assert share_of(read, "ball", read.default_camera()) == pytest.approx(share, abs=0.01)


def test_ground_does_not_change_the_size_of_the_studio_floor() -> None:
    sides = []
    for ground in (False, True):
        world = raycam.World()
        world.add_object("sphere", radius=1, name="ball")
        if ground:
            world.add_ground()
        world.add_studio()
        floor = next(item.id for item in world.objects if item.name == "studio floor")
        sides.append(np.ptp(world.triangles(floor).reshape(-1, 3), axis=0))
    np.testing.assert_array_equal(*sides)


def test_default_camera_frames_a_ground_without_objects_and_a_table() -> None:
    world = raycam.World()
    world.add_ground(height=0.0, size=2.0)
    assert share_of(world, "ground", world.default_camera()) > 0.1
    table = raycam.World()
    table.add_object(plane={"size": [2.0, 2.0]}, name="table")
    table.add_object("sphere", radius=0.25, name="ball", location=[0, 0, 0.25])
    assert share_of(table, "table", table.default_camera()) > 0.1
    assert share_of(table, "ball", table.default_camera()) < 0.1


@pytest.mark.parametrize("given", [{"size": (64, 48)}, {"fov": 30.0}])
def test_view_from_refuses_a_camera_with_a_size_or_field_of_view(given: dict[str, Any]) -> None:
    world, _ = cloud("z")
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["camera", *given]):
        world.view_from(camera=raycam.data.camera(), **given)
