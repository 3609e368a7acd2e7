"""Point instancers of USD. Source: the schema `UsdGeomPointInstancer`."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Gf, Usd, UsdGeom

__all__ = ["instances"]


def instances(
    instancer: UsdGeom.PointInstancer,
    world_from_instancer: Gf.Matrix4d,
    places: UsdGeom.XformCache,
    time: Usd.TimeCode,
) -> Iterator[tuple[int, Usd.Prim, Gf.Matrix4d]]:
    """Iterates over the unmasked instances: their index, and each prim of the prototype with world_from_prim."""
    stage = instancer.GetPrim().GetStage()
    which = instancer.GetProtoIndicesAttr().Get(time) or []
    roots = [stage.GetPrimAtPath(path) for path in instancer.GetPrototypesRel().GetForwardedTargets()]
    options = UsdGeom.PointInstancer
    transforms = instancer.ComputeInstanceTransformsAtTime(
        time, time, options.IncludeProtoXform, options.IgnoreMask
    )
    mask = instancer.ComputeMaskAtTime(time) or [True] * len(which)
    predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    for number, (proto, transform, shown) in enumerate(zip(which, transforms, mask, strict=False)):
        if not (shown and 0 <= proto < len(roots) and roots[proto]):
            continue
        for prim in Usd.PrimRange(roots[proto], predicate):
            in_proto, _ = places.ComputeRelativeTransform(prim, roots[proto])
            yield number, prim, in_proto * transform * world_from_instancer
