"""Objects that fall: poses from closed forms, penetration by trimesh and FCL."""

from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest
import raycam
from raycam import WorldError
from raycam.info import info
from raycam.world.settle import find_overlaps
from support.bin_of_parts import bin_of_parts
from support.penetration import fcl_penetration

MAX_PENETRATION = 2e-4


def test_box_that_falls_on_a_table_rests_on_it() -> None:
    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]})
    world.add_object(name="box", box={"size": [0.2, 0.1, 0.05]}, location=[0.1, 0, 0.3])
    report = raycam.settle(world, "box")
    assert report.objects == ("box",)
    assert report.attempts == 1
    np.testing.assert_allclose(world.objects[1].matrix[:3, 3], [0.1, 0, 0.075], atol=5e-4)
    np.testing.assert_allclose(world.objects[1].matrix[:3, :3], np.eye(3), atol=1e-3)


def test_gravity_points_against_the_up_axis() -> None:
    world = raycam.World("y")
    world.add_object(name="table", box={"size": [1, 0.1, 1]})
    world.add_object(name="ball", sphere={"radius": 0.1}, location=[0, 0.4, 0])
    raycam.settle(world, ["ball"])
    np.testing.assert_allclose(world.objects[1].matrix[:3, 3], [0, 0.15, 0], atol=1e-3)


def test_scaled_and_mirrored_meshes_rest_on_their_own_faces() -> None:
    world = raycam.World()
    world.add_object(name="table", box={"size": [4, 4, 0.1]})
    matrix = np.diag([-0.2, 0.1, 0.3, 1.0])
    matrix[:3, 3] = [0, 0, 0.5]
    world.add_object(name="box", box={"size": [1, 1, 1]}, matrix=matrix)
    raycam.settle(world, "box")
    settled = world.objects[1].matrix
    np.testing.assert_allclose(settled[2, 3], 0.05 + 0.15, atol=5e-4)
    np.testing.assert_allclose(np.linalg.svd(settled[:3, :3])[1], [0.3, 0.2, 0.1], rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_pile_does_not_penetrate_according_to_fcl(seed: int) -> None:
    world, things = bin_of_parts(12)
    report = raycam.settle(world, things, into="bin", seed=seed)
    assert report.penetration <= MAX_PENETRATION
    assert fcl_penetration(world) <= MAX_PENETRATION


def test_fcl_finds_a_penetration_of_a_millimetre() -> None:
    world, things = bin_of_parts(12)
    raycam.settle(world, things, into="bin")
    lowered = world.objects[-1].matrix.copy()
    lowered[2, 3] -= 1.5e-3
    world.set_object(world.objects[-1].name, matrix=lowered)
    assert fcl_penetration(world) > MAX_PENETRATION


@pytest.mark.proof
def test_piles_of_1000_seeds_do_not_penetrate() -> None:
    for seed in range(1000):
        world, things = bin_of_parts(12)
        raycam.settle(world, things, into="bin", seed=seed)
        assert fcl_penetration(world) <= MAX_PENETRATION, seed


PROGRAM = """
import sys, hashlib, raycam
sys.path.insert(0, "tests")
from support.bin_of_parts import bin_of_parts
world, things = bin_of_parts(6)
world.prepare(threads=int(sys.argv[1]))
raycam.settle(world, things, into="bin", seed=9)
print(hashlib.sha256(world.to_bytes()).hexdigest())
"""


def test_processes_with_any_number_of_threads_return_the_same_bytes() -> None:
    def run(threads: str) -> str:
        command = [sys.executable, "-c", PROGRAM, threads]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert run("1") == run("2")


def test_settled_poses_depend_on_seed_and_object_names() -> None:
    def poses(seed: int) -> list[np.ndarray]:
        world, things = bin_of_parts(3)
        raycam.settle(world, things, into="bin", seed=seed)
        return [item.matrix for item in world.objects]

    for one, other in itertools.combinations([poses(1), poses(2), poses(3)], 2):
        assert not np.allclose(one, other)


def test_objects_on_a_table_have_their_centres_above_it() -> None:
    world = raycam.World()
    world.add_object(name="floor", plane={"size": [5, 5]}, location=[0, 0, -0.7])
    world.add_object(name="table", box={"size": [0.6, 0.4, 0.02]})
    names = [f"box-{i}" for i in range(4)]
    for name in names:
        world.add_object(name=name, box={"size": [0.08, 0.06, 0.04]})
    raycam.settle(world, names, on="table", seed=4)
    for item in world.objects[2:]:
        assert np.abs(item.matrix[:2, 3]).tolist() < [0.301, 0.201]
        assert item.matrix[2, 3] > 0.01


def test_friction_decides_whether_a_box_slides() -> None:
    def slide(friction: float) -> float:
        world = raycam.World()
        world.add_object(name="slope", box={"size": [1, 1, 0.02]}, pitch=20)
        world.add_object(name="stop", box={"size": [0.02, 2, 2]}, location=[0.45, 0, 0])
        world.add_object(name="box", box={"size": [0.1, 0.1, 0.05]}, pitch=20, location=[0.0, 0, 0.045])
        physics = {"box": {"friction": friction}, "slope": {"friction": friction}}
        raycam.settle(world, "box", physics=physics)
        return float(np.linalg.norm(world.objects[2].matrix[:3, 3] - [0.0, 0, 0.045]))

    # The tangent of 20 degrees is 0.364.
    assert slide(0.45) < 0.03
    assert slide(0.25) > 0.2


@pytest.mark.parametrize(
    ("arguments", "code", "fact"),
    [
        ({"objects": "bix"}, "unknown_name", "'bix'"),
        ({"objects": []}, "missing_value", "objects"),
        ({"objects": ["box", 1]}, "duplicate_name", "objects"),
        ({"objects": 7}, "out_of_range", "7"),
        ({"objects": "box", "into": "box"}, "conflicting_values", "into"),
        ({"objects": "box", "physics": {"box": {"weight": 1}}}, "unknown_key", "'weight'"),
        ({"objects": "box", "physics": {"table": {"density": 2}}}, "conflicting_values", "density"),
        ({"objects": "box", "physics": {"box": {"density": -2}}}, "out_of_range", "-2"),
        ({"objects": "box", "physics": {"box": {"restitution": 2}}}, "out_of_range", "2"),
        ({"objects": "sheet"}, "no_volume", '"sheet"'),
        ({"objects": "box", "gravity": 0}, "out_of_range", "0"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict, code: str, fact: str) -> None:
    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]})
    world.add_object(name="box", box={"size": [0.1, 0.1, 0.1]}, location=[0, 0, 1])
    world.add_object(name="sheet", plane={"size": [0.1, 0.1]}, location=[0, 0, 2])
    before = world.to_bytes()
    with pytest.raises(WorldError) as refused:
        raycam.settle(world, **arguments)
    assert refused.value.code == code
    assert fact in str(refused.value)
    assert world.to_bytes() == before


