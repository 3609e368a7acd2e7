"""Damaged Collada files load or raise an error with a code and a line, within limits of time and memory."""

from __future__ import annotations

import random
import re
import time
import tracemalloc
import warnings
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import raycam
from PIL import Image
from support.damaged import NUMBERS, damaged
from support.raises import has_notice, raises

MAX_BYTES = 60_000_000
"""Memory limit for a file of a few kilobytes."""
MAX_SECONDS = 10.0
"""Limit of processor time for such a file."""


def source(name: str, numbers: str, parameters: str) -> str:
    count = len(numbers.split())
    rows = "".join(f'<param name="{parameter}" type="float"/>' for parameter in parameters)
    return (
        f'<source id="{name}"><float_array id="{name}-values" count="{count}">{numbers}</float_array>'
        f'<technique_common><accessor source="#{name}-values" count="{count // len(parameters)}" '
        f'stride="{len(parameters)}">{rows}</accessor></technique_common></source>'
    )


def effect(name: str, shading: str, head: str = "") -> str:
    return (
        f'<effect id="{name}-effect"><profile_COMMON>{head}<technique sid="t">{shading}</technique></profile_COMMON>'
        "</effect>"
    )


def shape(kind: str, indices: str, inputs: str = "", counts: str = "") -> str:
    vertex = '<input semantic="VERTEX" source="#v" offset="0"/>'
    return f'<{kind} count="1" material="{"m" if inputs else "k"}">{vertex}{inputs}{counts}<p>{indices}</p></{kind}>\n'


