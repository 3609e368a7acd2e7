"""Defines names and values of MuJoCo's enumerations.

With these values, a model's arrays can be read without importing MuJoCo.
"""

from __future__ import annotations

import sys
from typing import Any

from ...errors import WorldError

__all__ = [
    "BOX",
    "CAPSULE",
    "CYLINDER",
    "DECORATION",
    "DIRECTIONAL",
    "ELLIPSOID",
    "FLEX_OBJECT",
    "GEOM_OBJECT",
    "HFIELD",
    "MESH",
    "PLANE",
    "POINT",
    "PREFIXES",
    "SDF",
    "SITE_OBJECT",
    "SKIN_OBJECT",
    "SPHERE",
    "SPOT",
    "TENDON_OBJECT",
    "check_model",
    "element_name",
    "element_prefix",
]

PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF = range(9)
"""Values of `mjtGeom`."""
SPOT, DIRECTIONAL, POINT = 0, 1, 2
"""Values of `mjtLightType`."""
GEOM_OBJECT, SITE_OBJECT, FLEX_OBJECT, SKIN_OBJECT, TENDON_OBJECT = 5, 6, 9, 11, 18
"""Values of `mjtObj`, as in the second channel of MuJoCo's segmentation images."""
DECORATION = 4
"""The value of `mjtCatBit.mjCAT_DECOR`: contact points, joint axes, frames and geoms of programs."""

PREFIXES = {
    GEOM_OBJECT: "geom",
    SITE_OBJECT: "site",
    FLEX_OBJECT: "flex",
    SKIN_OBJECT: "skin",
    TENDON_OBJECT: "tendon",
}

FIRST_VERSION = "3.3.3"
"""The first version of MuJoCo whose models have all arrays that are read."""
ARRAYS = (
    "geom_type", "mesh_vert", "mesh_facetexcoord", "light_type", "light_attenuation", "cam_resolution",
    "cam_sensorsize", "cam_intrinsic", "tex_data", "tex_colorspace", "flex_vertadr", "skin_vert", "names",
)  # fmt: skip
"""Arrays that are read; models of older versions do not have all of them."""


def check_model(model: Any) -> None:
    """Raises `WorldError` unless `model` is a MuJoCo model of a supported version."""
    if not hasattr(model, "geom_type") or not hasattr(model, "mesh_vert"):
        raise WorldError(f"expected a mujoco.MjModel, not {type(model).__name__}", code="wrong_type")
    missing = [name for name in ARRAYS if not hasattr(model, name)]
    if missing:
        version = getattr(sys.modules.get("mujoco"), "__version__", "of an unknown version")
        raise WorldError(
            f"the model of MuJoCo {version} has no {', '.join(missing)}; raycam requires MuJoCo {FIRST_VERSION} or"
            " newer: pip install --upgrade mujoco, and compile the model again",
            code="unsupported_version",
        )


def element_name(model: Any, kind: str, number: int) -> str:
    """Returns an element's name, or its kind and number if the element has no name."""
    start = int(getattr(model, f"name_{kind}adr")[number])
    names = bytes(model.names)
    return names[start : names.index(b"\0", start)].decode("utf-8", "replace") or f"{kind}{number}"


def element_prefix(kind: int) -> str:
    """Returns the prefix of the arrays of a kind of element.

    The prefix is "geom", "site", "flex", "skin" or "tendon".
    """
    return PREFIXES[kind]
