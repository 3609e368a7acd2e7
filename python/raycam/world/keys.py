"""Keywords of objects and lights."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy.typing as npt

from ..camera import Camera
from ..errors import WorldError, nearest
from .texture import Texture, Wrap

__all__ = ["FogKeys", "LightKeys", "ObjectChanges", "ObjectKeys", "light_keys", "merge_keys", "object_keys"]

Color = npt.ArrayLike
"""Linear red, green and blue; one number for grey; "#rrggbb"; a colour name; or sRGB as `numpy.uint8`."""
Image = str | os.PathLike[str] | Texture | Mapping[str, Any] | npt.ArrayLike


class ObjectKeys(TypedDict, total=False):
    """The keys of `[[object]]`; the world file reference describes them."""

    name: str
    category: str | int
    visible: bool | Mapping[str, bool]
    shadow_catcher: bool
    lidar: Mapping[str, float]
    box: Mapping[str, Any] | npt.ArrayLike
    plane: Mapping[str, Any] | npt.ArrayLike
    sphere: Mapping[str, Any] | float
    cylinder: Mapping[str, Any]
    cone: Mapping[str, Any]
    torus: Mapping[str, Any]
    size: npt.ArrayLike
    radius: float
    height: float
    tube: float
    level: int
    segments: int
    mesh: str | os.PathLike[str]
    upright: bool
    vertices: npt.ArrayLike
    triangles: npt.ArrayLike
    instance_of: str
    refine: int | Mapping[str, Any]
    displace: bool | Mapping[str, Any]
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
    type: Literal["matte", "metal", "glass", "principled", "unlit", "boundary"]
    color: Color
    texture: Image
    textures: Mapping[str, Image]
    wrap: Wrap | Sequence[Wrap]
    height_scale: float
    diffuse: float
    specular: float | npt.ArrayLike
    shininess: float
    emission: float | npt.ArrayLike
    opacity: float
    alpha: Literal["opaque", "blend"]
    metal: str
    roughness: float
    ior: float
    thin: bool
    dispersion: float
    attenuation_color: Color
    attenuation_distance: float
    priority: int
    medium: str | Mapping[str, Any]
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
    slots: Mapping[str | int, Mapping[str, Any]]


class ObjectChanges(ObjectKeys, total=False):
    """The keys of `World.set_object`.

    They are the keys of an object and the arguments of `World.add_mesh`.
    """

    faces: npt.ArrayLike
    material: Mapping[str, Any]


class FogKeys(TypedDict, total=False):
    """The keys of `[fog]`; the world file reference describes them."""

    visibility: float
    extinction: float | npt.ArrayLike
    albedo: float | npt.ArrayLike
    g: float
    height: float


class LightKeys(TypedDict, total=False):
    """The keys of `[[light]]`; the world file reference lists the keys of each type."""

    type: str
    name: str
    visible: Mapping[str, bool]
    body: bool
    temperature: float
    lux: float
    candela: float
    lumen: float
    nit: float
    camera: Camera | Mapping[str, Any]
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


SHAPES: dict[str, tuple[str, ...]] = {
    "box": ("size",),
    "plane": ("size",),
    "sphere": ("radius", "level"),
    "cylinder": ("radius", "height", "segments"),
    "cone": ("radius", "height", "segments"),
    "torus": ("radius", "tube", "segments"),
}
"""The keys of each shape. A number or list instead of the table is the first key, if the others are optional."""
SIZED = ("box", "plane", "sphere")
"""Shapes whose size is given by their first key alone."""
STRENGTH_KEYS = ("irradiance", "power", "intensity", "radiance")
"""Light keys for the strength in physical units."""
PHOTOMETRIC_KEYS = ("lux", "candela", "lumen", "nit")
"""Light keys for the strength in photometric units."""


def object_keys(
    description: Mapping[str, Any] | str | os.PathLike[str] | None, keys: dict[str, Any]
) -> dict[str, Any]:
    """Merges an object's description with keywords; returns the object's keys.

    The description is a dict, a mesh file's path or a shape's name. Raises `WorldError` for a string that is neither a
    mesh file nor a shape.
    """
    if isinstance(description, str) and description.lower() in SHAPES:
        description = {description.lower(): {}}
    elif isinstance(description, str | os.PathLike):
        if not Path(description).suffix:
            raise WorldError(
                f"{nearest('shape', os.fspath(description), list(SHAPES))}; a mesh file has an ending, as in cow.obj",
                code="unknown_name",
            )
        description = {"mesh": os.fspath(description)}
    given = merge_keys(description, keys)
    if isinstance(given.get("slots"), Mapping):
        given["slots"] = _slot_tables(given["slots"])
    for shape, own in SHAPES.items():
        if shape in given:
            given[shape] = _shape_table(shape, own, given)
    return given


def _slot_tables(slots: Mapping[Any, Any]) -> dict[str, Any]:
    """Returns the changes of material slots with text as keys, as in world files.

    Raises `WorldError` if a number is given both as an integer and as a string.
    """
    found: dict[str, Any] = {}
    for slot, changes in slots.items():
        if str(slot) in found:
            raise WorldError(
                f"slots: slot {slot} occurs twice, as an integer and as a string; remove one of them",
                code="conflicting_values",
            )
        found[str(slot)] = changes
    return found


def _shape_table(shape: str, own: tuple[str, ...], given: dict[str, Any]) -> dict[str, Any]:
    """Returns the table of a shape, including keys that are given next to the shape.

    These keys are removed from the object's keys.
    """
    table = given[shape]
    if (
        table is None
        or isinstance(table, bool | str | bytes)
        or (shape not in SIZED and not isinstance(table, Mapping))
    ):
        raise WorldError(
            f"{shape}: {table!r}: expected a dict of {', '.join(own)}, such as {shape}={{{own[0]!r}: 1}}",
            code="wrong_type",
        )
    table = dict(table) if isinstance(table, Mapping) else {own[0]: table}
    for key in own:
        if key in given:
            if key in table:
                raise WorldError(
                    f"{key}: passed twice, for the object and in its {shape}", code="duplicate_name"
                )
            table[key] = given.pop(key)
    return table


def light_keys(description: Mapping[str, Any] | str | None, keys: dict[str, Any]) -> dict[str, Any]:
    """Merges a light's description (a dict or the type) with keywords; returns the light's keys."""
    if isinstance(description, str):
        description = {"type": description}
    return merge_keys(description, keys)


def merge_keys(description: Mapping[str, Any] | None, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Merges a description with keywords.

    Raises `WorldError` for a description that is not a dict.
    """
    if description is not None and not isinstance(description, Mapping):
        raise WorldError(
            f"expected a dict, a string or keywords, not {type(description).__name__}", code="wrong_type"
        )
    return {**(description or {}), **keys}
