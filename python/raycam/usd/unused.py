"""Properties of USD lights, cameras and models that raycam ignores, as texts for notices."""

from __future__ import annotations

from typing import Any

from pxr import Usd, UsdGeom, UsdLux

__all__ = ["unused_of_camera", "unused_of_light", "unused_of_model"]

LIGHT_INPUTS: dict[str, tuple[str, Any]] = {
    "shaping:focus": ("the light's focus", 0.0),
    "diffuse": ("the light's factor of diffuse reflection", 1.0),
    "specular": ("the light's factor of specular reflection", 1.0),
    "shadow:enable": ("the light's disabled shadows", True),
}
"""Ignored inputs of all lights: the ignored property, and the input's neutral value."""
FORMATS = ("automatic", "latlong")
"""Formats of a dome's image that are shown."""
OLD_INPUTS = (
    *("intensity", "exposure", "color", "normalize", "radius", "width", "height", "angle"),
    *("enableColorTemperature", "colorTemperature", "texture:file", "shaping:cone:angle"),
)
"""Inputs that were written without "inputs:" before USD 21.05; Pixar's library no longer reads these names."""
SHAPED = ("SphereLight",)
"""Types of lights for which the cone is applied."""
DRAWN = ("default", "inherited", "")
"""Draw modes that show the meshes."""


def unused_of_light(prim: Usd.Prim, time: Usd.TimeCode) -> list[str]:
    """Texts for a light's properties that raycam ignores."""

    def value(key: str, default: Any) -> Any:
        attribute = prim.GetAttribute(f"inputs:{key}")
        found = attribute.Get(time) if attribute else None
        return default if found is None else found

    said = [words for key, (words, neutral) in LIGHT_INPUTS.items() if value(key, neutral) != neutral]
    if profile := getattr(value("shaping:ies:file", None), "path", ""):
        said.append(f"the light's profile {profile!r}")
    kind = prim.GetTypeName()
    angle = value("shaping:cone:angle", 180.0)
    if kind in SHAPED and 90 < angle < 180:
        said.append(
            f"the light's cone of {angle:g} degrees (maximum: 90; the light shines in all directions)"
        )
    elif kind not in SHAPED and angle < 180 and prim.HasAPI(UsdLux.ShapingAPI):
        said.append(f"the light's cone of {angle:g} degrees")
    if kind.startswith("DomeLight") and (format := value("texture:format", "automatic")) not in FORMATS:
        said.append(f"the image's format {format}")
    filters = prim.GetRelationship("light:filters")
    if filters and filters.GetTargets():
        said.append("the light's filters")
    light = UsdLux.LightAPI(prim)
    linked = (light.GetLightLinkCollectionAPI(), light.GetShadowLinkCollectionAPI())
    if any(_leaves_out(collection) for collection in linked):
        said.append("the light's links (all objects are lit)")
    old = [
        key
        for key in OLD_INPUTS
        if prim.GetAttribute(key).HasAuthoredValue()
        and not prim.GetAttribute(f"inputs:{key}").HasAuthoredValue()
    ]
    if old:
        said.append(f"{', '.join(old)}, names from before USD 21.05 (now inputs:{old[0]})")
    return said


def unused_of_camera(prim: Usd.Prim, time: Usd.TimeCode) -> list[str]:
    """Texts for a camera's properties that raycam ignores."""
    source = UsdGeom.Camera(prim)
    said = []
    if source.GetExposureAttr().Get(time):
        said.append("the camera's exposure (render with exposure=)")
    if source.GetFStopAttr().Get(time) and not (source.GetFocusDistanceAttr().Get(time) or 0) > 0:
        said.append("the camera's f-stop (focusDistance is missing, so the whole image is sharp)")
    if source.GetClippingPlanesAttr().Get(time):
        said.append("the camera's clipping planes")
    return said


def unused_of_model(prim: Usd.Prim) -> list[str]:
    """Texts for a model's or a mesh's properties that raycam ignores."""
    said: list[str] = []
    schemas = prim.GetAppliedSchemas()
    if not schemas:
        return said
    if prim.HasAPI(UsdGeom.ModelAPI):
        mode = UsdGeom.ModelAPI(prim).GetModelDrawModeAttr().Get() or ""
        if mode not in DRAWN:
            said.append(f"the draw mode {mode} (meshes are shown)")
    shining = [name for name in schemas if name in ("MeshLightAPI", "VolumeLightAPI")]
    said.extend(f"the emitted light ({name})" for name in shining)
    return said


def _leaves_out(collection: Usd.CollectionAPI) -> bool:
    """True for a collection with its own list of prims, which may exclude some."""
    root = collection.GetIncludeRootAttr()
    excluded = collection.GetExcludesRel()
    return bool(root and root.Get() is False) or bool(excluded and excluded.GetTargets())
