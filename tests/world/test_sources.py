"""Worlds from bytes and file objects, detection of file kinds, and units of meshes."""

from __future__ import annotations

import io
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from support.raises import raises

BOX = trimesh.creation.box((1, 2, 3))


def exported(kind: str) -> bytes:
    """A box of 1 x 2 x 3 as trimesh writes it."""
    data = BOX.export(
        file_type={"stl text": "stl_ascii", "ply text": "ply"}.get(kind, kind),
        **({"encoding": "ascii"} if kind == "ply text" else {}),
    )
    return data.encode() if isinstance(data, str) else data


KINDS = ["glb", "stl", "stl text", "ply", "ply text", "off", "obj"]


def sides(world: raycam.World) -> list[float]:
    low, high = world.bounds
    return sorted((high - low).tolist())


@pytest.mark.parametrize("kind", KINDS)
def test_content_determines_the_kind(tmp_path: Path, kind: str) -> None:
    data = exported(kind)
    for source in (data, bytearray(data), memoryview(data), io.BytesIO(data)):
        world = raycam.load(source)
        assert sides(world) == pytest.approx([1, 2, 3])
        assert world.counts["triangles"] == 12
    for name in ("model", "model.bin", "model.download"):
        (tmp_path / name).write_bytes(data)
        assert sides(raycam.load(tmp_path / name)) == pytest.approx([1, 2, 3])
        with (tmp_path / name).open("rb") as file:
            assert sides(raycam.load(file)) == pytest.approx([1, 2, 3])


@pytest.mark.parametrize("kind", KINDS)
def test_kind_argument_specifies_the_content(kind: str) -> None:
    data = exported(kind)
    for name in (kind.split()[0], "." + kind.split()[0].upper()):
        assert sides(raycam.load(data, kind=name)) == pytest.approx([1, 2, 3])


def test_long_obj_text_is_recognised() -> None:
    """The faces begin after more than 64 KiB of vertices."""
    sphere = trimesh.creation.icosphere(subdivisions=5)
    data = sphere.export(file_type="obj").encode()
    assert raycam.load(data).counts["triangles"] == len(sphere.faces)


@pytest.mark.parametrize("name", ["avatar.vrm", "avatar", "avatar.gltf", "AVATAR.VRM"])
def test_glb_under_other_names_is_read(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(exported("glb"))
    assert sides(raycam.load(tmp_path / name)) == pytest.approx([1, 2, 3])
    world = raycam.World(folder=tmp_path)
    world.add_object(mesh=name)
    assert sides(world) == pytest.approx([1, 2, 3])


def test_gltf_bytes_with_embedded_buffers_are_read() -> None:
    files = BOX.export(file_type="gltf", merge_buffers=True, embed_buffers=True)
    assert sides(raycam.load(files["model.gltf"])) == pytest.approx([1, 2, 3])


def test_gltf_bytes_that_name_files_are_refused() -> None:
    files = BOX.export(file_type="gltf")
    with raises(OSError, mentions=["gltf_buffer_0.bin"]):
        raycam.load(files["model.gltf"])


@pytest.mark.parametrize("kind", ["usda", "usdc", "usdz"])
def test_usd_bytes_are_read(tmp_path: Path, kind: str) -> None:
    from pxr import Usd, UsdGeom, UsdUtils

    path = tmp_path / f"a.{'usdc' if kind == 'usdz' else kind}"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Cube.Define(stage, "/cube").GetPrim())
    stage.GetRootLayer().Save()
    if kind == "usdz":
        assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "a.usdz"))
        path = tmp_path / "a.usdz"
    assert sides(raycam.load(path.read_bytes())) == pytest.approx([2, 2, 2])
    shutil.copy(path, tmp_path / "noending")
    assert sides(raycam.load(tmp_path / "noending")) == pytest.approx([2, 2, 2])


def test_world_file_bytes_are_read_by_kind() -> None:
    text = b"[[object]]\nbox = { size = [1, 2, 3] }\n"
    assert sides(raycam.load(text, kind="toml")) == pytest.approx([1, 2, 3])


@pytest.mark.parametrize(
    ("arguments", "factor"),
    [
        ({"scale": 0.001}, 0.001),
        ({"units": "mm"}, 0.001),
        ({"units": "in"}, 0.0254),
        ({"scale": 2}, 2),
        ({"units": "m"}, 1),
    ],
)
@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "off"])
def test_scale_multiplies_all_coordinates(
    tmp_path: Path, kind: str, arguments: dict[str, Any], factor: float
) -> None:
    path = tmp_path / f"a.{kind}"
    moved = BOX.copy()
    moved.apply_translation([10, 0, 0])
    moved.export(path)
    expected = moved.bounds * factor
    for source in (path, path.read_bytes()):
        world = raycam.load(source, **arguments)
        np.testing.assert_allclose(world.bounds, expected, rtol=1e-6)
        np.testing.assert_allclose(world.triangles().reshape(-1, 3).min(axis=0), expected[0], rtol=1e-6)
        assert world.triangles().shape == (12, 3, 3)
    camera = raycam.Camera.look_at([20 * factor, -8 * factor, 0], [10 * factor, 0, 0], size=(24, 24), fov=40)
    frame = raycam.render(raycam.load(path, **arguments), camera, channels=["depth"], samples=1)
    assert np.isfinite(frame["depth"]).any()


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"scale": 0.0}, "out_of_range"),
        ({"scale": float("nan")}, "out_of_range"),
        ({"scale": True}, "wrong_type"),
        ({"scale": 2, "units": "mm"}, "conflicting_values"),
        ({"units": "miles"}, "unknown_name"),
        ({"kind": "fbx"}, "unknown_name"),
        ({"time": 1.0}, "conflicting_values"),
    ],
)
def test_wrong_argument_is_refused(arguments: dict[str, Any], code: str) -> None:
    with raises(raycam.SettingsError, code=code):
        raycam.load(exported("stl"), **arguments)


@pytest.mark.parametrize("source", [3, None, ["a.glb"], io.StringIO("solid a"), "text"])
def test_source_of_an_unsupported_type_is_refused(source: Any) -> None:
    with raises((raycam.SettingsError, FileNotFoundError)):  # type: ignore[arg-type]
        raycam.load(source)


def test_scale_of_a_format_with_units_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(exported("glb"))
    for source in (tmp_path / "a", exported("glb")):
        with raises(raycam.SettingsError, code="conflicting_values"):
            raycam.load(source, scale=2)


def test_unknown_content_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(b"nothing that is known")
    for source in (tmp_path / "a.bin", b"nothing that is known", b""):
        with raises(raycam.FormatError):
            raycam.load(source)
    with raises(raycam.SettingsError, code="conflicting_values"):
        raycam.load(tmp_path / "a.bin", kind="stl")
