"""Files that are compressed, have a wrong extension, or whose encoding is not UTF-8."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
import raycam
import trimesh
from PIL import Image
from support.raises import raises

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
TEXTS = {
    "obj": OBJ,
    "off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "stl": "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    "endsolid\n",
    "toml": '[[object]]\nname = "Würfel"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\ntriangles = [[0, 1, 2]]\n',
}
TRIANGLE = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}
TOOLS = {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "dist": [0.1, 0, 0, 0, 0], "image_size": [640, 480]}


def packed() -> dict[str, bytes]:
    """An OBJ file in every compression format that Python can write."""
    data = OBJ.encode()
    stored, tar = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(stored, "w") as file:
        file.writestr("a.obj", data)
    with tarfile.open(fileobj=tar, mode="w") as archive:
        archive.addfile(tarfile.TarInfo("a.obj"), io.BytesIO(b""))
    return {
        "gzip": gzip.compress(data),
        "ZIP": stored.getvalue(),
        "bzip2": bz2.compress(data),
        "XZ": lzma.compress(data),
        "tar": tar.getvalue(),
    }


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("packing", ["gzip", "ZIP", "bzip2", "XZ", "tar"])
def test_compressed_files_are_refused_with_their_format(tmp_path: Path, kind: str, packing: str) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_bytes(packed()[packing])
    with raises(raycam.FormatError, mentions=[path.name, packing]):
        raycam.load(path)


def picture(kind: str) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (4, 4)).save(stream, kind)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (picture("PNG"), "PNG image"),
        (picture("JPEG"), "JPEG image"),
        (b"Kaydara FBX Binary  \0", "FBX"),
        (b"BLENDER-v300", "Blender"),
        (b"\x93NUMPY\x01\0", "NumPy"),
        (b"PXR-USDC\0", "USD"),
    ],
)
def test_files_of_another_format_are_refused_with_its_name(tmp_path: Path, content: bytes, name: str) -> None:
    for kind in TEXTS:
        path = tmp_path / f"a.{kind}"
        path.write_bytes(content)
        with raises(raycam.FormatError, mentions=[path.name, name]):
            raycam.load(path)


@pytest.mark.parametrize("ending", [*TEXTS, "glb", "gltf"])
def test_glb_and_ply_are_read_with_any_extension(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    for content in (TEXTS["ply"].encode(), trimesh.Trimesh(**TRIANGLE).export(file_type="glb")):
        path.write_bytes(content)
        assert raycam.load(path).counts["triangles"] == 1


def test_binary_stl_with_any_header_is_read(tmp_path: Path) -> None:
    facet = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes() + b"\0\0"
    for header in (b"BLENDER export", b"ply\n", b"PK\x03\x04"):
        path = tmp_path / "a.stl"
        path.write_bytes(header.ljust(80) + (1).to_bytes(4, "little") + facet)
        assert raycam.load(path).counts["triangles"] == 1


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
@pytest.mark.parametrize("kind", TEXTS)
def test_text_files_with_a_byte_order_mark_are_read(tmp_path: Path, kind: str, encoding: str) -> None:
    """Notepad and PowerShell write such files."""
    path = tmp_path / f"a.{kind}"
    path.write_bytes(TEXTS[kind].encode(encoding))
    world = raycam.load(path)
    np.testing.assert_array_equal(np.asarray(world.bounds), [[0, 0, 0], [1, 1, 0]])
    assert kind != "toml" or world.objects[0].name == "Würfel"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be-marked", "utf-8-sig"])
@pytest.mark.parametrize("kind", ["json", "yaml"])
def test_calibrations_with_a_byte_order_mark_are_read(tmp_path: Path, kind: str, encoding: str) -> None:
    path = tmp_path / f"a.{kind}"
    text = json.dumps(TOOLS)
    marked = b"\xfe\xff" + text.encode("utf-16-be") if "marked" in encoding else text.encode(encoding)
    path.write_bytes(marked)
    (camera,) = raycam.load_cameras(path).values()
    assert camera.K.tolist() == TOOLS["K"]
    assert camera.distortion is not None


def test_folder_in_place_of_a_model_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    with raises(IsADirectoryError, code="file_unreadable", mentions=["a.obj"]):
        raycam.load(tmp_path)
