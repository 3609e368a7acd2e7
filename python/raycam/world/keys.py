"""Keywords of objects and lights, and the words that are understood for them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy.typing as npt

from ..errors import WorldError, nearest
from ..notices import warn
from .texture import Texture, Wrap

__all__ = ["LightKeys", "ObjectChanges", "ObjectKeys", "light_keys", "object_keys"]

Color = npt.ArrayLike
"""Linear red, green, blue; one number; "#rrggbb", a name; or bytes as `numpy.uint8`."""
Image = str | os.PathLike[str] | Texture | Mapping[str, Any] | npt.ArrayLike


class ObjectKeys(TypedDict, total=False):
    """The keys of `[[object]]`, as the reference describes them."""

    name: str
    category: str | int
    visible: bool
    shadow_catcher: bool
    box: Mapping[str, Any]
    plane: Mapping[str, Any]
    sphere: Mapping[str, Any]
    cylinder: Mapping[str, Any]
    cone: Mapping[str, Any]
    torus: Mapping[str, Any]
    mesh: str | os.PathLike[str]
    upright: bool
    vertices: npt.ArrayLike
    triangles: npt.ArrayLike
    instance_of: str
    refine: int | Mapping[str, Any]
    face_colors: npt.ArrayLike
    vertex_colors: npt.ArrayLike
    uvs: npt.ArrayLike
    normals: npt.ArrayLike
    location: npt.ArrayLike
    roll: float
    pitch: float
    yaw: float
    scale: float | npt.ArrayLike
    matrix: npt.ArrayLike
    type: Literal["matte", "metal", "glass", "principled", "unlit"]
    color: Color
    texture: Image
    textures: Mapping[str, Image]
    wrap: Wrap | Sequence[Wrap]
    diffuse: float
    specular: float | npt.ArrayLike
    shininess: float
    emission: float | npt.ArrayLike
    opacity: float
    metal: str
    roughness: float
    ior: float
    thin: bool
    dispersion: float
    attenuation_color: Color
    attenuation_distance: float
    priority: int
    metallic: float
    specular_color: Color
    transmission: float
    clearcoat: float
    clearcoat_roughness: float
    sheen_color: Color
    sheen_roughness: float
    iridescence: float
    iridescence_ior: float
    iridescence_thickness: float
    anisotropy: float
    anisotropy_rotation: float
    diffuse_transmission: float
    diffuse_transmission_color: Color


class ObjectChanges(ObjectKeys, total=False):
    """The keys of `World.set_object`: those of an object, and those of `World.add_mesh`."""

    faces: npt.ArrayLike
    material: Mapping[str, Any]


class LightKeys(TypedDict, total=False):
    """The keys of `[[light]]`, as the reference describes them; each type has some."""

    type: str
    direction: npt.ArrayLike
    position: npt.ArrayLike
    target: npt.ArrayLike | str
    size: npt.ArrayLike
    irradiance: npt.ArrayLike
    radiance: npt.ArrayLike
    power: npt.ArrayLike
    intensity: npt.ArrayLike
    radius: float
    angular_diameter: float
    inner: float
    outer: float
    u: npt.ArrayLike
    v: npt.ArrayLike
    two_sided: bool
    profile: str | os.PathLike[str]
    front: npt.ArrayLike
    zenith: npt.ArrayLike
    horizon: npt.ArrayLike
    ground: npt.ArrayLike
    turbidity: float
    scale: float
    image: str | os.PathLike[str] | npt.ArrayLike
    yaw: float


SHAPES = ("box", "plane", "sphere", "cylinder", "cone", "torus")
LIGHTS = ("sun", "point", "spot", "area", "disk", "ies", "sky", "daylight", "environment")
OBJECT_WORDS = {
    "position": "location",
    "translation": "location",
    "cube": "box",
    "ball": "sphere",
    "transform": "matrix",
}
"""Words of other programs for keys of objects."""
STRENGTHS: dict[str, tuple[tuple[str, ...], str]] = {
    "sun": (("irradiance",), "irradiance, in W/m² on a surface that faces it"),
    **dict.fromkeys(
        ("point", "bulb", "spot"), (("power", "intensity"), "power, in W, or its intensity, in W/sr")
    ),
    "ies": (("power",), "power, in W, or the candela of its profile"),
    **dict.fromkeys(("area", "disk"), (("radiance",), "radiance, in W/(m² sr)")),
    "sky": (("radiance",), "radiance, or zenith and horizon, in W/(m² sr)"),
    **dict.fromkeys(("daylight", "environment"), ((), "scale, a factor")),
}
"""By type of light: the keys of its strength, and their description."""
STRENGTH_WORDS = ("power", "intensity", "irradiance", "radiance", "strength", "energy", "brightness", "watts")
LIGHT_WORDS = {"location": "position"}
"""Words of other programs for keys of lights."""


def object_keys(
    description: Mapping[str, Any] | str | os.PathLike[str] | None, keys: dict[str, Any]
) -> dict[str, Any]:
    """The keys of an object that is described by a dict, a mesh file's path or the word for a shape, and by keywords.

    Raises `WorldError` for a text that is neither.
    """
    if isinstance(description, str) and description.lower() in (*SHAPES, "cube", "ball"):
        word = description.lower()
        description = {OBJECT_WORDS.get(word, word): {}}
    elif isinstance(description, str | os.PathLike):
        if not Path(description).suffix:
            raise WorldError(
                f"{nearest('shape', os.fspath(description), list(SHAPES))}; a mesh file has an ending, as in cow.obj"
            )
        description = {"mesh": os.fspath(description)}
    return _renamed(_together(description, keys), OBJECT_WORDS)


def light_keys(description: Mapping[str, Any] | str | None, keys: dict[str, Any]) -> dict[str, Any]:
    """The keys of a light that is described by a dict or the word for its type, and by keywords."""
    if isinstance(description, str):
        description = {"type": description}
    given = _renamed(_together(description, keys), LIGHT_WORDS)
    kind = given.get("type")
    if isinstance(kind, str) and kind in STRENGTHS:
        own = STRENGTHS[kind][0]
        for word in STRENGTH_WORDS:
            if word in given and word not in own:
                raise WorldError(
                    f"{word}: the strength of a light of type {kind!r} is its {STRENGTHS[kind][1]}"
                )
    return given


def _together(description: Mapping[str, Any] | None, keys: dict[str, Any]) -> dict[str, Any]:
    if description is not None and not isinstance(description, Mapping):
        raise WorldError(f"expected a dict, a text or keywords, not {type(description).__name__}")
    return {**(description or {}), **keys}


def _renamed(keys: dict[str, Any], words: Mapping[str, str]) -> dict[str, Any]:
    """The keys under the names of raycam, with a notice for each other word."""
    for word, name in words.items():
        if word in keys and name not in keys:
            keys[name] = keys.pop(word)
            warn(f"{word} is understood as {name}, its name here")
    return keys
