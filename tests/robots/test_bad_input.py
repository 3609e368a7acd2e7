"""Invalid input from users, one group of cases for each kind.

Every error or notice has a code and contains the facts that help.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam
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


JOINTS: list[tuple[object, Fault]] = [
    ({"elbo": 0.1}, fault("unknown_name", "'elbo'", "'elbow'")),
    ({3: 0.1}, fault("unknown_name", "3")),
    ({"still": 0.1}, fault("unknown_name", "fixed", "elbow")),
    ([0.1], fault("wrong_shape", "[2]", "[1]", "elbow, wheel")),
    (np.zeros((4, 3)), fault("wrong_shape", "[2]", "[4, 3]", "elbow, wheel")),
    (0.5, fault("wrong_shape", "[2]", "[]")),
    ({"elbow": math.inf}, fault("out_of_range", "elbow")),
    ({"elbow": [[0.1]]}, fault("wrong_shape", "elbow")),
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


def test_robot_inside_a_table_is_reported_by_info(write: Callable[[str], Path]) -> None:
    from raycam.info import info

    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]}, location=[0, 0, -0.08])
    world.add_robot(write(links("a")))
    assert "'table' and 'robot/a': 20.0 mm" in info(world)
