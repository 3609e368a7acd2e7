"""The textures of an object's material in a view.

Thumbnails of textures are shown; a texture can be replaced by an image file, or removed.
"""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..._core import srgb_from_linear
from ...arguments import one_of
from ...camera import Camera
from ...errors import Error
from ...notices import collected
from ...render import render
from ...world import World
from .contents import materials_of_object

__all__ = ["TEXTURE_KEYS", "TextureKey", "list_textures", "set_texture", "thumbnail"]

TextureKey = Literal["color", "normal", "roughness", "metallic", "emission"]
TEXTURE_KEYS: tuple[TextureKey, ...] = ("color", "normal", "roughness", "metallic", "emission")
"""The textures that the client shows; other textures of the material stay unchanged."""
THUMBNAIL_SIDE = 64
GLTF_TEXTURES = {
    "normal": "normalTexture",
    "roughness": "metallicRoughnessTexture",
    "metallic": "metallicRoughnessTexture",
    "emission": "emissiveTexture",
}
NEUTRAL: dict[str, tuple[int, int, int]] = {"normal": (128, 128, 255)}
"""The sRGB texel values without effect, by texture key; white for keys that are not listed."""


def list_textures(world: World, number: int, slot: int = 0) -> list[dict[str, Any]]:
    """The possible textures of the material in an object's slot: key, image file, and whether each is used.

    The image file is empty for a texture without an image. The result is empty for an unknown object or slot.
    """
    materials = materials_of_object(world, number)
    if slot >= len(materials):
        return []
    found = materials[slot]
    names = world._core.textures
    values = found["model"].get("Principled", {}) if isinstance(found["model"], dict) else {}
    places = {
        "color": found.get("texture"),
        "normal": (found.get("normal_map") or {}).get("texture"),
        "emission": found["emission"].get("texture"),
        **{key: values.get(key, {}).get("texture") for key in ("roughness", "metallic")},
    }
    textures = []
    for key in TEXTURE_KEYS:
        place = places[key]
        if place is None and key != "color" and not values:
            continue  # only principled materials have other textures
        name = "" if place is None else names[place["texture"]]
        textures.append({"texture": key, "file": os.path.basename(name), "used": place is not None})
    return textures


def set_texture(world: World, number: int, key: str, image: str | None, slot: int | None = None) -> World:
    """Returns a copy of a world with another texture of a material.

    The material is in the object's slot `slot`; None changes all materials of the object. If `image` is None, the
    texture is neutral. Raises `WorldError` for an unknown object or slot, for an object without texture coordinates,
    and the errors of the image file.
    """
    one_of("texture", key, list(TEXTURE_KEYS))
    texture: Any = image
    if image is None:
        texture = np.full((1, 1, 3), NEUTRAL.get(key, (255, 255, 255)), np.uint8)
    changed = world.copy()
    keys: dict[str, Any] = {"texture": texture} if key == "color" else {"textures": {key: texture}}
    factors: dict[str | int, dict[str, Any]] = {
        i: _factor(each, key) for i, each in enumerate(materials_of_object(world, number))
    }
    if slot is None:
        changed.set_object(number, **keys, slots=factors)
    else:
        changed.set_object(number, slots={slot: keys | factors.get(slot, {})})
    return changed


def _factor(found: dict[str, Any], key: str) -> dict[str, Any]:
    """Returns the key and value of the material that a texture multiplies, so that the value is kept."""
    if key == "color" and "color" in found:
        return {"color": found["color"]}
    values = found["model"].get("Principled", {}) if isinstance(found.get("model"), dict) else {}
    if key in ("roughness", "metallic") and key in values:
        return {key: values[key]["value"]}
    if key == "emission" and max(found["emission"]["value"], default=0) > 0:
        return {"emission": found["emission"]["value"]}
    return {}


def thumbnail(world: World, number: int, key: str, slot: int = 0) -> npt.NDArray[np.uint8] | None:
    """The image [64, 64, 3] of a texture of a material, over the unit square.

    The material is in the object's slot `slot`, which must exist. The result is None if the file cannot be shown.
    """
    square = World._of(world._core.material_square(number, slot))
    try:
        if key == "color":
            square.set_object(0, color=[1.0, 1.0, 1.0])
            return _picture(square)
        with tempfile.TemporaryDirectory(prefix="raycam-thumbnail-") as folder:
            file = _extract(square, key, Path(folder))
            if file is None:
                return None
            shown = World()
            shown.add_object(plane={"size": [1, 1]}, type="unlit", texture=file)
            return _picture(shown)
    except (Error, OSError, ValueError, KeyError, IndexError):
        return None


def _picture(square: World) -> npt.NDArray[np.uint8]:
    """The albedo of a unit square around the origin, seen along its normal, as sRGB bytes."""
    half = (THUMBNAIL_SIDE - 1) / 2
    K = np.array([[THUMBNAIL_SIDE, 0, half], [0, THUMBNAIL_SIDE, half], [0, 0, 1.0]])
    camera = Camera(K, np.diag([1.0, -1.0, -1.0]), [0, 0, 1.0], (THUMBNAIL_SIDE, THUMBNAIL_SIDE))
    with collected():
        albedo = render(square, camera, channels="albedo", samples=4, threads=1)["albedo"]
    return srgb_from_linear(np.ascontiguousarray(albedo, np.float32).reshape(-1), 1.0, 8, "standard").reshape(
        albedo.shape
    )


def _extract(square: World, key: str, folder: Path) -> Path | None:
    """Writes the image of a material's texture into a folder, and returns the file's path.

    The material belongs to the world's only object. The image is extracted from a GLB file. Without an image,
    the result is None.
    """
    with collected():
        square.to_gltf(folder / "square.glb")
    data = (folder / "square.glb").read_bytes()
    length = int.from_bytes(data[12:16], "little")
    document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    material = document["materials"][document["meshes"][0]["primitives"][0]["material"]]
    place = material["pbrMetallicRoughness"] if key in ("roughness", "metallic") else material
    info = place.get(GLTF_TEXTURES[key])
    if info is None:
        return None
    image = document["images"][document["textures"][info["index"]]["source"]]
    view = document["bufferViews"][image["bufferView"]]
    start = view.get("byteOffset", 0)
    file = folder / f"image.{image['mimeType'].partition('/')[2]}"
    file.write_bytes(binary[start : start + view["byteLength"]])
    return file
