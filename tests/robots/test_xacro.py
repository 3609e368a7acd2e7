"""Xacro files: equal to ROS's own expansion, and confined."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import raycam
from raycam import FormatError, SettingsError
from raycam.robots import FileResolver
from raycam.robots.xacro import XacroLimits, expand_xacro
from support.raises import raises

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
BOX = '<visual><geometry><box size="{size}"/></geometry></visual>'

ROBOTS = {
    "property": HEAD + '<xacro:property name="w" value="0.3"/><link name="a">'
    '<visual><geometry><box size="${w} ${2*w} ${w**2}"/></geometry></visual></link></robot>',
    "argument": HEAD + '<xacro:arg name="n" default="base"/><link name="$(arg n)"/></robot>',
    "macro": HEAD + '<xacro:macro name="leg" params="side y:=0.1 *origin"><link name="${side}_leg"/>'
    '<joint name="${side}" type="fixed"><xacro:insert_block name="origin"/><parent link="a"/>'
    '<child link="${side}_leg"/></joint></xacro:macro><link name="a"/>'
    '<xacro:leg side="left"><origin xyz="0 ${radians(30)} 0"/></xacro:leg>'
    '<xacro:leg side="right"><origin xyz="0 -${pi/6} 0"/></xacro:leg></robot>',
    "condition": HEAD
    + '<xacro:property name="on" value="${1 &lt; 2}"/><xacro:if value="${on}"><link name="a"/></xacro:if>'
    '<xacro:unless value="${on}"><link name="b"/></xacro:unless></robot>',
    "loop": HEAD + '<link name="l0"/><xacro:macro name="chain" params="i n"><link name="l${i}"/>'
    '<joint name="j${i}" type="fixed"><parent link="l${i-1}"/><child link="l${i}"/></joint>'
    '<xacro:if value="${i &lt; n}"><xacro:chain i="${i+1}" n="${n}"/></xacro:if></xacro:macro>'
    '<xacro:chain i="1" n="5"/></robot>',
    "include": HEAD + '<xacro:include filename="parts/part.xacro"/><xacro:part name="a"/></robot>',
    "yaml": HEAD + '<xacro:property name="p" value="${xacro.load_yaml(\'parts/sizes.yaml\')}"/>'
    '<link name="a"><visual><geometry><sphere radius="${p[\'radius\']}"/></geometry></visual></link></robot>',
    "list": HEAD + '<xacro:property name="v" value="${[1, 2, 3]}"/><link name="l${v[1]}"/></robot>',
    "block": HEAD + '<xacro:property name="shape"><geometry><box size="1 1 1"/></geometry></xacro:property>'
    '<link name="a"><visual><xacro:insert_block name="shape"/></visual></link></robot>',
    "format": HEAD + "<link name=\"${'%s_%02d' % ('arm', 7)}\"/></robot>",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    parts = tmp_path / "parts"
    parts.mkdir()
    (parts / "part.xacro").write_text(
        HEAD + '<xacro:macro name="part" params="name"><link name="${name}"/></xacro:macro></robot>'
    )
    (parts / "sizes.yaml").write_text("radius: 0.25\n")
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.urdf.xacro"
    path.write_text(text)
    return path


def expanded(path: Path, **arguments: str) -> str:
    return expand_xacro(path, FileResolver(path), arguments)[0].decode()


@pytest.mark.parametrize("name", ROBOTS)
def test_xacro_expansion_equals_that_of_ros(folder: Path, name: str) -> None:
    path = written(folder, ROBOTS[name])
    program = "import sys, xacro; print(xacro.process_file(sys.argv[1]).toprettyxml(indent='  '), end='')"
    run = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True
    )
    assert expanded(path) == run.stdout


def test_xacro_arguments_replace_defaults(folder: Path) -> None:
    path = written(folder, ROBOTS["argument"])
    assert list(raycam.load(path).robots["r"].links) == ["base"]
    assert list(raycam.load(path, xacro_args={"n": "foot"}).robots["r"].links) == ["foot"]


def test_world_files_pass_arguments(folder: Path) -> None:
    written(folder, ROBOTS["argument"])
    (folder / "world.toml").write_text(
        '[[robot]]\nfile = "robot.urdf.xacro"\nxacro_args = { n = "foot" }\n[[object]]\nbox = { size = 1 }\n'
    )
    assert list(raycam.load(folder / "world.toml").robots["r"].links) == ["foot"]


def test_packages_named_by_find_and_their_meshes_are_found(tmp_path: Path) -> None:
    package = tmp_path / "src" / "arm"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "parts.xacro").write_text(HEAD + '<xacro:property name="file" value="m.obj"/></robot>')
    (package / "meshes" / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    robot = tmp_path / "robot"
    robot.mkdir()
    path = written(
        robot,
        HEAD + '<xacro:include filename="$(find arm)/parts.xacro"/><link name="a"><visual><geometry>'
        '<mesh filename="file://$(find arm)/meshes/${file}"/></geometry></visual></link></robot>',
    )
    world = raycam.load(path, packages=[tmp_path / "src"])
    assert [item.name for item in world.objects] == ["r/a"]
    with raises(FormatError, mentions=["arm"]):
        raycam.load(path)


OUTSIDE = {
    "include": '<xacro:include filename="{secret}"/>',
    "yaml": '<xacro:property name="p" value="${{xacro.load_yaml(\'{secret}\')}}"/><link name="${{p}}"/>',
    "relative": '<xacro:include filename="../secret.xacro"/>',
}


@pytest.mark.parametrize("name", OUTSIDE)
def test_files_outside_of_the_root_are_not_read(tmp_path: Path, name: str) -> None:
    secret = tmp_path / "secret.xacro"
    secret.write_text(HEAD + '<link name="password"/></robot>')
    inside = tmp_path / "inside"
    inside.mkdir()
    path = written(inside, HEAD + OUTSIDE[name].format(secret=secret) + '<link name="a"/></robot>')
    with pytest.raises(FormatError) as refused:
        expanded(path)
    assert "secret.xacro" in str(refused.value)
    assert "password" not in str(refused.value)


def test_symbolic_links_that_lead_outside_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.xacro"
    secret.write_text(HEAD + '<link name="password"/></robot>')
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.xacro").symlink_to(secret)
    path = written(inside, HEAD + '<xacro:include filename="link.xacro"/></robot>')
    with raises(FormatError, code="outside_root", mentions=["secret.xacro"]) as refused:
        expanded(path)
    assert "password" not in str(refused.value)


ESCAPES = {
    "process": "[c for c in (1).__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0](['true'])",
    "subclasses": "().__class__",
    "import": "__import__('os').system('true')",
    "generator": "[x for x in (x.gi_frame.f_back.f_back.f_builtins for x in [1])]",
}


@pytest.mark.parametrize("name", ESCAPES)
def test_expressions_cannot_leave_their_sandbox(folder: Path, name: str) -> None:
    path = written(folder, HEAD + f'<link name="${{{ESCAPES[name]}}}"/></robot>')
    with pytest.raises(FormatError):
        expanded(path)


def test_xacro_process_has_an_empty_environment(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYCAM_SECRET", "password")
    path = written(folder, HEAD + '<link name="$(env RAYCAM_SECRET)"/></robot>')
    with raises(FormatError, mentions=["RAYCAM_SECRET"]) as refused:
        expanded(path)
    assert "password" not in str(refused.value)


def test_expansion_that_never_ends_is_stopped(folder: Path) -> None:
    path = written(
        folder, HEAD + '<link name="${sum(1 for _ in range(10**12))}"/></robot>'.replace("sum", "python.sum")
    )
    with pytest.raises(FormatError) as refused:
        expand_xacro(path, FileResolver(path), {}, XacroLimits(seconds=3.0))
    assert refused.value.code == "budget_exceeded"


def test_expansion_that_needs_too_much_memory_is_refused(folder: Path) -> None:
    path = written(folder, HEAD + "<link name=\"${'a' * 10**10}\"/></robot>")
    with raises(FormatError, code="budget_exceeded"):
        expanded(path)


def test_macro_that_calls_itself_is_refused(folder: Path) -> None:
    path = written(folder, HEAD + '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/></robot>')
    with raises(FormatError, mentions=["RecursionError"]):
        expanded(path)


@pytest.mark.parametrize(
    ("body", "fact"),
    [
        ('<link name="${missing}"/>', "missing"),
        ("<xacro:unknown/>", "unknown"),
        ('<xacro:include filename="none.xacro"/>', "none.xacro"),
        ('<link name="$(arg none)"/>', "none"),
    ],
)
def test_errors_name_the_cause_and_the_file(folder: Path, body: str, fact: str) -> None:
    path = written(folder, HEAD + body + "</robot>")
    with raises(FormatError, mentions=[fact]) as refused:
        expanded(path)
    assert str(path) in str(refused.value)


def test_entities_are_refused(folder: Path) -> None:
    path = written(folder, '<!DOCTYPE r [<!ENTITY a "aa">]>' + HEAD + "</robot>")
    with raises(FormatError, code="unsupported_feature", mentions=["a"]):
        expanded(path)


def test_xacro_warnings_become_notices(folder: Path) -> None:
    path = written(folder, HEAD + '<xacro:property name="x" value="1" what="2"/><link name="a"/></robot>')
    _, notices = expand_xacro(path, FileResolver(path), {})
    assert {notice.code for notice in notices} == {"xacro_warning"}
    assert "what" in str(notices[0])  # the unknown attribute


def test_xacro_argument_without_effect_adds_a_notice(folder: Path) -> None:
    path = written(folder, ROBOTS["argument"])
    _, notices = expand_xacro(path, FileResolver(path), {"n": "foot", "m": "toe"})
    assert [notice.code for notice in notices] == ["xacro_warning"]
    assert "effect: m; arguments of the file: n" in str(notices[0])


def test_xacro_args_of_wrong_type_or_for_urdf_files_are_refused(folder: Path) -> None:
    path = written(folder, ROBOTS["argument"])
    with pytest.raises(SettingsError) as refused:
        raycam.load(path, xacro_args={"n": 3})  # type: ignore[dict-item]
    assert refused.value.code == "wrong_type"
    (folder / "a.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    with pytest.raises(SettingsError) as refused:
        raycam.load(folder / "a.urdf", xacro_args={"n": "a"})
    assert refused.value.code == "conflicting_values"