def test_into_and_on_are_alternatives() -> None:
    world, things = bin_of_parts(1)
    with pytest.raises(raycam.SettingsError) as refused:
        raycam.settle(world, things, into="bin", on="bin")
    assert refused.value.code == "conflicting_values"


def test_objects_without_room_are_refused_and_the_world_is_unchanged() -> None:
    world, _ = bin_of_parts(0)
    world.add_object(name="crate", box={"size": [1, 1, 1]}, location=[0, 0, 3])
    before = world.to_bytes()
    with pytest.raises(WorldError) as refused:
        raycam.settle(world, "crate", into="bin", seconds=1)
    assert refused.value.code == "not_settled"
    assert world.to_bytes() == before


URDF = """<robot name="arm"><link name="base"><visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
<link name="top"><visual><geometry><box size="0.1 0.1 0.2"/></geometry></visual></link>
<joint name="j" type="fixed"><origin xyz="0 0 0.2"/><parent link="base"/><child link="top"/></joint></robot>"""


def test_robot_inside_a_table_is_reported(tmp_path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]}, location=[0, 0, -0.14])
    world.add_robot(tmp_path / "arm.urdf")
    world.add_object(name="box", box={"size": [0.05, 0.05, 0.05]}, location=[0.3, 0, 0.1])
    assert find_overlaps(world) == [("table", "arm/base", pytest.approx(0.01, abs=1e-9))]
    assert "overlap    'table' and 'arm/base': 10.0 mm" in info(world)
    with pytest.warns(raycam.Notice) as notices:
        raycam.settle(world, "box")
    assert [notice.message.code for notice in notices] == ["overlapping_objects"]
    with pytest.raises(WorldError) as refused:
        raycam.settle(world, "arm")
    assert refused.value.code == "conflicting_values"
