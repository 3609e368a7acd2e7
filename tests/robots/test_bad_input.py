"""Invalid input from users, one group of cases for each kind.

Every error or notice has a code and contains the facts that help.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.world.joint_keyframes import read_trajectory
from support.raises import Fault, fault, raises, warns

BOX = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
LAUGHS = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
SECRET = '<!DOCTYPE x [<!ENTITY s SYSTEM "secret.txt">]>'
MODELS = {
    ".urdf": f'<robot name="r">%s<link name="a">{BOX}</link></robot>',
    ".sdf": f'<sdf version="1.9"><model name="m">%s<link name="a">{BOX.replace("box size", "sphere x")}'
    "</link></model></sdf>",
    ".xacro": f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">%s<link name="a">{BOX}</link></robot>',
}


def mesh(name: str) -> str:
    return f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'


def joint(name: str, parent: str, child: str, kind: str = "revolute") -> str:
    limit = '<limit lower="-1" upper="1"/>' if kind in ("revolute", "prismatic") else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{limit}</joint>'
    )


def links(*names: str) -> str:
    return "".join(f'<link name="{name}">{BOX}</link>\n' for name in names)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def made(body: str) -> Path:
        path = tmp_path / "robot.urdf"
        path.write_text(f'<robot name="robot">\n{body}</robot>')
        return path

    return made


MISSING = {
    "relative": ("meshes/a.stl", "no such file"),
    "package": ("package://nobody/a.stl", "'nobody'"),
    "model": ("model://nobody/a.dae", "'nobody'"),
    "file": ("file:///nowhere/a.obj", "/nowhere/a.obj"),
    "backslashes": ("meshes\\deep\\b.stl", "meshes/deep/b.stl"),
    "http": ("https://example.com/a.stl", "https://"),
    "folder": (".", "no such file"),
    "null character": ("file:///a%00.stl", "null"),
    "long": (f"{'a' * 5000}.stl", "too long"),
    "long package": (f"package://{'a' * 5000}/a.stl", "too long"),
}


@pytest.mark.parametrize("case", MISSING)
def test_missing_meshes_are_listed_together_or_replaced(write: Callable[[str], Path], case: str) -> None:
    name, fact = MISSING[case]
    path = write(
        f'<link name="a">{mesh(name)}</link><link name="b">{mesh("other.stl")}</link>'
        + joint("j", "a", "b", "fixed")
    )
    with raises(
        raycam.FormatError, code="file_not_found", mentions=[repr(name), fact, "other.stl", "robot.urdf:2"]
    ):
        raycam.load(path)
    world = raycam.World()
    with warns(raycam.Notice, code="ignored_element", mentions=[repr(name)]):
        world.add_robot(path, missing="box")
    assert [item.name for item in world.objects] == ["robot/a", "robot/b"]


TREES = {
    "three roots": (links("a", "b", "c"), fault("not_a_tree", "3 links", "line 2", "line 4")),
    "two parents": (
        links("a", "b", "c") + joint("j", "a", "c") + joint("k", "b", "c"),
        fault("not_a_tree", "'c'", "'k'", "'j' (line 5)", "robot.urdf:5"),
    ),
    "loop of two beside a root": (
        links("r", "a", "b") + joint("j", "a", "b") + joint("k", "b", "a"),
        fault("cyclic_reference", "'j'", "'k'"),
    ),
    "link is its own parent": (links("a") + joint("j", "a", "a"), fault("cyclic_reference", "'j'")),
    "no parent link": (links("a", "b") + joint("j", "base", "b"), fault("unknown_name", "'base'", ":4")),
    "no child link": (links("a", "b") + joint("j", "a", "bb"), fault("unknown_name", "'bb'", "'b'", ":4")),
    "same link": (links("a", "a"), fault("duplicate_name", "'a'", "line 2", ":3")),
    "same joint": (
        links("a", "b", "c") + joint("j", "a", "b") + joint("j", "b", "c"),
        fault("duplicate_name", "'j'"),
    ),
    "no links": ("", fault("nothing_visible", ":1")),
}


@pytest.mark.parametrize("case", TREES)
def test_links_that_form_no_tree_are_refused_with_lines(write: Callable[[str], Path], case: str) -> None:
    body, expected = TREES[case]
    with raises(raycam.FormatError, **expected):
        raycam.load(write(body))


SDF_TREES = {
    "same link": (
        '<link name="a"/>\n<link name="a"/>',
        fault("duplicate_name", "link 'a'", "line 2", ":3"),
    ),
    "same joint": (
        '<link name="a"/><link name="b"/><link name="c"/>\n'
        '<joint name="j" type="fixed"><parent>a</parent><child>b</child></joint>\n'
        '<joint name="j" type="fixed"><parent>a</parent><child>c</child></joint>',
        fault("duplicate_name", "joint 'j'", "line 3", ":4"),
    ),
    "same model": (
        '<model name="n"><link name="a"/></model>\n<model name="n"><link name="a"/></model>',
        fault("duplicate_name", "model 'n'", "line 2", ":3"),
    ),
    "loop": (
        '<link name="a"/><link name="b"/>\n'
        '<joint name="j" type="fixed"><parent>a</parent><child>b</child></joint>\n'
        '<joint name="k" type="fixed"><parent>b</parent><child>a</child></joint>',
        fault("cyclic_reference", "'k' (line 4)", "'j' (line 3)"),
    ),
    "no parent link": (
        '<link name="a"/>\n<joint name="j" type="fixed"><parent>x</parent><child>a</child></joint>',
        fault("unknown_name", "'j'", "'x'", ":3"),
    ),
}


@pytest.mark.parametrize("case", SDF_TREES)
def test_sdf_links_that_form_no_tree_are_refused_with_lines(tmp_path: Path, case: str) -> None:
    body, expected = SDF_TREES[case]
    path = tmp_path / "model.sdf"
    path.write_text(f'<sdf version="1.9"><model name="m">\n{body}</model></sdf>')
    with raises(raycam.FormatError, **expected):
        raycam.load(path)


def test_two_roots_in_a_xacro_file_are_refused_with_lines_of_the_expanded_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.xacro"
    path.write_text(MODELS[".xacro"] % '<link name="b"/>')
    with raises(raycam.FormatError, code="not_a_tree") as refused:
        raycam.load(path)
    program = "import sys, xacro; print(xacro.process_file(sys.argv[1]).toprettyxml(indent='  '))"
    run = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=True)
    lines = run.stdout.splitlines()
    for name in ("a", "b"):
        number = next(i for i, line in enumerate(lines, start=1) if f'<link name="{name}"' in line)
        assert f"'{name}' (line {number})" in str(refused.value)


MISSING_PARTS = {
    "included models": (
        "robot.sdf",
        '<sdf version="1.9"><world name="w"><include><uri>model://one</uri></include>\n'
        "<include><uri>model://two</uri></include></world></sdf>",
        ["'model://one'", "'model://two'", "robot.sdf:2", "searched"],
    ),
    "MJCF files": (
        "robot.xml",
        '<mujoco><asset><mesh file="one.stl"/><texture type="2d" file="two.png"/></asset>\n'
        '<worldbody><geom type="mesh" mesh="one"/></worldbody></mujoco>',
        ["'one.stl'", "'two.png'", "robot.xml:1", "searched"],
    ),
    "xacro file": (
        "robot.xacro",
        MODELS[".xacro"] % '<xacro:include filename="one.xacro"/>',
        ["no such file", "one.xacro"],
    ),
    "xacro package": (
        "robot.xacro",
        MODELS[".xacro"] % '<xacro:include filename="$(find nobody)/one.xacro"/>',
        ["package 'nobody' not found", "searched"],
    ),
}


@pytest.mark.parametrize("case", MISSING_PARTS)
def test_missing_parts_of_other_formats_are_listed_together(tmp_path: Path, case: str) -> None:
    name, text, facts = MISSING_PARTS[case]
    if name.endswith(".xml"):
        pytest.importorskip("mujoco")
    (tmp_path / name).write_text(text)
    with raises(raycam.FormatError, code="file_not_found", mentions=facts):
        raycam.load(tmp_path / name)


@pytest.mark.parametrize("name", ["robot.urdf", "robot.sdf", "robot.xacro", "robot.xml", "mesh.dae"])
def test_git_lfs_pointers_are_refused_with_their_cause(tmp_path: Path, name: str) -> None:
    pointer = tmp_path / name
    pointer.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    path = pointer
    if name == "mesh.dae":
        pytest.importorskip("collada")
        path = tmp_path / "robot.urdf"
        path.write_text(f'<robot name="r"><link name="a">{mesh(name)}</link></robot>')
    with raises(raycam.FormatError, code="placeholder_file", mentions=[name, "git lfs pull"]):
        raycam.load(path)


JOINTS: list[tuple[object, Fault]] = [
    ({"elbo": 0.1}, fault("unknown_name", "'elbo'", "'elbow'")),
    ({3: 0.1}, fault("unknown_name", "3")),
    ({"still": 0.1}, fault("unknown_name", "fixed", "elbow")),
    ([0.1], fault("wrong_shape", "[2]", "[1]", "elbow, wheel")),
    (np.zeros((4, 3)), fault("wrong_shape", "[2]", "[4, 3]", "elbow, wheel")),
    (0.5, fault("wrong_shape", "[2]", "[]")),
    ({"elbow": math.inf}, fault("out_of_range", "elbow")),
    ({"elbow": [[0.1]]}, fault("wrong_shape", "elbow")),
    (None, fault("wrong_type", "None")),
]


@pytest.mark.parametrize(("joints", "expected"), JOINTS)
def test_wrong_joint_values_are_refused_with_the_order(
    write: Callable[[str], Path], joints: object, expected: Fault
) -> None:
    body = links("a", "b", "c", "d") + joint("elbow", "a", "b") + joint("wheel", "b", "c", "continuous")
    world = raycam.load(write(body + joint("still", "c", "d", "fixed")))
    with raises(raycam.WorldError, **expected):
        world.set_joints("robot", joints)  # type: ignore[arg-type]
    assert world.robots["robot"].joints == ("elbow", "wheel")


@pytest.mark.parametrize(
    ("value", "codes"), [(90.0, {"implausible", "outside_limits"}), (6.2, {"outside_limits"})]
)
def test_degrees_of_a_limited_joint_are_reported(
    write: Callable[[str], Path], value: float, codes: set[str]
) -> None:
    world = raycam.load(write(links("a", "b") + joint("elbow", "a", "b")))
    with pytest.warns(raycam.Notice) as notices:
        world.set_joints("robot", {"elbow": value})
    assert {notice.message.code for notice in notices} == codes  # type: ignore[union-attr]


WORLD_TEXTS = {
    "joints of the table": "joints = { elbow = 90 }\n",
    "keyframe": 'joints = { elbow = 0 }\n[[video.keyframe]]\ntime = 1\nrobot = "arm"\njoints = { elbow = 90 }\n',
}


@pytest.mark.parametrize("case", WORLD_TEXTS)
def test_degrees_in_a_world_file_are_reported(write: Callable[[str], Path], case: str) -> None:
    path = write(links("a", "b") + joint("elbow", "a", "b")).with_name("world.toml")
    path.write_text(f'[[robot]]\nname = "arm"\nfile = "robot.urdf"\n{WORLD_TEXTS[case]}')
    with pytest.warns(raycam.Notice) as notices:
        raycam.load(path)
    assert {notice.message.code for notice in notices} == {"implausible", "outside_limits"}  # type: ignore[union-attr]


def test_robot_files_that_a_world_file_names_and_that_do_not_exist_raise(tmp_path: Path) -> None:
    path = tmp_path / "world.toml"
    path.write_text('[[object]]\nbox = { size = 1 }\n[[robot]]\nfile = "nobody.urdf"\n')
    with pytest.raises(FileNotFoundError, match=r"line 3: robot\[0\].*nobody\.urdf"):
        raycam.load(path)


def test_joint_values_of_a_trajectory_that_are_not_finite_or_named_twice_raise(
    write: Callable[[str], Path], tmp_path: Path
) -> None:
    world = raycam.load(write(links("a", "b") + joint("elbow", "a", "b")))
    frames = [
        {"time": time, "robot": "robot", "joints": {"elbow": value}}
        for time, value in ((0, 0), (1, math.nan))
    ]
    with raises(raycam.WorldError, code="out_of_range", mentions=["elbow"]):
        world.set_video(fps=10, keyframe=frames)
    path = tmp_path / "joints.csv"
    path.write_text("time,elbow,elbow\n0,0,0\n")
    with raises(raycam.WorldError, code="duplicate_name", mentions=["'elbow'", "joints.csv:1"]):
        read_trajectory(world.robots["robot"], path)
    np.save(tmp_path / "joints.npy", np.array([{}], dtype=object))
    with raises(raycam.WorldError, code="invalid_value", mentions=["joints.npy"]):
        read_trajectory(world.robots["robot"], tmp_path / "joints.npy")


def test_render_many_without_joint_vectors_raises(write: Callable[[str], Path]) -> None:
    world = raycam.load(write(links("a", "b") + joint("elbow", "a", "b")))
    with raises(raycam.WorldError, code="missing_value", mentions=["joints['robot']"]):
        raycam.render_many(world, joints={"robot": np.zeros((0, 1))}, channels=["depth"])


def test_turns_of_a_continuous_joint_are_not_reported(write: Callable[[str], Path]) -> None:
    world = raycam.load(write(links("a", "b") + joint("wheel", "a", "b", "continuous")))
    with raycam.strict():
        world.set_joints("robot", {"wheel": 90.0})


@pytest.mark.parametrize("suffix", MODELS)
@pytest.mark.parametrize(("head", "fact"), [(LAUGHS, "'a'"), (SECRET, "'s'")])
def test_entities_of_every_format_are_refused(tmp_path: Path, suffix: str, head: str, fact: str) -> None:
    (tmp_path / "secret.txt").write_text("secret")
    path = tmp_path / f"robot{suffix}"
    path.write_text(f'<?xml version="1.0"?>{head}{MODELS[suffix] % "&b;&s;"}')
    with raises(raycam.FormatError, mentions=[path.name, fact]):
        raycam.load(path)


@pytest.mark.parametrize("suffix", [".urdf", ".sdf"])
def test_million_links_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"robot{suffix}"
    path.write_text(MODELS[suffix] % ('<link name="x"/>' * 1_000_000))
    with raises(raycam.FormatError, mentions=[path.name, "300000"]):
        raycam.load(path)


BOMBS = {
    "copies of copies": ('<replicate count="1000">' * 3 + '<geom size="1"/>' + "</replicate>" * 3, "300000"),
    "copies of an included file": (
        '<replicate count="1000"><include file="part.txt"/></replicate>',
        "300000",
    ),
    "generated bodies": ('<flexcomp name="f" type="grid" count="1000 1000 1000"/>', "300000"),
    "generated values": (
        "</worldbody><asset><hfield nrow='30000' ncol='30000'/></asset><worldbody>",
        "67108864",
    ),
    "entity of an included file": ('<include file="entity.txt"/>', "'a'"),
    "included file that names a file outside": ('<include file="outside.txt"/>', "secret.xml"),
}


@pytest.mark.parametrize("case", BOMBS)
def test_mjcf_files_that_generate_too_much_are_refused(tmp_path: Path, case: str) -> None:
    pytest.importorskip("mujoco")
    body, fact = BOMBS[case]
    (tmp_path / "secret.xml").write_text("<mujocoinclude/>")
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "part.txt").write_text(
        '<mujocoinclude><replicate count="1000"><site/></replicate></mujocoinclude>'
    )
    (folder / "entity.txt").write_text(f"{LAUGHS}<mujocoinclude/>")
    (folder / "outside.txt").write_text('<mujocoinclude><include file="../secret.xml"/></mujocoinclude>')
    (folder / "robot.xml").write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with raises(raycam.FormatError, mentions=[fact]):
        raycam.load(folder / "robot.xml")


def test_sdf_files_that_include_each_other_many_times_are_refused(tmp_path: Path) -> None:
    links_of_model = "".join(f'<link name="l{i}"/>' for i in range(10))
    for depth in range(7):
        inner = "".join(f"<include><uri>m{depth + 1}.sdf</uri><name>n{i}</name></include>" for i in range(10))
        body = '<plugin name="p"/>' * 10_000 + (inner if depth < 6 else links_of_model)
        (tmp_path / f"m{depth}.sdf").write_text(f'<sdf version="1.9"><model name="m">{body}</model></sdf>')
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["300000"]):
        raycam.load(tmp_path / "m0.sdf")


@pytest.mark.parametrize(("head", "fact"), [(LAUGHS, "'a'"), (SECRET, "'s'")])
def test_entities_of_included_xacro_files_are_refused(tmp_path: Path, head: str, fact: str) -> None:
    (tmp_path / "secret.txt").write_text("secret")
    (tmp_path / "part.xacro").write_text(f"{head}<robot/>")
    path = tmp_path / "robot.xacro"
    path.write_text(MODELS[".xacro"] % '<xacro:include filename="part.xacro"/>')
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["part.xacro:1", fact]):
        raycam.load(path)


def test_robot_inside_a_table_is_reported_by_info(write: Callable[[str], Path]) -> None:
    from raycam.info import info

    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]}, location=[0, 0, -0.08])
    world.add_robot(write(links("a")))
    assert "'table' and 'robot/a': 20.0 mm" in info(world)
