"""USD stages for tests, created with OpenUSD."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def stage(path: Path, up: str = "Z") -> Any:
    """A new stage in metres."""
    path.parent.mkdir(parents=True, exist_ok=True)
    made = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(made, up)
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    return made


def square(made: Any, name: str = "/world/square", points: Any = SQUARE) -> Any:
    """A polygon without material."""
    mesh = UsdGeom.Mesh.Define(made, name)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([len(points)])
    mesh.CreateFaceVertexIndicesAttr(list(range(len(points))))
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def material(made: Any, name: str, **inputs: Any) -> Any:
    """A UsdPreviewSurface with these inputs."""
    found = UsdShade.Material.Define(made, name)
    shader = UsdShade.Shader.Define(made, f"{name}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for key, value in inputs.items():
        kind = Sdf.ValueTypeNames.Color3f if isinstance(value, tuple) else Sdf.ValueTypeNames.Float
        shader.CreateInput(key, kind).Set(value)
    found.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return found


def bind(mesh: Any, paint: Any, purpose: str = "") -> None:
    """Binds a material for a purpose."""
    api = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
    api.Bind(paint, UsdShade.Tokens.weakerThanDescendants, purpose or UsdShade.Tokens.allPurpose)


def uvs(mesh: Any, corners: Any = ((0, 0), (1, 0), (1, 1), (0, 1))) -> None:
    """Texture coordinates of every corner."""
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    primvar.Set(Vt.Vec2fArray([tuple(map(float, corner)) for corner in corners]))


def image(
    made: Any,
    paint: Any,
    file: str,
    outputs: dict[str, str],
    transform: dict[str, Any] | None = None,
    name: str = "image",
    fallback: Any = None,
    **inputs: Any,
) -> None:
    """An image whose outputs ({"diffuseColor": "rgb"}) are inputs of a material.

    `fallback` is the texture coordinate for meshes without any.
    """
    root = paint.GetPath().pathString
    reader = UsdShade.Shader.Define(made, f"{root}/{name}_reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    if fallback is not None:
        reader.CreateInput("fallback", Sdf.ValueTypeNames.Float2).Set(fallback)
    source = reader
    if transform is not None:
        source = UsdShade.Shader.Define(made, f"{root}/{name}_transform")
        source.CreateIdAttr("UsdTransform2d")
        source.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        for key, value in transform.items():
            kind = Sdf.ValueTypeNames.Float if key == "rotation" else Sdf.ValueTypeNames.Float2
            source.CreateInput(key, kind).Set(value)
    shader = UsdShade.Shader.Define(made, f"{root}/{name}")
    shader.CreateIdAttr("UsdUVTexture")
    shader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    shader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(source.ConnectableAPI(), "result")
    for key, value in inputs.items():
        kind = Sdf.ValueTypeNames.Token if isinstance(value, str) else Sdf.ValueTypeNames.Float4
        shader.CreateInput(key, kind).Set(value)
    surface = UsdShade.Shader(made.GetPrimAtPath(f"{root}/surface"))
    for key, output in outputs.items():
        color = key.endswith("Color")
        kind = Sdf.ValueTypeNames.Color3f if color else Sdf.ValueTypeNames.Float
        surface.CreateInput(key, kind).ConnectToSource(shader.ConnectableAPI(), output)


def write_image(path: Path, pixels: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Writes 8-bit pixels as an image, and returns them."""
    array = np.asarray(pixels, np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)
    return array
