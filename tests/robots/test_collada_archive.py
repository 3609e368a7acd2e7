"""Collada archives (.zae) as meshes of robots."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.robots import collada_archive
from support.raises import has_notice, raises

DOCUMENT = """<COLLADA><asset><unit meter="0.5"/><up_axis>Z_UP</up_axis></asset>
  <library_images><image id="i"><init_from>{image}</init_from></image></library_images>
  <library_effects><effect id="e"><profile_COMMON>
    <newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>
    <newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>
    <technique sid="c"><lambert><diffuse><texture texture="s" texcoord="u"/></diffuse></lambert></technique>
  </profile_COMMON></effect></library_effects>
  <library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0  2 0 0  0 2 0  2 2 0</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <source id="t"><float_array id="ta" count="2">0.5 0.5</float_array>
      <technique_common><accessor source="#ta" count="1" stride="2"><param name="S" type="float"/>
      <param name="T" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <tristrips count="1" material="k"><input semantic="VERTEX" source="#v" offset="0"/>
      <input semantic="TEXCOORD" source="#t" offset="1" set="0"/><p>0 0 1 0 2 0 3 0</p></tristrips>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material><technique_common>
    <instance_material symbol="k" target="#m"/></technique_common></bind_material></instance_geometry></node>
  </visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
ROBOT = """<robot name="r"><link name="a"><visual><geometry><mesh filename="a.zae"/></geometry></visual></link>
</robot>"""
Archive = Callable[[dict[str, str | bytes]], raycam.World]


def red_image() -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (4, 4), (255, 0, 0)).save(buffer, "PNG")
    return buffer.getvalue()


def document(image: str = "../images/red.png") -> str:
    return DOCUMENT.format(image=image)


@pytest.fixture
def load(tmp_path: Path) -> Archive:
    """Loads a robot whose mesh is an archive with the given files."""

    def load(files: dict[str, str | bytes]) -> raycam.World:
        with zipfile.ZipFile(tmp_path / "a.zae", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        (tmp_path / "r.urdf").write_text(ROBOT, encoding="utf-8")
        return raycam.load(tmp_path / "r.urdf")

    return load


def test_document_with_its_image_is_shown(load: Archive) -> None:
    world = load({"models/square.dae": document(), "images/red.png": red_image()})
    assert world.notices == []
    np.testing.assert_allclose(world.bounds, [[0, 0, 0], [1, 1, 0]])
    assert np.all(np.cross(*np.diff(world.triangles(), axis=1).swapaxes(0, 1))[:, 2] > 0)
    camera = raycam.Camera.look_at([0.5, 0.5, 3], [0.5, 0.5, 0], [0, 1, 0], size=(8, 8), fov=10)
    color = raycam.render(world, camera, integrator="flat")["color"]
    assert color[4, 4, 0] > 0.1
    assert color[4, 4, 1] < 0.01


def test_manifest_selects_the_document(load: Archive) -> None:
    files = {"a.dae": "<COLLADA/>", "b/my square.dae": document(), "images/red.png": red_image()}
    manifest = '<?xml version="1.0"?><dae_root xmlns="">./b/my%20square.dae#scene</dae_root>'
    for text in (manifest, f"<manifest>{manifest.partition('?>')[2]}</manifest>"):
        assert len(load(files | {"manifest.xml": text}).triangles()) == 2


def test_first_of_several_documents_is_shown_with_a_notice(load: Archive) -> None:
    world = load({"b.dae": document(), "a/a.dae": document(), "images/red.png": red_image()})
    assert has_notice(world.notices, "ignored_element", "b.dae")


@pytest.mark.parametrize(
    "image", ["../../secret.png", "/etc/secret.png", "http://example.org/a.png", "no.png"]
)
def test_images_outside_of_the_archive_are_not_read(load: Archive, tmp_path: Path, image: str) -> None:
    (tmp_path / "secret.png").write_bytes(red_image())
    world = load({"models/square.dae": document(image)})
    assert has_notice(world.notices, "missing_file", image)


@pytest.mark.parametrize(
    ("files", "code", "fact"),
    [
        ({"a.txt": "text"}, "nothing_visible", ".dae"),
        ({"../a.dae": document()}, "invalid_value", "../a.dae"),
        ({"a.dae": document(), "manifest.xml": "<dae_root>b.dae</dae_root>"}, "file_not_found", "b.dae"),
        ({"a.dae": document(), "manifest.xml": "<dae_root>../../b.dae</dae_root>"}, "outside_root", "b.dae"),
        (
            {"a.dae": document(), "manifest.xml": '<!DOCTYPE a [<!ENTITY x "y">]><a/>'},
            "unsupported_feature",
            "'x'",
        ),
        ({"in/a.dae": document().replace("0 0 1 0 2 0 3 0", "0 0 1")}, "syntax", "in/a.dae:"),
        ({"in/a.dae": "<COLLADA>"}, "syntax", "in/a.dae:"),
        ({"a.dae": "<COLLADA><asset/></COLLADA>"}, "nothing_visible", "a.dae"),
    ],
)
def test_faulty_archives_raise_with_the_place(
    load: Archive, files: dict[str, str | bytes], code: str, fact: str
) -> None:
    with raises(raycam.FormatError, code=code, mentions=["a.zae", fact]):
        load(files)


def test_archives_beyond_the_limits_raise(load: Archive, monkeypatch: pytest.MonkeyPatch) -> None:
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["a.zae", "512 MiB"]):
        load({"a.dae": document(), "b.png": b"\0" * (collada_archive.MAX_BYTES + 1)})
    monkeypatch.setattr(collada_archive, "MAX_FILES", 2)
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["2 files"]):
        load({f"{number}.dae": document() for number in range(3)})


def test_damaged_archives_and_placeholders_raise(load: Archive, tmp_path: Path) -> None:
    load({"a.dae": document(), "red.png": red_image()})
    data = (tmp_path / "a.zae").read_bytes()
    for damaged, code in (
        (data[:200], "file_unreadable"),
        (b"version https://git-lfs.github.com/spec/v1\n", "placeholder_file"),
        (b"<COLLADA/>", "file_unreadable"),
    ):
        (tmp_path / "a.zae").write_bytes(damaged)
        with raises(raycam.FormatError, code=code, mentions=["a.zae"]):
            raycam.load(tmp_path / "r.urdf")
