"""Collada meshes: geometry compared with trimesh, units, materials, and faulty files."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam
import trimesh
from raycam.robots import collada_to_glb
from support.raises import has_notice, warns

CUBE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="u" meter="{unit}"/><up_axis>{up}</up_axis></asset>
  <library_effects><effect id="red-fx"><profile_COMMON><technique sid="c"><phong>
    <diffuse><color>0.5 0.25 1 1</color></diffuse>{extra}<shininess><float>30</float></shininess>
  </phong></technique></profile_COMMON></effect></library_effects>
  <library_materials><material id="red"><instance_effect url="#red-fx"/></material></library_materials>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="15">0 0 0  2 0 0  2 1 0  0 1 0  0 0 3</float_array>
      <technique_common><accessor source="#pa" count="5" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <polylist count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4</vcount>
      <p>0 1 2 3</p></polylist>
    <triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 4</p></triangles>
    <lines count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1</p></lines>
  </mesh></geometry></library_geometries>
  <library_nodes><node id="shared"><scale>1 2 1</scale>
    <instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="m" target="#red"/>
    </technique_common></bind_material></instance_geometry></node></library_nodes>
  <library_visual_scenes><visual_scene id="s"><node><translate>1 0 0</translate><rotate>0 0 1 90</rotate>
    <node><matrix>1 0 0 0 0 1 0 5 0 0 1 0 0 0 0 1</matrix><instance_node url="#shared"/></node></node>
    <node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., raycam.World]:
    """Loads a robot that shows a Collada document."""

    def load(text: str | bytes, scale: str = "1 1 1") -> raycam.World:
        (tmp_path / "a.dae").write_bytes(text if isinstance(text, bytes) else text.encode())
        mesh = f'<mesh filename="a.dae" scale="{scale}"/>'
        robot = f'<robot name="r"><link name="a"><visual><geometry>{mesh}</geometry></visual></link></robot>'
        (tmp_path / "r.urdf").write_text(robot, encoding="utf-8")
        return raycam.load(tmp_path / "r.urdf")

    return load


def cube(unit: str = "1", up: str = "Z_UP", extra: str = "") -> str:
    return CUBE.format(unit=unit, up=up, extra=extra)


def test_triangles_agree_with_trimesh(load: Callable[..., raycam.World], tmp_path: Path) -> None:
    world = load(cube())
    judge = trimesh.load_scene(tmp_path / "a.dae", file_type="dae").to_geometry()
    expected = judge.triangles
    found = world.triangles().reshape(-1, 3, 3)
    assert len(found) == len(expected) == 6
    order = [np.lexsort(rows.reshape(len(rows), 9).round(5).T) for rows in (found, expected)]
    np.testing.assert_allclose(found[order[0]], expected[order[1]], atol=1e-6)


def test_unit_is_applied_and_up_axis_is_ignored_as_in_rviz(load: Callable[..., raycam.World]) -> None:
    plain = load(cube()).triangles()
    with warns(raycam.Notice, code="ignored_key", mentions=["Y_UP"]):
        scaled = load(cube("0.01", "Y_UP"), scale="2 2 2").triangles()
    np.testing.assert_allclose(scaled, plain * 0.02, atol=1e-8)


@pytest.mark.parametrize(("up", "expected"), [("Y_UP", [0, 2, 1]), ("X_UP", [1, 2, 0]), ("Z_UP", [0, 1, 2])])
def test_up_axis_is_applied_on_request(
    load: Callable[..., raycam.World], tmp_path: Path, up: str, expected: list[int]
) -> None:
    plain = load(cube()).triangles().reshape(-1, 3)
    (tmp_path / "a.dae").write_text(cube(up=up), encoding="utf-8")
    world = raycam.World()
    world.add_robot(tmp_path / "r.urdf", up_axis="apply")
    turned = world.triangles().reshape(-1, 3)
    # COLLADA 1.4.1: with X_UP, right is -y and forward is -z; with Y_UP, forward is -z; with Z_UP, forward is y
    signs = {"Y_UP": [1, -1, 1], "X_UP": [-1, -1, 1], "Z_UP": [1, 1, 1]}[up]
    np.testing.assert_allclose(turned, plain[:, expected] * signs, atol=1e-7)


def test_mirrored_scale_keeps_triangles_facing_outwards(load: Callable[..., raycam.World]) -> None:
    plain, mirrored = (load(cube(), scale=scale).triangles() for scale in ("1 1 1", "1 -1 1"))
    np.testing.assert_allclose(mirrored.reshape(-1, 3), plain.reshape(-1, 3) * [1, -1, 1], atol=1e-6)


def test_colours_are_srgb(load: Callable[..., raycam.World]) -> None:
    colors = load(cube()).triangle_colors()
    np.testing.assert_allclose(colors[0], [0.2140411, 0.0508761, 1], atol=1e-5)


@pytest.mark.parametrize(("diffuse", "emissive"), [("0.5 0.25 1", False), ("0 0 0", True)])
def test_emission_is_light_only_without_a_diffuse_colour(
    tmp_path: Path, diffuse: str, emissive: bool
) -> None:
    text = cube(extra="<emission><color>0.25 0.25 0.25 1</color></emission>")
    path = tmp_path / "a.dae"
    path.write_text(text.replace("0.5 0.25 1 1", f"{diffuse} 1"), encoding="utf-8")
    data, notices = collada_to_glb(path, Path)
    material = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])["materials"][0]
    expected = ((0.25 + 0.055) / 1.055) ** 2.4
    assert material.get("emissiveFactor") == (pytest.approx([expected] * 3) if emissive else None)
    assert has_notice(notices, "ignored_feature", "'red'") is not emissive


def test_a_robot_with_emission_gets_default_lights(load: Callable[..., raycam.World]) -> None:
    world = load(cube(extra="<emission><color>0.1 0.1 0.1 1</color></emission>"))
    world.prepare()
    assert world._core.lit_by_default_lights


@pytest.mark.parametrize(
    ("mode", "opacity"), [("A_ONE", 0.6), ("A_ZERO", 0.4), ("RGB_ONE", 0.4), ("RGB_ZERO", 0.6)]
)
def test_four_transparency_modes_are_read(tmp_path: Path, mode: str, opacity: float) -> None:
    extra = f'<transparent opaque="{mode}"><color>0.5 0.5 0.5 0.75</color></transparent>'
    path = tmp_path / "a.dae"
    path.write_text(cube(extra=extra + "<transparency><float>0.8</float></transparency>"), encoding="utf-8")
    data, _ = collada_to_glb(path, Path)
    material = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])["materials"][0]
    assert material["pbrMetallicRoughness"]["baseColorFactor"][3] == pytest.approx(opacity, abs=1e-4)
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"<COLLADA/>", "no triangles|not a valid"),
        (b"not xml", "invalid XML"),
        (b'<!DOCTYPE x [<!ENTITY a "b">]><COLLADA>&a;</COLLADA>', "entity"),
        (cube().replace("<p>0 1 4</p>", "<p>0 1 99</p>").encode(), "a.dae"),
        (cube().replace("0 0 0  2 0 0", "0 x 0  2 0 0").encode(), "a.dae"),
        (cube().replace('url="#g">', 'url="#shared">').encode(), "a.dae|ignored"),
        (
            cube().replace("<scale>1 2 1</scale>", '<instance_node url="#shared"/>').encode(),
            "circle|not a valid",
        ),
        (cube().replace("1 0 0 0 0 1 0 5", "1 0 0 0 0 1 0 q").encode(), "16 finite numbers"),
        (cube()[: len(cube()) // 2].encode(), "invalid XML"),
        (b"PK\x03\x04", "invalid XML"),
    ],
)
def test_faulty_documents_raise_or_give_a_notice(
    load: Callable[..., raycam.World], text: bytes, expected: str
) -> None:
    with raycam.notices.collected() as notices:
        faults = []
        try:
            notices += load(text).notices
        except raycam.FormatError as error:
            faults.append(str(error))
    assert any("a.dae" in fault and re.search(expected, fault) for fault in [*faults, *map(str, notices)])


def test_lines_give_a_notice_with_their_line_and_geometry(load: Callable[..., raycam.World]) -> None:
    assert has_notice(load(cube()).notices, "ignored_element", "line 16: <lines> of geometry 'g'")


def test_image_outside_of_the_root_is_not_read(load: Callable[..., raycam.World], tmp_path: Path) -> None:
    image = '<library_images><image id="i"><init_from>../../secret.png</init_from></image></library_images>'
    text = cube().replace("<library_effects>", image + "<library_effects>")
    params = (
        '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
        '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
    )
    text = text.replace("<profile_COMMON>", "<profile_COMMON>" + params)
    text = text.replace("<color>0.5 0.25 1 1</color>", '<texture texture="s" texcoord="UV"/>')
    uv = (
        '<source id="t"><float_array id="ta" count="10">0 0 1 0 1 1 0 1 0 0</float_array><technique_common>'
        '<accessor source="#ta" count="5" stride="2"><param name="S" type="float"/><param name="T" type="float"/>'
        "</accessor></technique_common></source>"
    )
    text = text.replace('<vertices id="v">', uv + '<vertices id="v">')
    text = text.replace(
        '<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 4',
        '<input semantic="VERTEX" source="#v" offset="0"/><input semantic="TEXCOORD" source="#t" offset="0"/><p>0 1 4',
    )
    assert has_notice(load(text).notices, "missing_file", "secret.png")
