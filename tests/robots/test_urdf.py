"""Reading of URDF: accepted documents, and errors with lines."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.robots.urdf import read_urdf
from support.raises import fault, raises


def urdf(body: str) -> bytes:
    return f'<robot name="r">\n{body}\n</robot>'.encode()


LINKS = '<link name="a"/>\n<link name="b"/>\n'


def joint(
    name: str = "j", parent: str = "a", child: str = "b", kind: str = "revolute", more: str = ""
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<limit lower="-1" upper="1"/>{more}</joint>\n'
    )


BAD = {
    "two roots": (LINKS, fault("not_a_tree", ":3:", "'a' (line 2)", "'b' (line 3)")),
    "loop": (
        LINKS + '<link name="c"/>\n' + joint("j", "a", "b") + joint("k", "b", "a"),
        fault("cyclic_reference", ":6:", "'k' (line 6)", "'j' (line 5)"),
    ),
    "two parents": (
        LINKS + '<link name="c"/>\n' + joint("j", "a", "c") + joint("k", "b", "c"),
        fault("not_a_tree", ":6:", "link 'c'", "'j' (line 5)"),
    ),
    "unknown parent": (LINKS + joint(parent="aa"), fault("unknown_name", ":4: joint 'j':", "'aa'", "'a'")),
    "duplicate link": ('<link name="a"/>\n<link name="a"/>', fault("duplicate_name", ":3:", "'a'", "line 2")),
    "duplicate joint": (
        LINKS + '<link name="c"/>\n' + joint() + joint(child="c"),
        fault("duplicate_name", ":6:", "'j'", "line 5"),
    ),
    "joint type": (
        LINKS + joint(kind="hinge"),
        fault("unknown_name", ":4: joint 'j':", "'hinge'", "revolute"),
    ),
    "zero axis": (
        LINKS + joint(more='<axis xyz="0 0 0"/>'),
        fault("out_of_range", ":4: joint 'j':", "0 0 0"),
    ),
    "not a number": (
        LINKS + joint(more='<origin xyz="0 nan 0"/>'),
        fault("wrong_type", ":4: <origin>", "'xyz'", "'0 nan 0'"),
    ),
    "two numbers": (LINKS + joint(more='<origin xyz="0 1"/>'), fault("wrong_type", ":4:", "'0 1'")),
    "mimic circle": (
        LINKS
        + '<link name="c"/>\n'
        + joint("j", more='<mimic joint="k"/>')
        + joint("k", child="c", more='<mimic joint="j"/>'),
        fault("cyclic_reference", ":6:", "j, k, j"),
    ),
    "limits": (
        LINKS + joint().replace('lower="-1"', 'lower="2"'),
        fault("out_of_range", ":4: joint 'j':", "2", "1"),
    ),
    "no geometry": (
        '<link name="a">\n<visual/></link>',
        fault("missing_value", ":3: <visual>", "<geometry>"),
    ),
    "shape": (
        '<link name="a"><visual><geometry>\n<cone radius="1"/></geometry></visual></link>',
        fault("unknown_name", ":3:", "'cone'"),
    ),
    "zero scale": (
        '<link name="a"><visual><geometry>\n<mesh filename="a.stl" scale="1 0 1"/></geometry></visual></link>',
        fault("out_of_range", ":3:", "scale", "1 0 1"),
    ),
    "colour": (
        '<material name="m">\n<color rgba="255 0 0 1"/></material><link name="a"/>',
        fault("out_of_range", ":3:", "255 0 0 1"),
    ),
    "empty": ("", fault("nothing_visible", ":1:")),
    "xacro": ('<macro name="m"/><link name="a"/>', fault("wrong_format", ":1:", "xacro")),
    "no name": ("<link/>", fault("missing_value", ":2: <link>", "'name'")),
}


@pytest.mark.parametrize("case", BAD)
def test_urdf_faults_raise_with_lines(case: str) -> None:
    body, expected = BAD[case]
    with raises(raycam.FormatError, **expected):
        read_urdf(urdf(body), "r.urdf")


def test_documents_of_other_formats_are_refused_with_their_name() -> None:
    with raises(raycam.FormatError, code="wrong_format", mentions=[".xml"]):
        read_urdf(b"<mujoco/>", "r.urdf")


def test_six_joint_types_are_read() -> None:
    kinds = ["revolute", "continuous", "prismatic", "planar", "floating", "fixed"]
    links = "".join(f'<link name="l{number}"/>' for number in range(7))
    joints = "".join(joint(kind, f"l{number}", f"l{number + 1}", kind) for number, kind in enumerate(kinds))
    robot = read_urdf(urdf(links + joints), "r.urdf")
    assert [one.type for one in robot.joints.values()] == kinds
    assert (robot.joints["revolute"].lower, robot.joints["revolute"].upper) == (-1, 1)
    assert np.isinf(robot.joints["continuous"].upper)


def test_materials_are_found_at_the_top_level_or_in_another_visual() -> None:
    shape = "<geometry><sphere radius='1'/></geometry>"
    body = (
        '<material name="top"><color rgba="1 0 0 1"/></material>'
        f'<link name="a"><visual>{shape}<material name="top"/></visual>'
        f'<visual>{shape}<material name="inner"><color rgba="0 1 0 0.5"/></material></visual>'
        f'<visual>{shape}<material name="inner"/></visual>\n<visual>{shape}<material name="tap"/></visual></link>'
    )
    robot = read_urdf(urdf(body), "r.urdf")
    colors = [visual.material.rgba for visual in robot.links["a"].visuals]
    assert colors == [(1, 0, 0, 1), (0, 1, 0, 0.5), (0, 1, 0, 0.5), None]
    assert len(robot.notices) == 1
    assert "r.urdf:3" in str(robot.notices[0])
    assert "'tap'" in str(robot.notices[0])


def test_joint_that_mimics_an_unknown_joint_gives_a_notice() -> None:
    robot = read_urdf(urdf(LINKS + joint(more='<mimic joint="k"/>')), "r.urdf")
    assert robot.joints["j"].mimic is None
    assert "r.urdf:4" in str(robot.notices[0])


def test_mimic_of_a_floating_joint_raises() -> None:
    body = (
        LINKS
        + '<link name="c"/>\n'
        + joint("f", kind="floating")
        + joint("j", "b", "c", more='<mimic joint="f"/>')
    )
    with raises(raycam.FormatError, code="invalid_value", mentions=["r.urdf:6", "'j'"]):
        read_urdf(urdf(body), "r.urdf")


def test_mimic_of_a_fixed_joint_is_ignored_with_a_notice() -> None:
    robot = read_urdf(urdf(LINKS + joint(kind="fixed", more='<mimic joint="k"/>')), "r.urdf")
    assert robot.joints["j"].mimic is None
    assert "r.urdf:4" in str(robot.notices[0])