MAPPED = '<input semantic="NORMAL" source="#n" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2" set="0"/>'
SAMPLER = (
    '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
    '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
)
COLORS = (
    "<lambert><emission><color>0 0.1 0 1</color></emission><diffuse><color>0.5 0.25 1 1</color></diffuse>"
    '<transparent opaque="RGB_ZERO"><color>0.2 0.2 0.2 1</color></transparent>'
    "<transparency><float>0.8</float></transparency></lambert>"
)
TEXTURED = (
    '<phong><diffuse><texture texture="s" texcoord="UV"/></diffuse>'
    "<shininess><float>30</float></shininess></phong>"
)
MATERIALS = "".join(
    f'<material id="{name}"><instance_effect url="#{name}-effect"/></material>\n' for name in ("a", "b")
)
DOCUMENT = f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="cm" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_images><image id="i"><init_from>skin.png</init_from></image></library_images>
<library_effects>{effect("a", TEXTURED, SAMPLER)}
{effect("b", COLORS)}</library_effects>
<library_materials>{MATERIALS}</library_materials>
<library_geometries><geometry id="g"><mesh>{source("p", "0 0 0 2 0 0 2 1 0 0 1 0 0 0 3", "XYZ")}
{source("n", "0 0 1 0 0 -1", "XYZ")}{source("t", "0 0 1 0 1 1 0 1", "ST")}
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{shape("polylist", "0 0 0 1 0 1 2 0 2 3 0 3 0 1 0 1 1 1 4 1 2", MAPPED, "<vcount>4 3</vcount>")}
{shape("triangles", "0 1 4")}{shape("tristrips", "0 1 2 3")}{shape("trifans", "0 1 2 4")}{shape("polygons", "0 1 2 3")}
</mesh></geometry>
<geometry id="h"><mesh>{source("q", "0 0 0 2 0 0 2 1 0", "XYZ")}{source("c", "1 0 0 0 1 0 0 0 1", "RGB")}
<vertices id="w"><input semantic="POSITION" source="#q"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#w" offset="0"/><input semantic="COLOR" source="#c" offset="1"/>
<p>0 0 1 1 2 2</p></triangles></mesh></geometry></library_geometries>
<library_controllers><controller id="k"><skin source="#h">
<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 2 0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>
<library_nodes><node id="shared"><scale>1 2 1</scale><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="m" target="#a"/><instance_material symbol="k" target="#b"/>
</technique_common></bind_material></instance_geometry></node></library_nodes>
<library_visual_scenes><visual_scene id="s"><node><translate>1 0 0</translate><rotate>0 0 1 90</rotate>
<node><matrix>1 0 0 0 0 1 0 5 0 0 1 0 0 0 0 1</matrix><instance_node url="#shared"/></node></node>
<node><instance_geometry url="#h"/></node><node><instance_controller url="#k"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A robot whose only mesh is `a.dae` in the same folder."""
    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "skin.png")
    path = tmp_path / "r.urdf"
    mesh = '<visual><geometry><mesh filename="a.dae"/></geometry></visual>'
    path.write_text(f'<robot name="r"><link name="a">{mesh}</link></robot>')
    return path


def load(robot: Path, document: str | bytes) -> raycam.World:
    data = document.encode() if isinstance(document, str) else document
    robot.with_name("a.dae").write_bytes(data)
    return raycam.load(robot)


def error_code(robot: Path, document: str | bytes) -> str | None:
    """Returns the code of the error that a document raises; None for a document that loads."""
    started, error = time.process_time(), None
    tracemalloc.reset_peak()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", raycam.Notice)
        try:
            world = load(robot, document)
        except raycam.FormatError as refused:
            error = refused
    assert time.process_time() - started < MAX_SECONDS
    assert tracemalloc.get_traced_memory()[1] < MAX_BYTES
    if error is None:
        assert np.isfinite(world.triangles()).all()
        return None
    place = "a.dae: " if error.code == "nothing_visible" else r"a\.dae:\d+: "
    assert re.search(place, str(error)), error
    return error.code


def mutate_elements(count: int, seed: int) -> Iterator[bytes]:
    """Yields well-formed documents with random elements, attributes and numbers replaced, moved or removed."""
    draw = random.Random(seed)
    for _ in range(count):
        root = ElementTree.fromstring(DOCUMENT)
        nodes = list(root.iter())
        names = [node.get("id") for node in nodes if node.get("id")]
        for _ in range(draw.choice([1, 1, 2, 5])):
            parent = draw.choice([node for node in nodes if len(node)])
            child, kind = draw.choice(list(parent)), draw.randrange(7)
            if kind == 0:
                parent.remove(child)
            elif kind == 1:
                parent.extend([child] * draw.choice([1, 2, 8]))
            elif kind == 2:
                draw.choice([node for node in nodes if node not in list(child.iter())] or [parent]).append(
                    child
                )
            elif kind == 3:
                child.tag = draw.choice(nodes).tag
            elif kind == 4 and child.attrib:
                key = draw.choice(list(child.attrib))
                values = [f"#{draw.choice(names)}", draw.choice(names), "", *map(_text, NUMBERS)]
                child.set(key, draw.choice(values))
            elif kind == 5:
                node = draw.choice([node for node in nodes if (node.text or "").strip()])
                words = (node.text or "").split() or [""]
                words[draw.randrange(len(words))] = _text(
                    draw.choice([*NUMBERS, b"", b"inf", b"1 2", b"-1 " * 5000])
                )
                node.text = " ".join(words)
            elif child.attrib:
                child.attrib.pop(draw.choice(list(child.attrib)))
        yield ElementTree.tostring(root)


def _text(data: bytes) -> str:
    return data.decode()


def error_codes(robot: Path, documents: Iterator[bytes]) -> set[str | None]:
    """Returns the error codes of all documents; None for documents that load."""
    tracemalloc.start()
    try:
        return {error_code(robot, document) for document in documents}
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("count", [150, pytest.param(2000, marks=pytest.mark.proof)])
def test_file_with_damaged_bytes_loads_or_raises_an_error_with_its_line(robot: Path, count: int) -> None:
    assert {None, "syntax"} <= error_codes(robot, damaged(DOCUMENT.encode(), count, 1))


@pytest.mark.parametrize("count", [200, pytest.param(4000, marks=pytest.mark.proof)])
def test_file_with_replaced_elements_loads_or_raises_an_error_with_its_line(robot: Path, count: int) -> None:
    codes = error_codes(robot, mutate_elements(count, 2))
    assert {None, "syntax", "wrong_shape", "index_out_of_range", "nothing_visible"} <= codes


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("<vcount>4 3", "<vcount>2000000000 3", "wrong_shape"),
        ("<vcount>4 3", "<vcount>3 3", "wrong_shape"),
        ("<vcount>4 3", "<vcount>9 -2", "wrong_shape"),
        ("<p>0 1 4", "<p>0 -1 4", "index_out_of_range"),
        ('source="#n" offset="1"', 'source="#n" offset="900000000"', "syntax"),
        ("0 1 0 0 0 3", "0 1 0 0 0 1e38", "out_of_range"),
        ('meter="0.01"', 'meter="nan"', "out_of_range"),
        ("0.5 0.25 1 1", "0.5 inf 1 1", "wrong_shape"),
        ("0.5 0.25 1 1", "0.5 0.25", "wrong_shape"),
        ("<float>30", "<float>nan", "wrong_shape"),
        ('stride="2"', 'stride="3"', "unsupported_feature"),
        ('<node id="shared">', '<node id="shared"><instance_node url="#shared"/>', "budget_exceeded"),
    ],
)
def test_invalid_number_raises_an_error_with_its_code(robot: Path, old: str, new: str, code: str) -> None:
    assert old in DOCUMENT
    tracemalloc.start()
    try:
        assert error_code(robot, DOCUMENT.replace(old, new)) == code
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("old", "new", "code", "fact"),
    [
        ('url="#shared"', 'url="#other"', "ignored_element", "'other'"),
        ('<instance_geometry url="#h"', '<instance_geometry url="#other"', "ignored_element", "'other'"),
        ('url="#k"', 'url="#other"', "ignored_element", "'other'"),
        ('target="#b"', 'target="#other"', "missing_colors", "'other'"),
        ("<scale>", "<skew>1 2 1 1 1 1 1</skew><scale>", "ignored_feature", "<skew>"),
        ("0 1 0 0 0 3", "0 1 0 0 0 nan", "replaced_value", "'p-values'"),
        ("<p>0 1 4", "<p>0 9 4", "invalid_file", "'g'"),
        ("skin.png", "x" * 5000, "missing_file", "xxx"),
    ],
)
def test_ignored_or_replaced_element_gives_a_notice(
    robot: Path, old: str, new: str, code: str, fact: str
) -> None:
    assert old in DOCUMENT
    assert has_notice(load(robot, DOCUMENT.replace(old, new)).notices, code, fact)


def test_chain_of_30000_nodes_loads_in_linear_time(robot: Path) -> None:
    count = 30_000
    nodes = "".join(f'<node id="n{i}"><instance_node url="#n{i + 1}"/></node>' for i in range(count))
    document = DOCUMENT.replace("<library_nodes>", f'<library_nodes>{nodes}<node id="n{count}"/>')
    started = time.process_time()
    assert len(load(robot, document).triangles()) == 12
    assert time.process_time() - started < MAX_SECONDS


def test_node_shown_a_billion_times_exceeds_the_budget(robot: Path) -> None:
    nodes = "".join(
        f'<node id="n{i}">{f"""<instance_node url="#n{i + 1}"/>""" * 2}</node>' for i in range(30)
    )
    document = DOCUMENT.replace("<library_nodes>", f'<library_nodes>{nodes}<node id="n30"/>')
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["a.dae:", "200000"]):
        load(robot, document.replace('url="#shared"', 'url="#n0"'))
