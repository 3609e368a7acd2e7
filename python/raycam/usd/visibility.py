"""Prims that are hidden by their visibility or purpose."""

from __future__ import annotations

from typing import Any

from pxr import Sdf, Usd, UsdGeom

__all__ = ["PrimVisibility"]


class PrimVisibility:
    """The visibility and purpose of prims; the values of parents are computed only once."""

    def __init__(self, time: Usd.TimeCode) -> None:
        self._time = time
        self._visible: dict[tuple[Sdf.Path, Sdf.Path | None], bool] = {}
        self._purposes: dict[Sdf.Path, Any] = {}

    def hidden_reason(self, prim: Usd.Prim, prototype: Usd.Prim | None = None) -> str | None:
        """The reason why a prim is not shown; None if the prim is shown.

        Within a `prototype` of a point instancer, the visibility of the prims above it has no effect, as in Storm.
        """
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return None
        if not self._is_visible(prim, prototype.GetParent() if prototype else None):
            return "invisible"
        parent = prim.GetParent()
        path = parent.GetPath()
        if path not in self._purposes:
            above = UsdGeom.Imageable(parent)
            self._purposes[path] = above.ComputePurposeInfo() if above else None
        above_info = self._purposes[path]
        info = imageable.ComputePurposeInfo(above_info) if above_info else imageable.ComputePurposeInfo()
        purpose = info.purpose
        return f"of purpose {purpose}" if purpose in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy) else None

    def _is_visible(self, prim: Usd.Prim, outside: Usd.Prim | None) -> bool:
        """True if neither the prim nor a parent below `outside` is invisible."""
        key = (prim.GetPath(), outside.GetPath() if outside else None)
        if key not in self._visible:
            parent = prim.GetParent()
            is_top = not parent or parent.IsPseudoRoot() or parent == outside
            above = is_top or self._is_visible(parent, outside)
            imageable = UsdGeom.Imageable(prim)
            own = imageable.GetVisibilityAttr().Get(self._time) if imageable else None
            self._visible[key] = above and own != UsdGeom.Tokens.invisible
        return self._visible[key]
