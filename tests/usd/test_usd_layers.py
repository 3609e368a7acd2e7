"""Layers and images named by a stage.

Forbidden and unreadable files are omitted with a notice.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from pxr import Sdf, Usd, UsdGeom, UsdUtils
from support.raises import has_notice, raises, warns
from support.usd_stages import bind, image, material, square, stage, uvs, write_image


def names(world: raycam.World) -> list[str]:
    return sorted(thing.name for thing in world.objects)


def corners(world: raycam.World) -> Any:
    """The triangles, sorted, with sorted vertices."""
    return np.array(sorted(sorted(triangle.tolist()) for triangle in world.triangles()))


def pixar_meshes(path: Path) -> list[str]:
    """The names of the meshes found by OpenUSD."""
    opened = Usd.Stage.Open(str(path))
    return sorted(prim.GetName() for prim in opened.Traverse() if prim.IsA(UsdGeom.Mesh))


ARCS = ["sublayer", "reference", "payload", "variant"]


def name_layer(made: Any, arc: str, asset: str) -> None:
    if arc == "sublayer":
        made.GetRootLayer().subLayerPaths.append(asset)
        return
    prim = UsdGeom.Xform.Define(made, "/world/other").GetPrim()
    if arc == "reference":
        prim.GetReferences().AddReference(asset)
    elif arc == "payload":
        prim.GetPayloads().AddPayload(asset)
    else:
        variants = prim.GetVariantSets().AddVariantSet("shape")
        variants.AddVariant("one")
        variants.SetVariantSelection("one")
        with variants.GetVariantEditContext():
            prim.GetReferences().AddReference(asset)


@pytest.mark.parametrize(
    ("arc", "asset", "code"),
    [
        *((arc, "./gone.usda", "missing_file") for arc in ARCS),
        ("sublayer", "look.mtlx", "unreadable_file"),
        ("reference", "look.mtlx", "unreadable_file"),
        ("payload", "https://example.org/a.usda", "missing_file"),
        ("sublayer", "https://example.org/a.usda", "missing_file"),
        ("reference", "./empty.usda", "unreadable_file"),
        ("payload", "./pointer.usda", "unreadable_file"),
        ("sublayer", "./broken.usda", "unreadable_file"),
        ("variant", "./broken.usda", "unreadable_file"),
        ("reference", "./folder.usda", "unreadable_file"),
    ],
)
def test_unreadable_layer_is_omitted_with_a_notice(tmp_path: Path, arc: str, asset: str, code: str) -> None:
    (tmp_path / "look.mtlx").write_text("<materialx/>")
    (tmp_path / "empty.usda").write_text("")
    (tmp_path / "pointer.usda").write_text(
        "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"
    )
    (tmp_path / "broken.usda").write_text('#usda 1.0\ndef Mesh "a" { int }\n')
    (tmp_path / "folder.usda").mkdir()
    made = stage(tmp_path / "a.usda")
    square(made, "/world/shown")
    name_layer(made, arc, asset)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert names(world) == ["shown"]
    assert has_notice(world.notices, code, tmp_path / "a.usda", repr(asset))
    assert len(world.notices) == 1


@pytest.mark.parametrize(
    ("arc", "how"),
    [
        *((arc, "up") for arc in ARCS),
        ("reference", "absolute"),
        ("sublayer", "link"),
        ("payload", "link"),
        ("reference", "package"),
    ],
)
def test_folder_argument_allows_layers_of_sibling_folders(tmp_path: Path, arc: str, how: str) -> None:
    other = stage(tmp_path / "parts" / "b.usda")
    square(other, "/part")
    square(other, "/part/inner")
    other.SetDefaultPrim(other.GetPrimAtPath("/part"))
    other.Save()
    made = stage(tmp_path / "scenes" / "a.usda")
    square(made, "/world/shown")
    asset = {"up": "../parts/b.usda", "absolute": str(tmp_path / "parts" / "b.usda"), "link": "./b.usda"}
    if how == "link":
        (tmp_path / "scenes" / "b.usda").symlink_to(tmp_path / "parts" / "b.usda")
    if how == "package":
        assert UsdUtils.CreateNewUsdzPackage(
            str(tmp_path / "parts" / "b.usda"), str(tmp_path / "parts" / "b.usdz")
        )
    name_layer(made, arc, asset.get(how, "../parts/b.usdz"))
    made.Save()
    world = raycam.load(tmp_path / "scenes" / "a.usda")
    assert names(world) == ["shown"]
    target = [tmp_path / "parts" / "b.usda"] if how == "link" else []
    assert has_notice(world.notices, "outside_root", f"folder={str(tmp_path)!r}", *target)
    whole = raycam.load(tmp_path / "scenes" / "a.usda", folder=tmp_path)
    assert not whole.notices
    expected = pixar_meshes(tmp_path / "scenes" / "a.usda")
    assert names(whole) == expected
    assert len(expected) >= 2


def test_folder_argument_must_contain_the_file(tmp_path: Path) -> None:
    made = stage(tmp_path / "a" / "a.usda")
    square(made)
    made.Save()
    with raises(raycam.SettingsError, code="outside_root", mentions=["a.usda", "b"]):
        raycam.load(tmp_path / "a" / "a.usda", folder=tmp_path / "b")
    (tmp_path / "b").mkdir()
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with raises(raycam.SettingsError, code="outside_root", mentions=["a.obj", "b"]):
        raycam.load(tmp_path / "a.obj", folder=tmp_path / "b")


def test_loaded_file_may_be_a_symbolic_link(tmp_path: Path) -> None:
    """The cache of Hugging Face has such links.

    One folder contains links with the files' names, another folder the files.
    """
    made = stage(tmp_path / "made" / "a.usda")
    mesh, paint = square(made), material(made, "/world/paint")
    uvs(mesh)
    image(made, paint, "./blue.png", {"diffuseColor": "rgb"})
    bind(mesh, paint)
    made.Save()
    write_image(tmp_path / "made" / "blue.png", [[[0, 0, 255]]])
    snapshot = tmp_path / "cache" / "snapshots"
    (tmp_path / "cache" / "blobs").mkdir(parents=True)
    snapshot.mkdir()
    for number, name in enumerate(("a.usda", "blue.png")):
        os.rename(tmp_path / "made" / name, tmp_path / "cache" / "blobs" / str(number))
        (snapshot / name).symlink_to(tmp_path / "cache" / "blobs" / str(number))
    world = raycam.load(snapshot / "a.usda")
    assert len(world.objects) == 1
    (notice,) = world.notices
    assert has_notice([notice], "outside_root", tmp_path / "cache" / "blobs" / "1")
    whole = raycam.load(snapshot / "a.usda", folder=tmp_path / "cache")
    assert not whole.notices
    np.testing.assert_allclose(whole.triangle_colors(), [[0, 0, 1]] * 2)


def test_packages_do_not_open_files_outside_of_the_folder(tmp_path: Path) -> None:
    secret = stage(tmp_path / "secret.usda")
    square(secret, "/part")
    secret.SetDefaultPrim(secret.GetPrimAtPath("/part"))
    secret.Save()
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "secret.usda"), str(tmp_path / "secret.usdz"))
    inside = tmp_path / "inside"
    for asset in (str(tmp_path / "secret.usda"), "../secret.usda", "../secret.usdz[secret.usda]"):
        layer = stage(inside / "root.usda")
        square(layer, "/shown")
        layer.DefinePrim("/other").GetReferences().AddReference(asset, "/part")
        layer.Save()
        with Sdf.ZipFileWriter.CreateNew(str(inside / "a.usdz")) as package:
            package.AddFile(str(inside / "root.usda"), "root.usda")
        for name in ("a.usdz", "root.usda"):
            assert names(raycam.load(inside / name)) == ["shown"]
        del layer
        (inside / "root.usda").unlink()


@pytest.mark.parametrize("template", [False, True])
def test_value_clips_outside_of_the_folder_are_refused(tmp_path: Path, template: bool) -> None:
    clip = stage(tmp_path / "clip.1.usda")
    clip_mesh = square(clip, "/shown")
    clip_mesh.GetPointsAttr().Set([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)], 0)
    clip.Save()
    made = stage(tmp_path / "inside" / "a.usda")
    mesh = square(made, "/shown")
    mesh.GetPointsAttr().Clear()
    api = Usd.ClipsAPI(mesh.GetPrim())
    api.SetClipPrimPath("/shown")
    if template:
        api.SetClipTemplateAssetPath("../clip.#.usda")
        api.SetClipTemplateStartTime(1)
        api.SetClipTemplateEndTime(1)
        api.SetClipTemplateStride(1)
    else:
        api.SetClipAssetPaths([Sdf.AssetPath("../clip.1.usda")])
        api.SetClipActive([(0, 0)])
        api.SetClipTimes([(0, 0)])
    square(made, "/other")
    made.Save()
    with raises(raycam.FormatError, code="outside_root", mentions=["a.usda"]):
        raycam.load(tmp_path / "inside" / "a.usda")
    points = mesh.GetPointsAttr().Get(Usd.TimeCode.EarliestTime())
    world = raycam.load(tmp_path / "inside" / "a.usda", folder=tmp_path)
    assert len(world.objects) == 2
    assert world.bounds is not None
    np.testing.assert_allclose(world.bounds[1], np.max(points, axis=0))


@pytest.mark.parametrize("where", ["own", "overridden"])
def test_expressions_in_paths_are_evaluated(tmp_path: Path, where: str) -> None:
    for name in ("one", "two"):
        part = stage(tmp_path / f"{name}.usda")
        square(part, f"/{name}/{name}_mesh")
        part.SetDefaultPrim(part.GetPrimAtPath(f"/{name}"))
        part.Save()
    made = stage(tmp_path / "a.usda")
    made.GetRootLayer().expressionVariables = {"NAME": "one"}
    made.SetDefaultPrim(made.DefinePrim("/world"))
    made.DefinePrim("/world/x").GetReferences().AddReference('`"./${NAME}.usda"`')
    made.Save()
    path = tmp_path / "a.usda"
    if where == "overridden":
        outer = stage(tmp_path / "b.usda")
        outer.GetRootLayer().expressionVariables = {"NAME": "two"}
        outer.DefinePrim("/all").GetReferences().AddReference("./a.usda")
        outer.Save()
        path = tmp_path / "b.usda"
    assert names(raycam.load(path)) == pixar_meshes(path) == ["one_mesh" if where == "own" else "two_mesh"]


@pytest.mark.parametrize(
    ("suffix", "asset"), [(".usda", "./b/x.png"), (".usdz", "x.png"), (".usda", "./b/b.usdz[x.png]")]
)
def test_images_of_nested_packages_are_read(tmp_path: Path, suffix: str, asset: str) -> None:
    write_image(tmp_path / "b" / "x.png", [[[255, 0, 0]]])
    made = stage(tmp_path / "b" / "b.usda")
    mesh, paint = square(made, "/part/mesh"), material(made, "/part/paint")
    uvs(mesh)
    image(made, paint, "./x.png", {"diffuseColor": "rgb"})
    bind(mesh, paint)
    made.SetDefaultPrim(made.GetPrimAtPath("/part"))
    made.Save()
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "b" / "b.usda"), str(tmp_path / "b" / "b.usdz"))
    outer = stage(tmp_path / "a.usda")
    outer.DefinePrim("/all").GetReferences().AddReference(f"./b/b{suffix}")
    if "[" in asset:
        outer.OverridePrim("/all/paint/image").GetAttribute("inputs:file").Set(asset)
    outer.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert not world.notices
    np.testing.assert_allclose(world.triangle_colors(), [[1, 0, 0]] * 2)


def test_usd_file_is_added_as_objects_of_a_world(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda", up="Y")
    for name, color, x in (("red", (1.0, 0.0, 0.0), 0), ("blue", (0.0, 0.0, 1.0), 5)):
        mesh = square(made, f"/world/{name}")
        mesh.AddTranslateOp().Set((x, 0, 2))
        mesh.AddScaleOp().Set((1, 1, -1))
        bind(mesh, material(made, f"/world/{name}_paint", diffuseColor=color))
    UsdGeom.Camera.Define(made, "/eye")
    made.Save()
    alone = raycam.load(tmp_path / "a.usda")
    world = raycam.World("y")
    assert world.add_object(mesh=tmp_path / "a.usda", category="model") == 0
    (thing,) = world.objects
    assert (thing.name, thing.category) == ("a", "model")
    np.testing.assert_allclose(corners(world), corners(alone), atol=1e-6)
    np.testing.assert_allclose(world.triangle_colors(), alone.triangle_colors(), atol=1e-6)
    assert has_notice(world.notices, "ignored_element", "(1)", "cameras")
    # In a world with another up axis, the file's content is turned upright: y becomes z.
    turned = raycam.World("z", folder=tmp_path)
    turned.add_object(mesh="a.usda", name="x", location=[1, 0, 0])
    points = alone.triangles().reshape(-1, 3)
    expected = np.unique(points[:, [0, 2, 1]] * [1, -1, 1] + [1, 0, 0], axis=0)
    np.testing.assert_allclose(np.unique(turned.triangles().reshape(-1, 3), axis=0), expected, atol=1e-6)
    assert has_notice(turned.notices, "converted_up_axis", "upright=False")
    lying = raycam.World("z")
    lying.add_object(mesh=str(tmp_path / "a.usda"), upright=False)
    np.testing.assert_allclose(corners(lying), corners(alone), atol=1e-6)


def test_folder_option_of_the_command_line_allows_more_layers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from raycam.cli import main

    other = stage(tmp_path / "b.usda")
    square(other, "/part")
    other.SetDefaultPrim(other.GetPrimAtPath("/part"))
    other.Save()
    made = stage(tmp_path / "inside" / "a.usda")
    made.DefinePrim("/world").GetReferences().AddReference("../b.usda")
    square(made, "/shown")
    made.Save()
    for folder, count in ([], 1), (["--folder", str(tmp_path)], 2):
        assert main(["info", str(tmp_path / "inside" / "a.usda"), *folder]) == 0
        assert f"objects    {count}," in capsys.readouterr().out


@pytest.mark.parametrize("how", ["dict", "file"])
def test_world_file_that_names_a_usd_file_raises_with_the_remedy(tmp_path: Path, how: str) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    made.Save()
    (tmp_path / "world.toml").write_text('[[object]]\nmesh = "a.usda"\n')
    description = {"object": [{"mesh": "a.usda"}]}
    read: Any = {
        "file": lambda: raycam.load(tmp_path / "world.toml"),
        "dict": lambda: raycam.World.from_dict(description, folder=tmp_path),
    }
    with raises(raycam.FormatError, code="unknown_format", mentions=["a.usda", "raycam.load", "to_gltf"]):
        read[how]()


def test_matrix_applies_to_the_axes_of_a_stage(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda", "Y")
    square(made, points=[(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)])
    made.Save()
    matrix = np.array([[0.0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]])
    world = raycam.World("z")
    with warns(raycam.Notice, code="converted_up_axis", mentions=["matrix"]):
        world.add_object(mesh=str(tmp_path / "a.usda"), matrix=matrix)
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]]) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(world.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-6)
    turned = raycam.World("z")
    turned.add_object(mesh=str(tmp_path / "a.usda"), matrix=np.eye(4), upright=True)
    np.testing.assert_allclose(turned.bounds, [[0, 0, 0], [1, 0, 2]], atol=1e-6)
