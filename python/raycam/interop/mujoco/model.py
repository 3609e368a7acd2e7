"""Names and values of MuJoCo's enumerations, for reading a model's arrays without importing MuJoCo."""

from __future__ import annotations

from typing import Any

__all__ = [
    "BOX",
    "CAPSULE",
    "CYLINDER",
    "DIRECTIONAL",
    "ELLIPSOID",
    "FLEX_OBJECT",
    "GEOM_OBJECT",
    "HFIELD",
    "MESH",
    "PLANE",
    "POINT",
    "SDF",
    "SITE_OBJECT",
    "SKIN_OBJECT",
    "SPHERE",
    "SPOT",
    "element_name",
    "element_prefix",
]

PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF = range(9)
"""Values of `mjtGeom`."""
SPOT, DIRECTIONAL, POINT = 0, 1, 2
"""Values of `mjtLightType`."""
GEOM_OBJECT, SITE_OBJECT, FLEX_OBJECT, SKIN_OBJECT = 5, 6, 9, 11
"""Values of `mjtObj`, as in the second channel of MuJoCo's segmentation images."""


def element_name(model: Any, kind: str, number: int) -> str:
    """Returns the name of an element; its kind and number if it has none."""
    start = int(getattr(model, f"name_{kind}adr")[number])
    names = bytes(model.names)
    return names[start : names.index(b"\0", start)].decode("utf-8", "replace") or f"{kind}{number}"


def element_prefix(kind: int) -> str:
    """Returns the prefix of the arrays of a kind of element: "geom", "site", "flex" or "skin"."""
    return {GEOM_OBJECT: "geom", SITE_OBJECT: "site", FLEX_OBJECT: "flex", SKIN_OBJECT: "skin"}[kind]
