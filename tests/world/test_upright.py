"""glTF models in z-up worlds are turned upright with a notice; compared with trimesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import has_notice, raises, warns

trimesh = pytest.importorskip("trimesh")


@pytest.fixture(params=["glb", "gltf"])
def tower(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A box of height 3 along y that stands on the ground and is longer in z than in x."""
    mesh = trimesh.creation.box((0.5, 3.0, 1.0))
    mesh.apply_translation((0, 1.5, 0.25))
    path = tmp_path / f"tower.{request.param}"
    if request.param == "glb":
        mesh.export(path)
    else:
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
            (tmp_path / (path.name if name.endswith(".gltf") else name)).write_bytes(data)
    return path


TURNED = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # x is unchanged, y points up, z points to the front


def test_gltf_model_stands_upright_in_a_z_up_world(tower: Path) -> None:
    world = raycam.World("z")
    with warns(raycam.Notice, code="converted_up_axis"):
        world.add_object(mesh=tower)
    corners = np.asarray(trimesh.load(tower, force="mesh").triangles) @ TURNED.T
    assert world.triangles() == pytest.approx(corners, abs=1e-6)
    assert world.bounds == pytest.approx(np.array([[-0.25, -0.75, 0], [0.25, 0.25, 3]]))
    assert np.array_equal(world.objects[0].matrix, np.eye(4))


@pytest.mark.parametrize(("up", "keys"), [("z", {"upright": False}), ("y", {}), ("y", {"upright": True})])
def test_model_is_not_turned_in_a_y_up_world_or_without_upright(
    tower: Path, up: str, keys: dict[str, bool]
) -> None:
    world = raycam.World(up)  # type: ignore[arg-type]
    world.add_object(mesh=tower, **keys)  # type: ignore[arg-type]
    assert world.notices == []
    assert world.triangles() == pytest.approx(
        np.asarray(trimesh.load(tower, force="mesh").triangles), abs=1e-6
    )


def test_placement_is_applied_after_turning_upright(tower: Path) -> None:
    world = raycam.World()
    first = world.add_object(mesh=tower, location=[5, 0, 1], yaw=90, scale=2)
    other = world.add_object(instance_of="tower", location=[0, 0, 2])
    assert world.triangles(first).reshape(-1, 3).min(axis=0)[2] == pytest.approx(1)
    assert world.triangles(first).reshape(-1, 3).max(axis=0)[2] == pytest.approx(7)
    assert np.ptp(world.triangles(other).reshape(-1, 3), axis=0) == pytest.approx([0.5, 1, 3])


def test_world_files_turn_gltf_models_upright(tower: Path) -> None:
    path = tower.with_name("world.toml")
    path.write_text(
        f'[[object]]\nname = "a"\nmesh = "{tower.name}"\n[[object]]\nname = "b"\nmesh = "{tower.name}"\n'
        f'upright = false\n[[object]]\nname = "c"\nmesh = "{tower.name}"\nyaw = 90\n'
    )
    world = raycam.load(path)
    heights = [np.ptp(world.triangles(i).reshape(-1, 3), axis=0) for i in range(3)]
    assert heights == pytest.approx(np.array([[0.5, 1, 3], [0.5, 3, 1], [1, 0.5, 3]]))
    assert [notice.code for notice in world.notices].count("converted_up_axis") == 1
    path.write_text(f'up = "y"\n[[object]]\nmesh = "{tower.name}"\n')
    assert raycam.load(path).notices == []


def test_normals_are_turned_with_the_model(tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(2)
    _ = mesh.vertex_normals
    mesh.export(tmp_path / "ball.glb", include_normals=True)
    world = raycam.World()
    world.add_object(mesh=tmp_path / "ball.glb")
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(40, 30), fov=40)
    frame = raycam.render(world, camera, samples=1, channels=["position", "shading_normal", "instance"])
    seen = frame["instance"] >= 0
    unit = frame["position"][seen] / np.linalg.norm(frame["position"][seen], axis=1, keepdims=True)
    assert (unit * frame["shading_normal"][seen]).sum(axis=1).min() > 0.999


def test_upright_requires_a_mesh_file() -> None:
    with raises(raycam.WorldError, code="missing_value"):
        raycam.World().add_object(box={}, upright=True)


TRANSFORM = np.array([[0.0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]])


def test_matrix_applies_to_the_axes_of_the_file(tower: Path) -> None:
    loaded = np.asarray(trimesh.load(tower, force="mesh").triangles)
    expected = loaded @ TRANSFORM[:3, :3].T + TRANSFORM[:3, 3]
    world = raycam.World("z")
    with warns(raycam.Notice, code="converted_up_axis", mentions=["matrix"]):
        world.add_object(mesh=tower, matrix=TRANSFORM)
    assert len(world.notices) == 1
    for item in world.objects:
        assert world.triangles(item.id) == pytest.approx(expected, abs=1e-6)
        assert np.array_equal(item.matrix, TRANSFORM)


@pytest.mark.parametrize("upright", [True, False])
def test_upright_is_applied_before_a_matrix(tower: Path, upright: bool) -> None:
    loaded = np.asarray(trimesh.load(tower, force="mesh").triangles)
    turned = loaded @ TURNED.T if upright else loaded
    world = raycam.World("z")
    world.add_object(mesh=tower, matrix=TRANSFORM, upright=upright)
    assert world.triangles() == pytest.approx(turned @ TRANSFORM[:3, :3].T + TRANSFORM[:3, 3], abs=1e-6)
    assert len(world.notices) == int(upright)


def test_matrix_in_a_y_up_world_gives_no_notice(tower: Path) -> None:
    world = raycam.World("y")
    world.add_object(mesh=tower, matrix=TRANSFORM)
    assert world.notices == []


def test_world_files_and_changes_apply_a_matrix_to_the_axes_of_the_file(tower: Path) -> None:
    loaded = np.asarray(trimesh.load(tower, force="mesh").triangles)
    expected = loaded @ TRANSFORM[:3, :3].T + TRANSFORM[:3, 3]
    path = tower.with_name("posed.toml")
    path.write_text(f'[[object]]\nname = "a"\nmesh = "{tower.name}"\nmatrix = {TRANSFORM.tolist()}\n')
    world = raycam.load(path)
    assert world.triangles() == pytest.approx(expected, abs=1e-6)
    assert [notice.code for notice in world.notices].count("converted_up_axis") == 1
    assert has_notice(world.notices, "converted_up_axis", "matrix")
    world = raycam.World("z", folder=tower.parent)
    world.add_object("box", name="a")
    world.set_object("a", mesh=tower.name, matrix=TRANSFORM)
    assert world.triangles() == pytest.approx(expected, abs=1e-6)
